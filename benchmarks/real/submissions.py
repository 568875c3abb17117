"""Poses that somebody else's localiser found on a real log, read from a TUM file.

A line is ``t x y z qx qy qz qw``, or these and the upper half of the pose's covariance in the plane,
``xx xy xθ yy yθ θθ`` [m^2, m rad, rad^2], in map axes. ``t`` is the time printed in the scan's ``FLASER``
line, the third word from its end, and the pose is that of the scanner in the frame of the corrected log.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.real.log_tracks import odometry_at_scans
from benchmarks.real.logs import RealDrive
from benchmarks.real.scores import Answer
from localization.errors import LocalizationError
from localization.geometry import FloatArray
from localization.types import Pose, Scan

_NAMES = ("t", "x", "y", "z", "qx", "qy", "qz", "qw", "xx", "xy", "xθ", "yy", "yθ", "θθ")
_PLAIN = 8
"""Columns of a line without a covariance."""
_NEAR = 0.02
"""A line belongs to the scan whose printed time is nearest, within this [s]: as for relations."""


class SubmissionError(LocalizationError):
    """A file of poses that cannot be used; the message is one line and names line and column."""


@dataclass(frozen=True, slots=True, eq=False)
class Submission:
    """Poses as they were handed in, in the file's order."""

    path: Path
    """The file."""
    times: FloatArray
    """(P,) printed times of the scans [s]."""
    poses: tuple[Pose, ...]
    """``map_from_scanner`` in the plane."""
    covariances: FloatArray
    """(P, 6, 6) of the poses, zero but for x, y and yaw; NaN where a line holds none."""


def read_submission(path: Path) -> Submission:
    """Read a TUM file with 8 or 14 columns; empty lines and those that begin with ``#`` are skipped.

    Times need not increase: some loggers print them without the zeros after the point.

    Raises:
        SubmissionError: if the file cannot be read, or a line holds no valid pose or covariance.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not a text file"
        raise SubmissionError(f"{path}: {reason}") from error
    rows = [
        _row(f"{path}, line {number}", line.split())
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise SubmissionError(f"{path}: holds no poses; a line is {' '.join(_NAMES[:_PLAIN])}")
    times, covariances = np.array([r[0] for r in rows]), np.array([_covariance(r) for r in rows])
    return Submission(path, times, tuple(_pose(r) for r in rows), covariances)


def _row(where: str, words: Sequence[str]) -> FloatArray:
    if len(words) not in (_PLAIN, len(_NAMES)):
        raise SubmissionError(
            f"{where}: a line needs {_PLAIN} columns, {' '.join(_NAMES[:_PLAIN])}, or {len(_NAMES)}"
            f" with {' '.join(_NAMES[_PLAIN:])}, got {len(words)}"
        )
    values = np.full(len(_NAMES), np.nan)
    for i, word in enumerate(words):
        try:
            values[i] = float(word)
        except ValueError:
            values[i] = np.nan
        if not math.isfinite(values[i]):
            raise SubmissionError(
                f"{where}, column {i + 1} ({_NAMES[i]}): a finite number is wanted, got {word!r}"
            )
    if not values[4:_PLAIN].any():
        raise SubmissionError(
            f"{where}, columns 5 to 8 (qx qy qz qw): a quaternion is not zero; no turn is 0 0 0 1"
        )
    if len(words) > _PLAIN:
        matrix = _planar(values)
        for column, axis in ((9, 0), (12, 1), (14, 2)):
            if matrix[axis, axis] <= 0.0:
                raise SubmissionError(
                    f"{where}, column {column} ({_NAMES[column - 1]}): a variance must be > 0,"
                    f" got {words[column - 1]}"
                )
        if np.linalg.eigvalsh(_scaled(matrix)).min() <= 0.0:
            raise SubmissionError(
                f"{where}, columns 9 to 14: {' '.join(_NAMES[_PLAIN:])} must be a positive definite"
                " matrix; its correlations contradict each other"
            )
    return values


def _pose(row: FloatArray) -> Pose:
    """Return the pose in the plane of a line's columns."""
    qx, qy, qz, qw = row[4:_PLAIN]
    yaw = math.atan2(2.0 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
    return Pose.planar(row[1], row[2], yaw)


def _scaled(matrix: FloatArray) -> FloatArray:
    sigma = np.sqrt(np.diag(matrix))
    scaled: FloatArray = matrix / np.outer(sigma, sigma)
    return scaled


def _planar(row: FloatArray) -> FloatArray:
    """Return the covariance (3, 3) of x, y and yaw in a line's columns."""
    matrix = np.zeros((3, 3))
    matrix[np.triu_indices(3)] = row[_PLAIN:]
    whole: FloatArray = matrix + np.triu(matrix, 1).T
    return whole


def _covariance(row: FloatArray) -> FloatArray:
    matrix = np.zeros((6, 6))
    matrix[np.ix_((0, 1, 5), (0, 1, 5))] = _planar(row)
    return matrix if np.isfinite(row[_PLAIN]) else np.full((6, 6), np.nan)


def submitted_answers(drive: RealDrive, submission: Submission) -> list[Answer]:
    """Return a submission's answer at each scan of an excerpt.

    A scan without a line has the pose of the last line before it, carried on by odometry; before the first
    line there is none.

    Raises:
        SubmissionError: if no line has the time of a scan of the excerpt.
    """
    line = _lines(drive.times, submission.times)
    if (line < 0).all():
        raise SubmissionError(
            f"{submission.path}: no line is within {_NEAR} s of a scan of {drive.case}, whose FLASER lines are"
            f" printed with times from {drive.times.min():.6f} to {drive.times.max():.6f}"
        )
    odometry = odometry_at_scans(drive.readings)
    scans = (r for r in drive.readings if isinstance(r, Scan))
    found: list[Answer] = []
    last, covariance = None, np.full((6, 6), np.nan)
    for i, (scan, odom_from_base) in enumerate(zip(scans, odometry, strict=True)):
        odom = odom_from_base @ drive.mount
        pose = None if last is None else last[0] @ (last[1].inverse() @ odom)
        if line[i] >= 0:
            pose, covariance = submission.poses[line[i]], submission.covariances[line[i]]
            last = pose, odom
        found.append(Answer(scan.stamp, pose, covariance, None, math.nan))
    return found


def _lines(scans: FloatArray, times: FloatArray) -> np.typing.NDArray[np.int64]:
    """Return the number of the line (S,) for each scan, by printed times (S,) and (P,) [s]; -1 for none.

    Of lines equally near, each next one goes to the next of the scans printed with the same time.
    """
    order = np.argsort(times, kind="stable")
    ranked = times[order]
    found = np.full(len(scans), -1)
    taken: dict[int, int] = {}
    for i, time in enumerate(scans.tolist()):
        at = int(np.searchsorted(ranked, time))
        beside = range(max(0, at - 1), min(len(ranked), at + 1))
        best = min(beside, key=lambda k: abs(ranked[k] - time))
        if abs(ranked[best] - time) <= _NEAR:
            first = int(np.searchsorted(ranked, ranked[best]))
            last = int(np.searchsorted(ranked, ranked[best], side="right")) - 1
            k = min(first + taken.get(first, 0), last)
            taken[first] = taken.get(first, 0) + 1
            found[i] = order[k]
    return found
