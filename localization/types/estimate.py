"""Results of the localiser: sweeps, matches, verdicts on hints, and estimates."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.types.arrays import BoolArray, read_only
from localization.types.pose import Pose, Twist
from localization.types.readings import Hint


class Verdict(StrEnum):
    """Decision on a hint."""

    ACCEPTED = "accepted"
    """The estimate moved to the best pose in the hint's window."""
    KEPT = "kept"
    """The estimate already explained the sweep at least as well."""
    AMBIGUOUS = "ambiguous"
    """Several poses explain the sweep equally well; none was taken."""
    REJECTED = "rejected"
    """No pose in the window explains the sweep."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A pose that a search found, and the share of the sweep that it explains."""

    map_from_base: Pose
    """The pose."""
    score: float
    """Share of the sweep that the pose explains, in [0, 1]."""
    evidence: float = 0.0
    """Logarithm of how much more often sweeps are like this one at a right pose than at a wrong one."""


@dataclass(frozen=True, slots=True, eq=False)
class HintVerdict:
    """The answer that every hint gets."""

    stamp: int
    """Time of the answer [ns]."""
    hint: Hint
    """The hint that is answered."""
    verdict: Verdict
    """The decision."""
    reason: str
    """One sentence for the operator."""
    candidates: tuple[Candidate, ...] = ()
    """The places found, best first; for ``ACCEPTED`` the first one was taken."""


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """Points of one or several scans, all brought to one instant, in ``base_link``."""

    stamp: int
    """The instant [ns]."""
    points: FloatArray
    """(N, 3) points [m]."""
    origins: FloatArray
    """(N, 3) start of the beam of each point [m]."""
    horizontal: npt.NDArray[np.bool_]
    """(N,) whether the point comes from a scanner whose plane is horizontal."""

    def __post_init__(self) -> None:
        n = len(self.points)
        object.__setattr__(self, "points", read_only(self.points, (n, 3), "sweep.points"))
        object.__setattr__(self, "origins", read_only(self.origins, (n, 3), "sweep.origins"))
        horizontal = np.array(self.horizontal, dtype=bool)
        horizontal.flags.writeable = False
        object.__setattr__(self, "horizontal", horizontal)

    def beam_lengths(self) -> FloatArray:
        """Return the length (N,) of the beam of each point [m], above 0."""
        beams = self.points - self.origins
        length: FloatArray = np.sqrt(np.einsum("ij,ij->i", beams, beams))
        return np.maximum(length, 1e-9)


@dataclass(frozen=True, slots=True, eq=False)
class RangeFit:
    """What a sweep says of a bias of its ranges whatever its pose is; that of level scanners, and that of the others."""

    gradient: FloatArray
    """(2,) ``information`` times the bias that fits best [1/m]."""
    information: FloatArray
    """(2, 2) information of the bias [1/m^2]."""
    shift: FloatArray
    """(6, 2) by how much the match moves with the bias, in its observable directions."""

    def counted(self, share: float) -> RangeFit:
        """Return it with a share of its information."""
        return RangeFit(share * self.gradient, share * self.information, self.shift)


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Result of registering one sweep against the cloud.

    Directions are unit vectors in the space of (position error in ``map`` [m], rotation error in
    ``base_link`` times ``LEVER`` [m]).
    """

    stamp: int
    """Time of the sweep [ns]."""
    map_from_base: Pose
    """Pose at which the sweep fits the map best, without the prior."""
    information: FloatArray
    """(6, 6) information of (position in ``map``, rotation in ``base_link``), debiased; zero where unobserved."""
    observable_directions: FloatArray
    """(k, 6), k <= 6: the directions in which the sweep constrains the pose, orthonormal."""
    distances: FloatArray
    """(N,) signed distance of each sweep point to the map [m]; NaN where the map has nothing near."""
    inlier_ratio: float
    """Share of the points that have a near, front-facing neighbour in the map, in [0, 1]."""
    ranges: RangeFit | None = None
    """What it says of the scanners' range bias; None in rough maps, whose own errors are larger, and of other methods."""

    def mapped(self, within: float) -> BoolArray:
        """Return (N,) whether each point of the sweep lies as near to a mapped surface as this [m]."""
        near: BoolArray = np.abs(np.nan_to_num(self.distances, nan=np.inf)) < within
        return near


@dataclass(frozen=True, slots=True)
class ScanConsistency:
    """How a sweep agrees with the map: shares of all its returned beams, in [0, 1].

    A beam is explained if it ends within 10 cm of a mapped surface that faces the scanner. The three
    kinds of unexplained beams add up to ``unexplained``; their sizes are estimated from a sample of the
    beams (see ``scan_consistency.ScanConsistencyConfig``).
    """

    unexplained: float
    """Share of the beams that the map does not explain."""
    occluded: float
    """Share of the beams that end before a mapped surface: an unmapped object stands there."""
    free_space_violation: float
    """Share of the beams that pass through a mapped surface: an object is gone, or the pose is wrong."""
    unmapped: float
    """Share of the beams that end where nothing is mapped, or only a surface seen from behind."""


class Health(StrEnum):
    """State of the estimate; ``Estimate.reasons`` gives the reasons."""

    WAITING = "waiting"
    TRACKING = "tracking"
    DEGRADED = "degraded"
    SLIPPING = "slipping"
    SUSPECT = "suspect"
    LOST = "lost"
    RELOCALISING = "relocalising"


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Estimate of the robot's pose, its uncertainty, and the evidence for it."""

    stamp: int
    """Time of the estimate [ns]."""
    map_from_base: Pose | None
    """Pose in the map; None while ``WAITING`` for a first one."""
    odom_from_base: Pose
    """Pose by dead reckoning: smooth; drifts, never jumps (REP 105)."""
    covariance: FloatArray
    """(6, 6) covariance of (position error in ``map`` axes [m], rotation error in ``base_link`` axes [rad])."""
    twist: Twist
    """Velocity of the base in its own frame."""
    health: Health
    """State of the estimate."""
    reasons: tuple[str, ...] = ()
    """Reasons of the state, and remarks, one sentence each."""
    match: Match | None = None
    """The registration, if this estimate contains a new one."""
    sweep: Sweep | None = None
    """The sweep that was registered."""
    verdict: HintVerdict | None = None
    """The answer to a hint, if it is given with this estimate."""
    nis: float | None = None
    """Normalised innovation squared of this estimate's registration."""
    hypotheses: tuple[Candidate, ...] = ()
    """Places between which the search has not decided yet, best first; they move with the robot."""
    consistency: ScanConsistency | None = None
    """How this estimate's sweep agrees with the map; None without a registered sweep."""

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "covariance", read_only(self.covariance, (6, 6), "estimate.covariance")
        )

    @property
    def unexplained(self) -> float | None:
        """Share of the sweep's beams that the map does not explain, in [0, 1]; None without a sweep."""
        return None if self.consistency is None else self.consistency.unexplained


@dataclass(frozen=True, slots=True)
class Preview:
    """What the last sweep says of a proposed pose, and of the present estimate."""

    stamp: int
    """Time of the sweep [ns]."""
    explained: float
    """Share of the sweep's points that lie on the map at the proposed pose, in [0, 1]."""
    present: float | None
    """The same at the present estimate; None if there is none."""
