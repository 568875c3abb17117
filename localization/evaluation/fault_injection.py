"""Faults put into streams of readings: a drive recorded once can be replayed with everything going wrong.

Each function takes readings in the order of arrival and yields what would have arrived, had that gone
wrong; they can be put one into another. What is drawn by chance is drawn from a seed and the readings'
stamps, so that every method replays the same fault, bit by bit.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from localization.pipeline.validation import end_of as end_of
from localization.types import (
    SECOND,
    Hint,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)

WHEELS, INERTIAL, ODOMETRY, HINT = "wheels", "inertial", "odometry", "hint"
"""Names of the sources that are no scanners; a scanner's is its frame."""


@dataclass(frozen=True, slots=True)
class Span:
    """A time during which something is wrong, its end not included."""

    begin: int
    """[ns]."""
    end: int
    """[ns]."""

    def __post_init__(self) -> None:
        if not 0 <= self.begin < self.end:
            raise ValueError(f"a span must end after it begins, got {self.begin} to {self.end} ns")

    def holds(self, stamp: int) -> bool:
        """Return whether a stamp [ns] lies in it."""
        return self.begin <= stamp < self.end


@dataclass(frozen=True, slots=True)
class Clutter:
    """People and things that stand about the robot and are in no map."""

    share: float
    """Of the beams that point at them, in [0, 1]."""
    width: float = np.deg2rad(15.0)
    """What one of them hides [rad]: a person of half a metre at two metres."""
    near: float = 0.4
    """The nearest stands this far from the scanner [m] ..."""
    far: float = 2.0
    """... and the farthest this far [m]."""
    stay: int = 2 * SECOND
    """They change places after this time [ns]."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share must be in [0, 1], got {self.share}")
        if not (self.width > 0.0 and 0.0 < self.near < self.far and self.stay > 0):
            raise ValueError("clutter must have a width, stand farther than nothing, and stay")


def source_of(reading: Reading) -> str:
    """Return what a reading comes from: a scanner's frame, or one of the names above."""
    match reading:
        case Scan() | PointScan():
            return reading.scanner
        case WheelSpeeds():
            return WHEELS
        case Inertial():
            return INERTIAL
        case Odometry():
            return ODOMETRY
        case Hint():
            return HINT


def slipping(
    readings: Iterable[Reading], spans: Iterable[Span], factor: float = 2.0
) -> Iterator[Reading]:
    """Let all wheels turn ``factor`` times as fast as the ground passes, during some spans."""
    when = tuple(spans)
    for reading in readings:
        if isinstance(reading, WheelSpeeds) and any(s.holds(reading.stamp) for s in when):
            left, right = (float(np.float32(factor * v)) for v in (reading.left, reading.right))
            yield WheelSpeeds(reading.stamp, left, right)
        else:
            yield reading


def occluded(readings: Iterable[Reading], clutter: Clutter, *, seed: int = 0) -> Iterator[Reading]:
    """Let something near hide a share of each planar scanner's beams.

    A beam is hidden only if what it saw is farther away. Sectors are drawn anew after ``clutter.stay``;
    scanners draw their own.
    """
    for reading in readings:
        yield _hidden(reading, clutter, seed) if isinstance(reading, Scan) else reading


def _hidden(scan: Scan, clutter: Clutter, seed: int) -> Scan:
    if not len(scan.angles):
        return scan
    name = int.from_bytes(scan.scanner.encode(), "big") % (1 << 32)
    rng = np.random.default_rng([seed, name, scan.stamp // clutter.stay])
    sector = np.floor((scan.angles - scan.angles.min()) / clutter.width).astype(np.int64)
    count = int(sector.max()) + 1
    rank, distance = rng.permutation(count), rng.uniform(clutter.near, clutter.far, count)
    # Whole sectors in the order drawn, the last in part, so that the share is kept to a beam.
    order = np.argsort(rank[sector], kind="stable")
    hidden = order[: round(clutter.share * len(order))]
    ranges = scan.ranges.copy()
    ranges[hidden] = np.fmin(ranges[hidden], np.float32(distance[sector[hidden]]))
    return replace(scan, ranges=ranges)


def silent(readings: Iterable[Reading], source: str, span: Span) -> Iterator[Reading]:
    """Leave out what one source says during a span."""
    for reading in readings:
        if source_of(reading) != source or not span.holds(end_of(reading)):
            yield reading


def late(
    readings: Iterable[Reading], source: str, delay: int, *, jitter: int = 0, seed: int = 0
) -> Iterator[Reading]:
    """Let the readings of one source arrive later than those that they came with; stamps stay.

    With more jitter than lies between two of them they overtake each other.

    Args:
        readings: in the order of arrival.
        source: whose readings are late.
        delay: of each [ns].
        jitter: a reading's own share of it is added [ns], drawn from the seed and its stamp.
        seed: of the jitter.

    Raises:
        ValueError: if the delay or the jitter is negative.
    """
    if delay < 0 or jitter < 0:
        raise ValueError(f"delay must be >= 0 ns, got {delay} and a jitter of {jitter}")
    held: list[tuple[int, int, Reading]] = []
    now = 0
    for i, reading in enumerate(readings):
        now = max(now, end_of(reading))
        while held and held[0][0] <= now:
            yield heapq.heappop(held)[2]
        if source_of(reading) == source:
            own = round(np.random.default_rng([seed, end_of(reading)]).uniform(0, jitter))
            heapq.heappush(held, (now + delay + own, i, reading))
        else:
            yield reading
    while held:
        yield heapq.heappop(held)[2]


def kidnapped(
    before: Iterable[Reading], after: Iterable[Reading], *, gap: int = SECOND // 50
) -> Iterator[Reading]:
    """Carry the robot from the end of one recording to the beginning of another, unseen.

    The second one's stamps follow on the first one's; its odometry goes on from where the first one's
    stood, for wheels in the air do not turn; and its hints are left out, for nobody knows.

    Args:
        before: readings until the robot is lifted.
        after: readings from where it is set down; made by the same kind of robot.
        gap: between the last reading before and the first after [ns].
    """
    last, lifted = 0, None
    for reading in before:
        last = max(last, end_of(reading))
        if isinstance(reading, Odometry):
            lifted = reading.odom_from_base
        yield reading
    shift: int | None = None
    rebase: Pose | None = None
    for reading in after:
        if isinstance(reading, Hint):
            continue
        if shift is None:
            shift = last + gap - end_of(reading)
        if isinstance(reading, Odometry):
            if rebase is None:
                here = lifted if lifted is not None else reading.odom_from_base
                rebase = here @ reading.odom_from_base.inverse()
            moved = rebase @ reading.odom_from_base
            yield Odometry(reading.stamp + shift, moved)
        elif reading.stamp + shift >= 0:
            yield replace(reading, stamp=reading.stamp + shift)
