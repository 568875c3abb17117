"""Robots carried off on real logs: a stretch at one place, then at once a stretch from another place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks._real_logs import RealDrive
from benchmarks._real_scores import TRUSTED, Answer, answered
from benchmarks._real_trials import Scans, place_at, right, spread
from localization.evaluation.fault_injection import kidnapped
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND, Health, Reading

HELD = 2.0
"""A pose counts as recovered if it is right and trusted for so long [s]."""
ALARMS = (Health.SUSPECT, Health.LOST, Health.RELOCALISING)
"""States that say that the pose may be wrong."""


@dataclass(frozen=True, slots=True)
class Course:
    """How a robot is carried off."""

    before: float = 5.0
    """Length of the log before [s]."""
    after: float = 30.0
    """Length of the log afterwards [s]."""
    way: float = 3.0
    """The robot drives at least so far afterwards [m]: standing still does not distinguish places."""
    apart: float = 2.0
    """The two places are at least this far apart [m]."""


@dataclass(frozen=True, slots=True)
class Kidnap:
    """What became of one robot that was carried off, and of the same robot left where it was."""

    doubted: bool
    """Whether the pose was not right or not trusted before: then nothing after it is counted."""
    alarm: float
    """Time until an alarm [s]; infinite if there was none."""
    recovery: float
    """Time until the begin of ``HELD`` with a right and trusted pose [s]; infinite if there was none."""
    misled: float
    """Time in a trusted state with a pose that is not right [s]."""
    false_alarms: int
    """How often an alarm began in the same stretch without a kidnap."""
    watched: float
    """Length of that stretch [s]."""


def pairs(
    drive: RealDrive,
    course: Course = Course(),
    *,
    count: int,
    seed: int,
) -> Iterator[tuple[int, int]]:
    """Yield pairs of scans: where the log begins, and where it goes on after the robot was carried off.

    Args:
        drive: the excerpt.
        course: how it is carried off.
        count: pairs wanted; fewer where the excerpt is too short.
        seed: of the places.
    """
    scans, rng = Scans.of(drive), np.random.default_rng(seed)
    starts, goals = (
        scans.beginnings(course.before + course.after, 0.0),
        scans.beginnings(course.after, course.way),
    )
    for start in spread(starts, count, rng) if goals else ():
        lifted = scans.until(start, course.before)
        far = [
            g for g in goals if np.hypot(*(drive.track[g] - drive.track[lifted])) >= course.apart
        ]
        if far:
            yield start, int(rng.choice(far))


def kidnap(
    drive: RealDrive,
    config: LocalizerConfig,
    start: int,
    goal: int,
    course: Course = Course(),
) -> Kidnap:
    """Carry a robot off, and let the same robot drive on; both begin at the true pose."""
    scans = Scans.of(drive)
    lifted, end = scans.until(start, course.before), scans.until(goal, course.after)
    stays = scans.until(lifted, course.after)
    carried = tuple(kidnapped(scans.between(start, lifted), scans.between(goal, end)))
    here = place_at(drive, start)

    def replayed(readings: Sequence[Reading]) -> list[Answer]:
        localizer = Localizer(drive.world, drive.log.mounts, config)
        return list(answered(readings, localizer, start=here, mount=drive.mount))

    found = replayed(carried)
    n = lifted - start
    ready = (
        len(found) > n and found[n - 1].health in TRUSTED and right(drive, found[n - 1], lifted - 1)
    )
    left = replayed(scans.between(start, stays))
    states = [a.health in ALARMS for a in left[n - 1 :]]
    false = sum(b and not a for a, b in pairwise(states))
    watched = scans.stamps[min(stays, len(scans.stamps)) - 1] - scans.stamps[lifted - 1]
    if not ready:
        return Kidnap(True, np.inf, np.inf, np.nan, false, float(watched))
    after = found[n:]
    good = [right(drive, a, goal + i) for i, a in enumerate(after)]
    seconds = [(a.stamp - after[0].stamp) / SECOND for a in after]
    return Kidnap(
        False,
        next((t for a, t in zip(after, seconds, strict=True) if a.health in ALARMS), np.inf),
        _recovered(good, after, seconds),
        _misled(good, after, seconds),
        false,
        float(watched),
    )


def _recovered(good: Sequence[bool], after: Sequence[Answer], seconds: Sequence[float]) -> float:
    since = np.inf
    for fine, answer, t in zip(good, after, seconds, strict=True):
        if not (fine and answer.health in TRUSTED):
            since = np.inf
        elif np.isinf(since):
            since = t
        elif t - since >= HELD:
            return since
    return np.inf


def _misled(good: Sequence[bool], after: Sequence[Answer], seconds: Sequence[float]) -> float:
    steps = zip(good, after, pairwise([*seconds, seconds[-1]]), strict=True)
    return sum(b - a for fine, answer, (a, b) in steps if not fine and answer.health in TRUSTED)
