"""Trajectories: poses with increasing stamps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from localization.compiled.scans import interpolated
from localization.errors import LocalizationError
from localization.geometry import FloatArray, rotation_from_quaternion
from localization.types import Estimate, IntArray, Pose


class TrajectoryError(LocalizationError):
    """An invalid trajectory, or a file that cannot be read; one line names the place and the reason."""


class EmptyTrajectoryError(TrajectoryError):
    """A valid file without poses, as written by a run that never found its pose."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Poses at increasing times."""

    stamps: IntArray
    """Strictly increasing stamps (N,) [ns]."""
    positions: FloatArray
    """Positions (N, 3) [m]."""
    quaternions_wxyz: FloatArray
    """Unit quaternions (N, 4); normalised unless their norm is one within rounding."""
    rotations: FloatArray = field(init=False, repr=False)
    """Rotation matrices (N, 3, 3), derived from the quaternions."""

    def __post_init__(self) -> None:
        stamps = np.array(self.stamps, dtype=np.int64).reshape(-1)
        n = len(stamps)
        positions = np.array(self.positions, dtype=float)
        q = np.array(self.quaternions_wxyz, dtype=float)
        if positions.shape != (n, 3) or q.shape != (n, 4):
            raise TrajectoryError(
                f"{n} stamps need positions ({n}, 3) and quaternions ({n}, 4), "
                f"got {positions.shape} and {q.shape}"
            )
        if (late := np.flatnonzero(np.diff(stamps) <= 0)).size:
            raise TrajectoryError(
                f"stamps must increase; pose {late[0] + 1} is not after pose {late[0]}"
            )
        norms2 = np.einsum("ij,ij->i", q, q)
        sound = np.isfinite(positions).all(axis=1) & np.isfinite(norms2) & (norms2 > 1e-12)
        if not sound.all():
            raise TrajectoryError(
                f"pose {np.argmin(sound)} must be finite, with a quaternion not zero"
            )
        off = np.abs(norms2 - 1.0) > 1e-12
        q[off] /= np.sqrt(norms2[off])[:, None]
        rotations = (
            np.array([rotation_from_quaternion(row) for row in q]) if n else np.zeros((0, 3, 3))
        )
        for name, array in (
            ("stamps", stamps),
            ("positions", positions),
            ("quaternions_wxyz", q),
            ("rotations", rotations),
        ):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.stamps)

    @classmethod
    def from_poses(cls, stamped: Iterable[tuple[int, Pose]]) -> Self:
        """Return the trajectory of stamps [ns] and poses, in order of time."""
        pairs = list(stamped)
        return cls(
            np.array([stamp for stamp, _ in pairs], dtype=np.int64),
            np.array([pose.position for _, pose in pairs]).reshape(-1, 3),
            np.array([pose.quaternion_wxyz for _, pose in pairs]).reshape(-1, 4),
        )

    @classmethod
    def from_estimates(cls, estimates: Iterable[Estimate]) -> Self:
        """Return the trajectory of the estimates that have a pose; the last one of each stamp counts."""
        known = {e.stamp: e.map_from_base for e in estimates if e.map_from_base is not None}
        return cls.from_poses(known.items())

    def pose(self, index: int) -> Pose:
        """Return the pose with a number."""
        return Pose(self.positions[index], self.quaternions_wxyz[index])

    def take(self, index: IntArray | slice) -> Trajectory:
        """Return the trajectory of some of the poses."""
        return Trajectory(self.stamps[index], self.positions[index], self.quaternions_wxyz[index])

    def at(self, stamps: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (M, 3) [m] and rotations (M, 3, 3) at times (M,) within the trajectory.

        Poses with equal stamps are returned as they are; between stamps the poses are interpolated.
        """
        if len(self) < 2:
            index = np.zeros(len(stamps), dtype=np.int64)
            return self.positions[index], self.rotations[index]
        positions, turned = interpolated(stamps, self.stamps, self.positions, self.quaternions_wxyz)
        rotations = np.array([rotation_from_quaternion(row) for row in turned]).reshape(-1, 3, 3)
        index = np.minimum(np.searchsorted(self.stamps, stamps), len(self) - 1)
        exact = self.stamps[index] == stamps
        positions[exact], rotations[exact] = (
            self.positions[index[exact]],
            self.rotations[index[exact]],
        )
        return positions, rotations
