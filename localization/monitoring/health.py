"""What state the estimate is in, and why, in words an operator understands."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.matching.registration import LEVER
from localization.matching.scan_consistency import explanation
from localization.types import SECOND, Health, Match, Pose, ScanConsistency

_AXES = ("forward", "sideways", "up", "roll", "pitch", "yaw")


@dataclass(frozen=True, slots=True)
class HealthConfig:
    """When doubt begins and when it ends."""

    low_inlier_ratio: float = 0.5
    """A sweep that explains less than this share of its points is doubtful."""
    strange: float = 0.25
    """Unexplained for about a second, more than this share of the sweeps is worth telling, though the
    pose is in no doubt."""
    through: float = 0.10
    """Passing through mapped surfaces for about a second, more than this share of the sweeps makes the
    pose suspect. Measured in the worlds, with people and with furniture moved: at most 0.06 where the
    pose is right; mostly 0.10 to 0.30 where it is wrong and the sweep fits all the same."""
    off_map: float = 0.5
    """If more than this share of a sweep ends where nothing is mapped, the robot has left the map: it goes
    by its own motion, and to look for it in the map would only find places that it is not at."""
    check_again: int = 100
    """Sweeps between searches of the whole map while that lasts; 10 s at 10 Hz."""
    odd: float = 0.08
    """When what is seen changed at once, the pose is suspect if more than this share of the sweep passes
    through mapped surfaces or ends where nothing is mapped."""
    settling: int = 12
    """Sweeps that must fit after what is seen changed at once, before the whole map is searched for where
    else they would: until then a robot that is lost is looked for nearby."""
    suspect_after: int = 3
    """Refused or doubtful sweeps in a row before the pose is suspect."""
    lost_after: int = 12
    """... and before it is lost, if they speak against the pose: fit the map where the robot cannot be,
    or pass through mapped surfaces; 1.2 s at 10 Hz."""
    blind_after: int = 50
    """... sweeps if they were refused, but for all that is known somebody stands before the scanners; 5 s
    at 10 Hz."""
    disagreements: int = 3
    """Second opinions in a row that differ before the pose is lost."""
    trusted_after: int = 3
    """Good sweeps in a row before trust returns."""
    lost_sigma: float = 1.0
    """A horizontal position known no better than this is lost, one sigma [m]."""
    silence: int = SECOND // 2
    """A scanner or encoder that says nothing for this long is missed [ns]."""
    opinion_distance: float = 0.2
    """How far the second opinion may lie from the estimate [m]; KISS-ICP's own error has a 95th
    percentile of 12 cm on such sweeps."""
    opinion_yaw: float = np.deg2rad(3.0)
    """The same for heading [rad]."""


class HealthMonitor:
    """Counts good and bad news about the estimate and says what state it is in."""

    def __init__(self, config: HealthConfig = HealthConfig()) -> None:
        self.config = config
        self.reset()

    def reset(self) -> None:
        """Begin afresh, as after a relocalisation."""
        self._bad, self._good, self._differ = 0, 0, 0
        self._why = ""
        self._blind: tuple[str, ...] = ()
        self._lost = False
        self._consistency = ScanConsistency(0.0, 0.0, 0.0, 0.0)
        self._through = 0
        self._off_map = False
        self._settling, self._settled = 0, False

    @property
    def doubtful(self) -> bool:
        """Whether the last sweep left doubt."""
        return self._bad > 0 or self._differ > 0 or self._through > 0

    @property
    def needs_check(self) -> bool:
        """Whether it is time to look whether another place explains what is seen."""
        c = self.config
        return self._settled or self._through % c.check_again == c.suspect_after

    def broken(self, consistency: ScanConsistency | None) -> None:
        """Take note that what is seen changed at once, or was not seen for a while: see ``Continuity``.

        People who step before a scanner, or away from it, change it as well: but they hide the map, and
        nothing of the sweep passes through it or leaves it.
        """
        if (
            consistency is None
            or consistency.free_space_violation + consistency.unmapped > self.config.odd
        ):
            self._settling = self.config.settling

    @property
    def lost(self) -> bool:
        """Whether the pose must not be relied on."""
        return self._lost

    def sweep(
        self,
        match: Match,
        pose: Pose,
        refusal: str | None,
        consistency: ScanConsistency | None = None,
    ) -> None:
        """Take note of a registration.

        Args:
            match: what came of it.
            pose: ``map_from_base``.
            refusal: why it was refused, if it was.
            consistency: what the map does not explain of the sweep, if that was looked at.
        """
        self._blind = blind_axes(match, pose)
        self._consistency = _smoothed(self._consistency, consistency)
        doubt = refusal
        if doubt is None and match.inlier_ratio < self.config.low_inlier_ratio:
            doubt = explanation(match.inlier_ratio, consistency)
        # What does not fit at all is counted below, and looked for nearby first.
        seen_through = (
            doubt is None and self._consistency.free_space_violation > self.config.through
        )
        self._through = self._through + 1 if seen_through else 0
        self._off_map = consistency is not None and consistency.unmapped > self.config.off_map
        if doubt is None:
            self._bad, self._good = 0, self._good + 1
        elif self._off_map:
            self._bad, self._good = max(self._bad, self.config.suspect_after), 0
            self._why = f"{doubt}: the robot has left the map and goes by its own motion"
        else:
            self._bad, self._good, self._why = self._bad + 1, 0, doubt
        self._settled = doubt is None and self._settling == 1
        self._settling -= int(doubt is None and self._settling > 0)
        if self._hopeless(match, refusal, consistency) or self._differ >= self.config.disagreements:
            self._lost = True
        elif self._good >= self.config.trusted_after and not self._differ:
            self._lost = False

    def _hopeless(
        self, match: Match, refusal: str | None, consistency: ScanConsistency | None
    ) -> bool:
        """Return whether doubt has lasted for long enough.

        A crowd about the robot hides the map and contradicts no pose; its sweeps may explain little
        and agree with the prediction all the same.
        """
        c = self.config
        crowded = match.inlier_ratio < c.low_inlier_ratio and consistency is not None
        if crowded and self._consistency.free_space_violation <= c.through:
            return refusal is not None and self._bad >= c.blind_after
        return self._bad >= c.lost_after

    def opinion(self, offset: float, turn: float) -> None:
        """Take note of how far [m, rad] a second opinion lies from the estimate."""
        if self._off_map:
            # It knows the map and nothing else.
            self._differ = 0
        elif offset > self.config.opinion_distance or abs(turn) > self.config.opinion_yaw:
            self._differ += 1
            self._why = f"KISS-ICP places the robot {offset:.2f} m and {np.rad2deg(abs(turn)):.1f} degrees away"
        else:
            self._differ = 0

    def state(
        self,
        *,
        sigma: float,
        slipping: bool,
        silent: tuple[str, ...],
        unseeing: bool = False,
        mounts: tuple[str, ...] = (),
    ) -> tuple[Health, tuple[str, ...]]:
        """Return the state and its reasons.

        Args:
            sigma: of the horizontal position [m].
            slipping: whether the wheels slip.
            silent: sensors that are overdue.
            unseeing: whether no scanner is left that speaks.
            mounts: what seems wrong with how the scanners are mounted.
        """
        missing = tuple(f"nothing from {name}" for name in silent)
        if sigma > self.config.lost_sigma:
            self._lost = True
            self._why = f"position is known to {sigma:.1f} m only"
        if self._lost:
            return Health.LOST, (self._why, *missing)
        if self._bad >= self.config.suspect_after or self._differ:
            return Health.SUSPECT, (self._why, *missing)
        if self._through:
            return Health.SUSPECT, (*self._strange(), *missing)
        if self._settling:
            return Health.SUSPECT, ("all that is seen changed at once: was it carried?", *missing)
        if unseeing:
            # Wheels that slip now mislead it by any distance, and nobody would notice.
            return Health.SUSPECT, ("no scanner speaks: only its own motion is known", *missing)
        if slipping:
            return Health.SLIPPING, ("the wheels contradict gyro or scanners", *missing)
        if self._blind or missing or mounts:
            blind = (f"no hold in {', '.join(self._blind)}",) if self._blind else ()
            return Health.DEGRADED, (*blind, *missing, *mounts, *self._strange())
        return Health.TRACKING, self._strange()

    def _strange(self) -> tuple[str, ...]:
        """What the operator may want to know of the place, though it speaks against no pose."""
        seen = self._consistency
        if seen.unexplained <= self.config.strange and not self._through:
            return ()
        return (explanation(1.0 - seen.unexplained, seen),)


def _smoothed(before: ScanConsistency, seen: ScanConsistency | None) -> ScanConsistency:
    """Follow what is seen with a memory of about a second at ten sweeps a second."""
    if seen is None:
        return before
    return ScanConsistency(
        *(b + 0.1 * (s - b) for b, s in zip(astuple(before), astuple(seen), strict=True))
    )


def horizontal_sigma(covariance: FloatArray) -> float:
    """Return one sigma [m] of the horizontal position along its least certain direction.

    The larger eigenvalue of a symmetric 2 x 2 matrix in closed form; ``numpy.linalg`` takes ten times
    as long to begin.
    """
    xx, yy, xy = float(covariance[0, 0]), float(covariance[1, 1]), float(covariance[0, 1])
    return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))


def blind_axes(match: Match, pose: Pose) -> tuple[str, ...]:
    """Return which of the robot's axes the match does not hold."""
    axes = np.zeros((6, 6))
    axes[:3, :3] = pose.rotation.T
    axes[3:, 3:] = np.eye(3)
    held = np.square(axes @ match.observable_directions.T).sum(axis=1)
    return tuple(name for name, share in zip(_AXES, held, strict=True) if share < 0.5)


def opinion_offset(pose: Pose, other: Pose, match: Match) -> tuple[float, float]:
    """Return how far [m, rad] another pose lies, horizontally, in the directions that a match holds."""
    step = (other.position - pose.position) * [1.0, 1.0, 0.0]
    turn = (pose.inverse() @ other).yaw
    scaled = np.concatenate([step, [0.0, 0.0, LEVER * turn]])
    held = match.observable_directions.T @ (match.observable_directions @ scaled)
    return float(np.hypot(held[0], held[1])), float(held[5] / LEVER)
