"""Faults injected into streams of readings: slip, occlusion, silence, delay and kidnapping.

Each function takes readings in the order of arrival and yields those that would have arrived with the fault;
functions can be nested. Random numbers derive from a seed and the readings' stamps, so that a fault is the same,
bit by bit, for every method under test.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

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
    end_of as end_of,
)

WHEELS, INERTIAL, ODOMETRY, HINT = "wheels", "inertial", "odometry", "hint"
"""Names of the sources other than scanners; the name of a scanner is its frame."""


@dataclass(frozen=True, slots=True)
class Span:
    """Time interval of a fault; its end is not included."""

    begin: int
    """First stamp of the interval [ns]."""
    end: int
    """First stamp after the interval [ns]."""

    def __post_init__(self) -> None:
        if not 0 <= self.begin < self.end:
            raise ValueError(f"a span must end after its begin, got {self.begin} to {self.end} ns")

    def holds(self, stamp: int) -> bool:
        """Return whether a stamp [ns] lies in the interval."""
        return self.begin <= stamp < self.end


@dataclass(frozen=True, slots=True)
class Clutter:
    """People and objects around the robot that are not in the map."""

    share: float
    """Fraction of the beams that they block, in [0, 1]."""
    width: float = np.deg2rad(15.0)
    """Angle that one of them blocks [rad]: a person half a metre wide at two metres."""
    near: float = 0.4
    """Distance of the nearest from the scanner [m]."""
    far: float = 2.0
    """Distance of the farthest from the scanner [m]."""
    stay: int = 2 * SECOND
    """Time after which they change places [ns]."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share must be in [0, 1], got {self.share}")
        if not (self.width > 0.0 and 0.0 < self.near < self.far and self.stay > 0):
            raise ValueError("clutter needs width > 0, 0 < near < far, and stay > 0")


def source_of(reading: Reading) -> str:
    """Return the name of a reading's source: a scanner's frame, or one of the names above."""
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
    """Yield readings in which all wheels turn ``factor`` times too fast during some spans."""
    when = tuple(spans)
    for reading in readings:
        if isinstance(reading, WheelSpeeds) and any(s.holds(reading.stamp) for s in when):
            left, right = (float(np.float32(factor * v)) for v in (reading.left, reading.right))
            yield WheelSpeeds(reading.stamp, left, right)
        else:
            yield reading


def occluded(readings: Iterable[Reading], clutter: Clutter, *, seed: int = 0) -> Iterator[Reading]:
    """Yield readings in which near objects block a fraction of each planar scanner's beams.

    A beam is blocked only if its range is longer. Sectors are drawn again after ``clutter.stay``, independently
    for each scanner.
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
    # Whole sectors in random order, the last in part, so that the fraction is exact to one beam.
    order = np.argsort(rank[sector], kind="stable")
    hidden = order[: round(clutter.share * len(order))]
    ranges = scan.ranges.copy()
    ranges[hidden] = np.fmin(ranges[hidden], np.float32(distance[sector[hidden]]))
    return replace(scan, ranges=ranges)


def silent(readings: Iterable[Reading], source: str, span: Span) -> Iterator[Reading]:
    """Yield the readings without those of one source during a span."""
    for reading in readings:
        if source_of(reading) != source or not span.holds(end_of(reading)):
            yield reading


def late(
    readings: Iterable[Reading], source: str, delay: int, *, jitter: int = 0, seed: int = 0
) -> Iterator[Reading]:
    """Yield readings in which those of one source arrive later; stamps stay.

    If the jitter is longer than the time between two readings, they arrive out of order.

    Args:
        readings: Readings in the order of arrival.
        source: Name of the source of the late readings.
        delay: Delay of each [ns].
        jitter: Greatest random addition to the delay [ns], drawn for each reading from the seed and its stamp.
        seed: Seed of the jitter.

    Raises:
        ValueError: If the delay or the jitter is negative.
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
    """Yield two recordings as one, as if the robot were carried from the end of one to the begin of the other.

    The second recording's stamps follow on the first's; its odometry continues at the first's last pose, because
    wheels in the air do not turn; and its hints are left out.

    Args:
        before: Readings until the robot is lifted.
        after: Readings from the place where it is put down, of the same kind of robot.
        gap: Time between the last reading before and the first after [ns].
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
