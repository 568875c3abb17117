"""Readings of a robot's sensors, and hints of its operator: the input of the localiser."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.types.arrays import (
    IntArray,
    InvalidReadingError,
    is_shareable,
    read_only,
    require_finite,
)
from localization.types.pose import Pose, Twist

SECOND = 1_000_000_000
"""One second [ns]."""
GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""

_FARTHEST_HINT = 1e6
"""Largest coordinate of a hint [m]; no map reaches so far."""

_QUATERNION_TOLERANCE = 1e-3
"""Departure of a quaternion's norm from 1 that rounding to float32 and a driver's own filter may cause."""


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
            value = read_only(getattr(self, name), shape, f"scan.{name}")
            object.__setattr__(self, name, value)
        offsets = self.offsets
        if not is_shareable(offsets, np.int64):
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
        points = read_only(self.points, (n, 3), "points.points")
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
    orientation: FloatArray | None = None
    """(4,) unit quaternion wxyz of ``world_from_base`` by the unit's own filter, in a world whose z axis points up
    (REP 145) and whose heading is arbitrary; None if the unit gives none."""
    orientation_sigma: FloatArray | None = None
    """(3,) standard deviation of the orientation about the world's x, y and z axes [rad]; None if it is
    unknown."""

    def __post_init__(self) -> None:
        for name in ("angular_velocity", "specific_force"):
            value = read_only(getattr(self, name), (3,), f"inertial.{name}")
            object.__setattr__(self, name, value)
        if self.orientation is not None:
            quaternion = read_only(self.orientation, (4,), "inertial.orientation")
            require_finite(quaternion, "inertial.orientation")
            norm = float(np.linalg.norm(quaternion))
            if not abs(norm - 1.0) < _QUATERNION_TOLERANCE:
                raise InvalidReadingError(
                    f"inertial.orientation must have unit norm, got {quaternion.tolist()}"
                )
            object.__setattr__(self, "orientation", quaternion)
        if self.orientation_sigma is not None:
            sigma = read_only(self.orientation_sigma, (3,), "inertial.orientation_sigma")
            require_finite(sigma, "inertial.orientation_sigma")
            if (sigma < 0.0).any():
                raise InvalidReadingError(
                    f"inertial.orientation_sigma must be >= 0, got {sigma.tolist()}"
                )
            object.__setattr__(self, "orientation_sigma", sigma)


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """Pose of a base by its own odometry."""

    stamp: int
    """Time of the pose [ns]."""
    odom_from_base: Pose
    """Pose since an arbitrary start."""
    twist: Twist | None = None
    """Velocity of the base in its own frame by the same odometry; None if it gives none. Only a base that does not
    integrate poses itself is dead-reckoned by it."""


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
        covariance = read_only(self.covariance, (6, 6), "hint.covariance")
        require_finite(covariance, "hint.covariance")
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


def end_of(reading: Reading) -> int:
    """Return the stamp at which a reading is complete [ns]."""
    return reading.end_stamp if isinstance(reading, Scan | PointScan) else reading.stamp
