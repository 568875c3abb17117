"""Lines of the CARMEN text format.

As the CARMEN toolkit's log format defines them::

    FLASER n r_1 .. r_n x y theta odom_x odom_y odom_theta ipc_time host logger_time
    ROBOTLASER1 type start fov step max_range accuracy remission_mode n r_1 .. r_n m q_1 .. q_m
        laser_x laser_y laser_theta x y theta tv rv forward side axis ipc_time host logger_time
    ODOM x y theta tv rv accel ipc_time host logger_time

Metres and radians. The format has no times of beams, so a scan counts as taken in one instant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Final

import numpy as np

from localization.types import SECOND, Odometry, Pose, Scan

SCANNER: Final = "laser"
"""Frame of the scanner in every such log."""

_MAX_RANGE: Final = 80.0
"""Range limit [m] for FLASER lines, which lack one; SICK's LMS-2xx give 81.83 m where nothing echoes."""


@dataclass(frozen=True, slots=True, eq=False)
class ScanLine:
    """A scan, and the poses of base and scanner by the base's odometry."""

    scan: Scan
    """Ranges of the scan."""
    odom_from_base: Pose
    """Pose of the base by its odometry."""
    odom_from_scanner: Pose
    """Pose of the scanner by the base's odometry; in corrected logs, the corrected pose of the robot."""


def _flaser(words: Sequence[str]) -> ScanLine:
    n = _count(words, 0, "readings")
    _require(words, 8 + n)
    x, y, yaw, ox, oy, oyaw = map(float, words[1 + n : 7 + n])
    # 181 beams span -90 to +90 degrees with both ends; 180 beams lack the last.
    step = math.pi / (n - 1 if n % 2 else n)
    scan = _scan(_stamp(words[7 + n]), words[1 : 1 + n], -0.5 * math.pi, step, _MAX_RANGE)
    return ScanLine(scan, Pose.planar(ox, oy, oyaw), Pose.planar(x, y, yaw))


def _robotlaser(words: Sequence[str]) -> ScanLine:
    n = _count(words, 7, "readings")
    start, _, step, max_range = map(float, words[1:5])
    after = 8 + n
    m = _count(words, after, "remissions", least=0)
    tail = after + 1 + m
    _require(words, tail + 12)
    lx, ly, lyaw, x, y, yaw = map(float, words[tail : tail + 6])
    scan = _scan(_stamp(words[tail + 11]), words[8:after], start, step, max_range)
    return ScanLine(scan, Pose.planar(x, y, yaw), Pose.planar(lx, ly, lyaw))


def _odom(words: Sequence[str]) -> Odometry:
    _require(words, 7)
    x, y, yaw = map(float, words[:3])
    return Odometry(_stamp(words[6]), Pose.planar(x, y, yaw))


LINE_READERS: Final[dict[str, Callable[[Sequence[str]], ScanLine | Odometry]]] = {
    "FLASER": _flaser,
    "ROBOTLASER1": _robotlaser,
    "ODOM": _odom,
}


def _scan(stamp: int, ranges: Sequence[str], start: float, step: float, max_range: float) -> Scan:
    # A range at the scanner's limit means that nothing echoed.
    far = np.array(ranges, dtype=float)
    return Scan.uniform(
        stamp,
        SCANNER,
        angle_min=start,
        angle_increment=step,
        time_increment=0.0,
        ranges=np.where(far < max_range, far, np.inf),
        range_min=0.05,
        range_max=max_range,
    )


def _require(words: Sequence[str], least: int) -> None:
    if len(words) < least:
        raise ValueError(f"the line ends after {len(words)} of at least {least} words")


def _count(words: Sequence[str], at: int, what: str, *, least: int = 2) -> int:
    _require(words, at + 1)
    n = int(words[at])
    if not least <= n <= 100_000:
        raise ValueError(f"the number of {what} must be {least} to 100000, got {n}")
    return n


def _stamp(word: str) -> int:
    """Return the stamp [ns] of seconds with a fraction, without rounding in binary."""
    try:
        seconds = Decimal(word)
    except InvalidOperation:
        seconds = Decimal("nan")
    if not seconds.is_finite() or not 0 <= seconds < 2**63 // SECOND:
        raise ValueError(f"times must be seconds >= 0 that fit 64-bit nanoseconds, got {word}")
    return int(seconds * SECOND)
