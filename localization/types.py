"""Vocabulary of the project: the values that flow between simulator, localiser and network.

All are frozen and their arrays read-only. Stamps are integer nanoseconds of the robot's clock, lengths
are metres, angles radians. ``map_from_base`` maps coordinates in ``base_link`` to coordinates in
``map``. Quaternions are ``wxyz`` here; ROS's ``xyzw`` appears only in messages.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, TypeAlias, TypeGuard

import numpy as np
import numpy.typing as npt

from localization.errors import LocalizationError
from localization.geometry import (
    FloatArray,
    Quaternion,
    euler_from_rotation,
    quaternion_from_rotation,
    quaternion_product,
    rotation_entries,
    rotation_from_euler,
)

IntArray = npt.NDArray[np.int64]

SECOND = 1_000_000_000
"""One second [ns]."""


_FARTHEST_HINT = 1e6
"""Largest coordinate of a hint [m]; no map reaches so far."""


class InvalidReadingError(LocalizationError):
    """A reading or a pose with invalid values; the message names the field and what would work."""


def _read_only(value: npt.ArrayLike, shape: tuple[int, ...] | None, name: str) -> FloatArray:
    array = value if _is_frozen(value, np.float64) else np.array(value, dtype=float)
    if shape is not None and array.shape != shape:
        raise InvalidReadingError(f"{name} must have shape {shape}, got {array.shape}")
    array.flags.writeable = False
    return array


def _is_frozen(value: object, dtype: type[np.generic]) -> TypeGuard[npt.NDArray[Any]]:
    """Return whether ``value`` is a read-only array with its own memory, which can be shared."""
    return (
        type(value) is np.ndarray
        and not value.flags.writeable
        and value.base is None
        and value.dtype == dtype
    )


def _finite(array: FloatArray, name: str) -> None:
    if not all(map(math.isfinite, array.ravel().tolist())):
        raise InvalidReadingError(f"{name} must be finite, got {array.tolist()}")


def _refuse(position: FloatArray, quaternion: FloatArray) -> None:
    """Raise what is wrong with a position (3,) or a quaternion (4,), if anything is."""
    _finite(position, "position")
    _finite(quaternion, "quaternion")
    if (
        np.abs(quaternion).max() > 1e150
    ):  # its square would overflow, and leave no length to divide by
        raise InvalidReadingError(f"quaternion must have unit norm, got {quaternion.tolist()}")
    if float(quaternion @ quaternion) < 1e-12:
        raise InvalidReadingError("quaternion must have unit norm, got all zeros; try 1 0 0 0")


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A rigid transform; named by its two frames where it is used, as in ``map_from_base``."""

    position: FloatArray
    """(3,) translation [m]."""
    quaternion_wxyz: FloatArray
    """(4,) unit quaternion."""
    rotation: FloatArray = field(init=False, repr=False)
    """(3, 3) rotation matrix, derived from the quaternion."""

    def __post_init__(self) -> None:
        position = _read_only(self.position, (3,), "position")
        q = np.array(self.quaternion_wxyz, dtype=float)
        if q.shape != (4,):
            raise InvalidReadingError(f"quaternion must have shape (4,), got {q.shape}")
        # Several poses are made per reading: single numbers are faster than small arrays.
        w, x, y, z = q.tolist()
        norm2 = w * w + x * x + y * y + z * z
        if not (1e-12 <= norm2 <= 1e300 and math.isfinite(sum(position.tolist()))):
            _refuse(position, q)
        # A quaternion that is already unit stays as it came, so that a pose survives a log bit for bit.
        if abs(norm2 - 1.0) > 1e-12:
            q = q / math.sqrt(norm2)
            w, x, y, z = q.tolist()
        q.flags.writeable = False
        rotation = np.array(rotation_entries((w, x, y, z))).reshape(3, 3)
        rotation.flags.writeable = False
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "quaternion_wxyz", q)
        object.__setattr__(self, "rotation", rotation)

    @classmethod
    def identity(cls) -> Pose:
        """Return the identity transform."""
        return cls(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))

    @classmethod
    def from_rotation(cls, position: npt.ArrayLike, rotation: FloatArray) -> Pose:
        """Build from a position (3,) [m] and a rotation matrix (3, 3)."""
        return cls(np.asarray(position, dtype=float), quaternion_from_rotation(rotation))

    @classmethod
    def from_euler(
        cls, position: npt.ArrayLike, *, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
    ) -> Pose:
        """Build from a position (3,) [m] and roll, pitch, yaw [rad] (REP 103)."""
        return cls.from_rotation(position, rotation_from_euler(roll, pitch, yaw))

    @classmethod
    def planar(cls, x: float, y: float, yaw: float) -> Pose:
        """Build a pose on the floor: x, y [m] and yaw [rad]."""
        half = 0.5 * yaw
        return cls(np.array([x, y, 0.0]), np.array([np.cos(half), 0.0, 0.0, np.sin(half)]))

    def __matmul__(self, other: Pose) -> Pose:
        """Compose: ``map_from_base @ base_from_laser == map_from_laser``."""
        a: Quaternion = tuple(self.quaternion_wxyz.tolist())
        b: Quaternion = tuple(other.quaternion_wxyz.tolist())
        return Pose(
            self.position + self.rotation @ other.position, np.array(quaternion_product(a, b))
        )

    def inverse(self) -> Pose:
        """Return the inverse transform."""
        w, x, y, z = self.quaternion_wxyz
        return Pose(-(self.rotation.T @ self.position), np.array([w, -x, -y, -z]))

    def apply(self, points: FloatArray) -> FloatArray:
        """Map points, (3,) or (N, 3) [m], from this pose's right-hand frame to its left-hand one."""
        moved: FloatArray = points @ self.rotation.T + self.position
        return moved

    @property
    def euler(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw [rad] (REP 103)."""
        return euler_from_rotation(self.rotation)

    @property
    def yaw(self) -> float:
        """Heading [rad], in (-pi, pi]."""
        return self.euler[2]


@dataclass(frozen=True, slots=True, eq=False)
class Twist:
    """Velocity of ``base_link`` expressed in ``base_link`` (REP 103)."""

    linear: FloatArray
    """(3,) linear velocity [m/s]."""
    angular: FloatArray
    """(3,) angular velocity [rad/s]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "linear", _read_only(self.linear, (3,), "linear"))
        object.__setattr__(self, "angular", _read_only(self.angular, (3,), "angular"))

    @classmethod
    def planar(cls, forward: float, turn: float) -> Twist:
        """Build from forward speed [m/s] and yaw rate [rad/s]."""
        return cls(np.array([forward, 0.0, 0.0]), np.array([0.0, 0.0, turn]))


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """One scan of a planar scanner, as measured: each beam from where the robot was at its time.

    A range is a distance [m]; ``+inf`` means no return within ``range_max``, ``NaN`` an invalid
    measurement. Both are valid and carry no point.
    """

    stamp: int
    """Time of the first beam [ns], as ``sensor_msgs/LaserScan`` has it."""
    scanner: str
    """Frame of the scanner, such as ``laser_horizontal``."""
    angles: FloatArray
    """(N,) angles of the beams in the scanner's x-y plane, from its x axis [rad]."""
    ranges: FloatArray
    """(N,) ranges [m], of float32 resolution, as in the message."""
    intensities: FloatArray
    """(N,) intensities, or (0,) for a scanner without."""
    offsets: IntArray
    """(N,) time of each beam after ``stamp`` [ns], not decreasing."""
    range_min: float
    """Shortest valid range [m]."""
    range_max: float
    """Longest valid range [m]."""

    def __post_init__(self) -> None:
        if self.stamp < 0:
            raise InvalidReadingError(f"scan.stamp must be >= 0 ns, got {self.stamp}")
        n = np.shape(self.ranges)
        for name in ("angles", "ranges", "intensities"):
            shape = n if name != "intensities" or np.size(self.intensities) else (0,)
            value = _read_only(getattr(self, name), shape, f"scan.{name}")
            object.__setattr__(self, name, value)
        offsets = self.offsets
        if not _is_frozen(offsets, np.int64):
            offsets = np.array(offsets, dtype=np.int64)
        if offsets.shape != n or np.count_nonzero(offsets[1:] < offsets[:-1]):
            raise InvalidReadingError(
                f"scan.offsets must be {n} non-decreasing times, got {offsets.shape}"
            )
        offsets.flags.writeable = False
        object.__setattr__(self, "offsets", offsets)

    @classmethod
    def uniform(
        cls,
        stamp: int,
        scanner: str,
        *,
        angle_min: float,
        angle_increment: float,
        time_increment: float,
        ranges: npt.ArrayLike,
        intensities: npt.ArrayLike = (),
        range_min: float,
        range_max: float,
    ) -> Scan:
        """Build from the fields of ``sensor_msgs/LaserScan``: equal steps of angle [rad] and time [s].

        All numbers are rounded to float32, the message's resolution, so that a scan and its record
        in a log are the same scan.
        """
        measured = np.asarray(ranges, dtype=np.float32)
        steps = np.arange(len(measured))
        return cls(
            stamp=stamp,
            scanner=scanner,
            angles=np.float64(np.float32(angle_min))
            + steps * np.float64(np.float32(angle_increment)),
            ranges=measured.astype(float),
            intensities=np.asarray(intensities, dtype=np.float32).astype(float),
            offsets=np.rint(steps * float(np.float32(time_increment)) * 1e9).astype(np.int64),
            range_min=float(np.float32(range_min)),
            range_max=float(np.float32(range_max)),
        )

    @property
    def end_stamp(self) -> int:
        """Time of the last beam [ns]."""
        return self.stamp + (int(self.offsets[-1]) if len(self.offsets) else 0)


@dataclass(frozen=True, slots=True, eq=False)
class PointScan:
    """One turn of a scanner with several planes, point by point, as measured."""

    stamp: int
    """Time of the first point [ns]."""
    scanner: str
    """Frame of the scanner."""
    points: FloatArray
    """(N, 3) points in that frame [m]."""
    offsets: IntArray
    """(N,) time of each point after ``stamp`` [ns]."""

    def __post_init__(self) -> None:
        n = len(self.points)
        if self.stamp < 0:
            raise InvalidReadingError(f"points.stamp must be >= 0 ns, got {self.stamp}")
        points = _read_only(self.points, (n, 3), "points.points")
        if not np.isfinite(points).all():
            raise InvalidReadingError("points.points must be finite; leave invalid points out")
        offsets = np.array(self.offsets, dtype=np.int64)
        if offsets.shape != (n,) or (offsets < 0).any():
            raise InvalidReadingError(f"points.offsets must be {n} times >= 0, got {offsets.shape}")
        offsets.flags.writeable = False
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "offsets", offsets)

    @property
    def end_stamp(self) -> int:
        """Time of the last point [ns]."""
        return self.stamp + int(self.offsets.max(initial=0))


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Mean rim speed of each side over the interval that ends at the stamp."""

    stamp: int
    """End of the interval [ns]."""
    left: float
    """Rim speed of the left wheels [m/s], of float32 resolution."""
    right: float
    """Rim speed of the right wheels [m/s], of float32 resolution."""


@dataclass(frozen=True, slots=True, eq=False)
class Inertial:
    """Mean gyro and accelerometer reading over the interval that ends at the stamp, in ``base_link``."""

    stamp: int
    """End of the interval [ns]."""
    angular_velocity: FloatArray
    """(3,) angular velocity [rad/s]."""
    specific_force: FloatArray
    """(3,) specific force [m/s^2]; at rest on level ground (0, 0, +9.81)."""

    def __post_init__(self) -> None:
        for name in ("angular_velocity", "specific_force"):
            value = _read_only(getattr(self, name), (3,), f"inertial.{name}")
            object.__setattr__(self, name, value)


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """Pose of a base by its own odometry."""

    stamp: int
    """Time of the pose [ns]."""
    odom_from_base: Pose
    """Pose since an arbitrary start."""


@dataclass(frozen=True, slots=True, eq=False)
class Hint:
    """Where an operator believes the robot to be: a region to search, never a pose to take over."""

    stamp: int
    """Time to which the hint refers [ns]."""
    map_from_base: Pose
    """Centre of the region."""
    covariance: FloatArray
    """(6, 6) covariance in ROS's order x, y, z, roll, pitch, yaw [m, rad]; all zeros means "default"."""

    def __post_init__(self) -> None:
        covariance = _read_only(self.covariance, (6, 6), "hint.covariance")
        _finite(covariance, "hint.covariance")
        if (np.diag(covariance) < 0.0).any():
            raise InvalidReadingError("hint.covariance must have a diagonal >= 0")
        farthest = float(np.abs(self.map_from_base.position).max())
        if farthest > _FARTHEST_HINT:
            raise InvalidReadingError(f"hint position must be in metres, got {farthest:g}")
        object.__setattr__(self, "covariance", covariance)


Reading: TypeAlias = Scan | PointScan | WheelSpeeds | Inertial | Odometry | Hint
"""Input of ``Localizer.add``, and content of a log."""

Mounts: TypeAlias = Mapping[str, Pose]
"""``base_from_scanner`` of each scanner, by its frame's name."""


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
        object.__setattr__(self, "points", _read_only(self.points, (n, 3), "sweep.points"))
        object.__setattr__(self, "origins", _read_only(self.origins, (n, 3), "sweep.origins"))
        horizontal = np.array(self.horizontal, dtype=bool)
        horizontal.flags.writeable = False
        object.__setattr__(self, "horizontal", horizontal)


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
            self, "covariance", _read_only(self.covariance, (6, 6), "estimate.covariance")
        )

    @property
    def unexplained(self) -> float | None:
        """Share of the sweep's beams that the map does not explain, in [0, 1]; None without a sweep."""
        return None if self.consistency is None else self.consistency.unexplained
