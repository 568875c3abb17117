"""Trajectories: stamped poses, and the TUM text file that every evaluation tool reads.

A line of such a file is ``t x y z qx qy qz qw``; here ``t`` has nine decimals and the others as many
as it takes, so that a trajectory survives the file to the last bit.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Self

import numpy as np

from localization.geometry import FloatArray, interpolate_many, rotation_from_quaternion
from localization.types import SECOND, Estimate, IntArray, Pose


class TrajectoryError(ValueError):
    """A trajectory that cannot be, or cannot be read; one line says where and why."""


class EmptyTrajectoryError(TrajectoryError):
    """A file that could hold poses but has none, as of a run that never knew where it was."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Poses at increasing times."""

    stamps: IntArray
    """(N,) [ns], strictly increasing."""
    positions: FloatArray
    """(N, 3) [m]."""
    quaternions_wxyz: FloatArray
    """(N, 4), of unit norm; brought to it unless they are within rounding."""
    rotations: FloatArray = field(init=False, repr=False)
    """(N, 3, 3), derived from the quaternions."""

    def __post_init__(self) -> None:
        stamps = np.array(self.stamps, dtype=np.int64).reshape(-1)
        n = len(stamps)
        positions = np.array(self.positions, dtype=float)
        q = np.array(self.quaternions_wxyz, dtype=float)
        if positions.shape != (n, 3) or q.shape != (n, 4):
            raise TrajectoryError(
                f"{n} stamps want positions ({n}, 3) and quaternions ({n}, 4), "
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
        """Build from stamps [ns] and poses, in order of time."""
        pairs = list(stamped)
        return cls(
            np.array([stamp for stamp, _ in pairs], dtype=np.int64),
            np.array([pose.position for _, pose in pairs]).reshape(-1, 3),
            np.array([pose.quaternion_wxyz for _, pose in pairs]).reshape(-1, 4),
        )

    @classmethod
    def from_estimates(cls, estimates: Iterable[Estimate]) -> Self:
        """Build from the estimates that know where the robot is, the last one of each stamp."""
        known = {e.stamp: e.map_from_base for e in estimates if e.map_from_base is not None}
        return cls.from_poses(known.items())

    def pose(self, index: int) -> Pose:
        """Return one pose."""
        return Pose(self.positions[index], self.quaternions_wxyz[index])

    def take(self, index: IntArray | slice) -> Trajectory:
        """Return some of the poses."""
        return Trajectory(self.stamps[index], self.positions[index], self.quaternions_wxyz[index])

    def at(self, stamps: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (M, 3) [m] and rotations (M, 3, 3) at times (M,) within the trajectory.

        Where a pose has that very stamp, it is returned as it is; elsewhere it is interpolated.
        """
        if len(self) < 2:
            index = np.zeros(len(stamps), dtype=np.int64)
            return self.positions[index], self.rotations[index]
        positions, rotations = interpolate_many(stamps, self.stamps, self.positions, self.rotations)
        index = np.minimum(np.searchsorted(self.stamps, stamps), len(self) - 1)
        exact = self.stamps[index] == stamps
        positions[exact], rotations[exact] = (
            self.positions[index[exact]],
            self.rotations[index[exact]],
        )
        return positions, rotations


def write_tum(path: Path | str, trajectory: Trajectory) -> None:
    """Write a TUM file."""
    lines = ["# t x y z qx qy qz qw\n"]
    for stamp, position, (w, x, y, z) in zip(
        trajectory.stamps.tolist(),
        trajectory.positions.tolist(),
        trajectory.quaternions_wxyz.tolist(),
        strict=True,
    ):
        seconds, rest = divmod(abs(stamp), SECOND)
        numbers = " ".join(map(repr, (*position, x, y, z, w)))
        lines.append(f"{'-' if stamp < 0 else ''}{seconds}.{rest:09d} {numbers}\n")
    Path(path).write_text("".join(lines), encoding="ascii")


def read_tum(path: Path | str) -> Trajectory:
    """Read a TUM file; lines that are empty or begin with ``#`` are passed over.

    Raises:
        TrajectoryError: If there is no such file, or a line of it is no pose.
        EmptyTrajectoryError: If it holds none.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not a text file"
        raise TrajectoryError(f"{path}: {reason}") from error
    stamps: list[int] = []
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            stamp, row = _read_line(line)
            if stamps and stamp <= stamps[-1]:
                raise TrajectoryError("time must increase from line to line")
        except TrajectoryError as error:
            raise TrajectoryError(f"{path}, line {number}: {error}") from None
        stamps.append(stamp)
        rows.append(row)
    if not rows:
        raise EmptyTrajectoryError(f"{path}: holds no poses")
    table = np.array(rows)
    return Trajectory(np.array(stamps, dtype=np.int64), table[:, :3], table[:, [6, 3, 4, 5]])


def _read_line(line: str) -> tuple[int, list[float]]:
    words = line.split()
    if len(words) != 8:
        raise TrajectoryError(f"want 8 numbers, t x y z qx qy qz qw, got {len(words)}")
    try:
        seconds, row = Decimal(words[0]), [float(word) for word in words[1:]]
    except (InvalidOperation, ValueError):
        raise TrajectoryError(
            f"want 8 numbers, t x y z qx qy qz qw, got {line.strip()!r}"
        ) from None
    if not seconds.is_finite() or abs(seconds) >= 2**63 // SECOND:
        raise TrajectoryError(f"time must be seconds that fit 64-bit nanoseconds, got {words[0]}")
    if not np.isfinite(row).all() or not any(row[3:]):
        raise TrajectoryError("a pose must be finite, with a quaternion not zero")
    return round(seconds * SECOND), row
