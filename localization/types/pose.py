"""Rigid transforms and velocities."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from localization.geometry import (
    FloatArray,
    Quaternion,
    euler_from_rotation,
    quaternion_from_rotation,
    quaternion_product,
    rotation_entries,
    rotation_from_euler,
    yaw_from_rotation,
)
from localization.types.arrays import InvalidReadingError, read_only, require_finite

_LEVEL = 0.9
"""Cosine of the angle between the vertical axes of frames that are level to each other, at least, up or down."""


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
        position = read_only(self.position, (3,), "position")
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
        q.setflags(write=False)
        rotation = np.array(rotation_entries((w, x, y, z))).reshape(3, 3)
        rotation.setflags(write=False)
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
        w, x, y, z = self.quaternion_wxyz.tolist()
        return Pose(-(self.rotation.T @ self.position), np.array([w, -x, -y, -z]))

    def apply(self, points: FloatArray) -> FloatArray:
        """Map points, (3,) or (N, 3) [m], from this pose's right-hand frame to its left-hand one."""
        moved: FloatArray = points @ self.rotation.T + self.position
        return moved

    @property
    def is_level(self) -> bool:
        """Whether it is tilted by less than 26 degrees, as a horizontal scanner is on its robot, be it upside down."""
        return bool(abs(self.rotation[2, 2]) > _LEVEL)

    @property
    def euler(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw [rad] (REP 103)."""
        return euler_from_rotation(self.rotation)

    @property
    def yaw(self) -> float:
        """Heading [rad], in (-pi, pi]."""
        return yaw_from_rotation(self.rotation)


@dataclass(frozen=True, slots=True, eq=False)
class Twist:
    """Velocity of ``base_link`` expressed in ``base_link`` (REP 103)."""

    linear: FloatArray
    """(3,) linear velocity [m/s]."""
    angular: FloatArray
    """(3,) angular velocity [rad/s]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "linear", read_only(self.linear, (3,), "linear"))
        object.__setattr__(self, "angular", read_only(self.angular, (3,), "angular"))

    @classmethod
    def planar(cls, forward: float, turn: float) -> Twist:
        """Build from forward speed [m/s] and yaw rate [rad/s]."""
        return cls(np.array([forward, 0.0, 0.0]), np.array([0.0, 0.0, turn]))


def _refuse(position: FloatArray, quaternion: FloatArray) -> None:
    """Raise what is wrong with a position (3,) or a quaternion (4,), if anything is."""
    require_finite(position, "position")
    require_finite(quaternion, "quaternion")
    if (
        np.abs(quaternion).max() > 1e150
    ):  # its square would overflow, and leave no length to divide by
        raise InvalidReadingError(f"quaternion must have unit norm, got {quaternion.tolist()}")
    if float(quaternion @ quaternion) < 1e-12:
        raise InvalidReadingError("quaternion must have unit norm, got all zeros; try 1 0 0 0")
