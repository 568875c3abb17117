"""TUM trajectory files: lines ``t x y z qx qy qz qw``, as evaluation tools such as evo read them.

``t`` is written with nine decimals and the other numbers with as many digits as it takes, so that a trajectory
is restored to the last bit.
"""

from __future__ import annotations

from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Final, TextIO

import numpy as np

from localization.evaluation.trajectory import EmptyTrajectoryError, Trajectory, TrajectoryError
from localization.types import SECOND, Pose

_HEADER: Final = "# t x y z qx qy qz qw\n"


class TumWriter:
    """Writes a trajectory as it comes about; what was written is on the disk, whatever happens to the process."""

    def __init__(self, path: Path) -> None:
        """Open a file, in the place of what it held."""
        self._file: TextIO = path.open("w", encoding="ascii")
        self._file.write(_HEADER)
        self._file.flush()

    def write(self, stamp: int, pose: Pose) -> None:
        """Write the pose at a time [ns], which must be later than the one before."""
        self._file.write(_line(stamp, pose.position.tolist(), pose.quaternion_wxyz.tolist()))
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def write_tum(path: Path | str, trajectory: Trajectory) -> None:
    """Write a trajectory to a TUM file."""
    poses = zip(
        trajectory.stamps.tolist(),
        trajectory.positions.tolist(),
        trajectory.quaternions_wxyz.tolist(),
        strict=True,
    )
    text = _HEADER + "".join(_line(*each) for each in poses)
    Path(path).write_text(text, encoding="ascii")


def _line(stamp: int, position: list[float], quaternion_wxyz: list[float]) -> str:
    w, *xyz = quaternion_wxyz
    seconds, rest = divmod(abs(stamp), SECOND)
    numbers = " ".join(map(repr, (*position, *xyz, w)))
    return f"{'-' if stamp < 0 else ''}{seconds}.{rest:09d} {numbers}\n"


def read_tum(path: Path | str) -> Trajectory:
    """Read a TUM file; empty lines and lines that begin with ``#`` are skipped.

    Raises:
        TrajectoryError: If the file is missing, or a line is not a valid pose.
        EmptyTrajectoryError: If it holds no poses.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")  # editors on Windows begin it with a mark
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
        raise TrajectoryError(f"a line needs 8 numbers, t x y z qx qy qz qw, got {len(words)}")
    try:
        seconds, row = Decimal(words[0]), [float(word) for word in words[1:]]
    except (InvalidOperation, ValueError):
        raise TrajectoryError(
            f"a line needs 8 numbers, t x y z qx qy qz qw, got {line.strip()!r}"
        ) from None
    if not seconds.is_finite() or abs(seconds) >= 2**63 // SECOND:
        raise TrajectoryError(f"time must be seconds that fit 64-bit nanoseconds, got {words[0]}")
    if not np.isfinite(row).all() or not any(row[3:]):
        raise TrajectoryError("a pose must be finite, with a quaternion not zero")
    return round(seconds * SECOND), row
