"""Robots carried off on real logs: a stretch at one place, then at once a stretch from another place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.real.logs import RealDrive
from benchmarks.real.scores import TRUSTED, Answer, answered
from benchmarks.real.trials import Scans, place_at, right, spread
from localization.evaluation.fault_injection import kidnapped
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND, Health, Pose, Reading

HELD = 2.0
"""A pose counts as recovered if it is right and trusted for so long [s]."""
ALARMS = (Health.SUSPECT, Health.LOST, Health.RELOCALISING)
"""States that say that the pose may be wrong."""


@dataclass(frozen=True, slots=True)
class Course:
    """How a robot is carried off."""

    before: float = 10.0
    """Length of the log before [s]."""
    after: float = 30.0
    """Length of the log afterwards [s]."""
    way: float = 3.0
    """The robot drives at least so far afterwards [m]: standing still does not distinguish places."""
    apart: float = 4.0
    """The two places are at least this far apart [m]."""


@dataclass(frozen=True, slots=True)
class Noticed:
    """What was said of one robot that was carried off, and of the same robot left where it was."""

    doubted: bool
    """Whether the pose was not right or not trusted before: then nothing after it is counted."""
    alarm: float
    """Time until an alarm [s]; infinite if there was none."""
    false_alarms: int
    """How often an alarm began in the same stretch without a kidnap."""
    alarmed: float
    """Share of that stretch's scans with an alarm."""
    watched: float
    """Length of that stretch [s]."""


@dataclass(frozen=True, slots=True)
class Kidnap(Noticed):
    """What became of our localiser's robot besides."""

    recovery: float
    """Time until the begin of ``HELD`` with a right and trusted pose [s]; infinite if there was none."""
    search: float
    """The same time of a localiser that begins at the second place without a pose [s]."""
    misled: float
    """Time in a trusted state with a pose that is not right [s]."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Stretches:
    """The readings of a robot that is carried off, and of the same robot left where it was."""

    carried: Sequence[Reading]
    left: Sequence[Reading]
    before: int
    """Number of scans before it is carried off."""
    watched: float
    """Length of the stretch after that, of the robot that was left [s]."""


def stretches(drive: RealDrive, start: int, goal: int, course: Course = Course()) -> Stretches:
    """Return what becomes of a robot that begins at one scan and is carried off to another."""
    scans = Scans.of(drive)
    lifted, end = scans.until(start, course.before), scans.until(goal, course.after)
    stays = scans.until(lifted, course.after)
    return Stretches(
        tuple(kidnapped(scans.between(start, lifted), scans.between(goal, end))),
        scans.between(start, stays),
        lifted - start,
        float(scans.stamps[min(stays, len(scans.stamps)) - 1] - scans.stamps[lifted - 1]),
    )


def kidnap(
    drive: RealDrive,
    config: LocalizerConfig,
    start: int,
    goal: int,
    course: Course = Course(),
) -> Kidnap:
    """Carry a robot off, let the same robot drive on, and let one begin at the second place without a pose.

    Those two begin at the true pose. All counts of time begin with the first scan after the kidnap.
    """
    scans, s = Scans.of(drive), stretches(drive, start, goal, course)
    here, n = place_at(drive, start), s.before

    def replayed(readings: Sequence[Reading], start: Pose | None) -> list[Answer]:
        localizer = Localizer(drive.world, drive.log.mounts, config)
        if start is None:
            localizer.relocalize()
        return list(answered(readings, localizer, start=start, mount=drive.mount))

    found, left = replayed(s.carried, here), replayed(s.left, here)
    ready = (
        len(found) > n
        and found[n - 1].health in TRUSTED
        and right(drive, found[n - 1], start + n - 1)
    )
    end = scans.until(goal, course.after)
    search = _recovered(drive, goal, replayed(scans.between(goal, end), None))
    after = found[n:]
    alarms = [_since(after, a) for a in after if a.health in ALARMS]
    idle = [a.health in ALARMS for a in left[n - 1 :]]
    return Kidnap(
        doubted=not ready,
        alarm=min(alarms, default=np.inf),
        recovery=_recovered(drive, goal, after),
        search=search,
        misled=_misled(drive, goal, after),
        false_alarms=onsets(idle),
        alarmed=float(np.mean(idle)),
        watched=s.watched,
    )


def onsets(alarms: Sequence[bool]) -> int:
    """Return how often an alarm began."""
    return sum(now and not before for before, now in pairwise(alarms))


def _since(after: Sequence[Answer], answer: Answer) -> float:
    return (answer.stamp - after[0].stamp) / SECOND


def _recovered(drive: RealDrive, first: int, after: Sequence[Answer]) -> float:
    """Return the time from the first answer, at scan ``first``, to where the pose is right and trusted for long [s]."""
    begun = np.inf
    for i, answer in enumerate(after):
        now = _since(after, answer)
        if answer.health not in TRUSTED or not right(drive, answer, first + i):
            begun = np.inf
        elif np.isinf(begun):
            begun = now
        elif now - begun >= HELD:
            return begun
    return np.inf


def _misled(drive: RealDrive, first: int, after: Sequence[Answer]) -> float:
    """Return the time in which a pose that is not right is trusted [s]; answers begin with scan ``first``.

    Each answer counts until the next one of a scan with a corrected pose; others have no truth of their own.
    """
    known = [(i, a) for i, a in enumerate(after, first) if drive.corrected[i]]
    return sum(
        (there.stamp - here.stamp) / SECOND
        for (i, here), (_, there) in pairwise(known)
        if here.health in TRUSTED and not right(drive, here, i)
    )
