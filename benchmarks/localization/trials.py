"""Hints and kidnappings by the hundred, in buildings that no constant was chosen with."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.common.figures import OURS, Figure, say, share
from benchmarks.localization.searching import (
    MOST_WAY,
    HintTrial,
    Kidnapping,
    answer,
    hint_trial,
    kidnap_trial,
    searcher_of,
)
from benchmarks.replay.recordings import map_of, record, world_of
from benchmarks.replay.replaying import Moment, replay
from localization.config import LocalizerConfig
from localization.evaluation.fault_injection import Clutter, occluded
from localization.matching.matchers import Matcher
from localization.pipeline.localizer import Localizer
from localization.relocalization.relocalizer import ALMOST_ALL
from localization.types import SECOND, Hint, Pose
from robot_sim import MOUNTS

BUILDINGS = tuple(f"building-{seed}-400" for seed in range(701, 705))
"""Generated; no constant of the localiser was chosen with them."""
LARGE = tuple(f"building-{seed}-2000" for seed in (901, 902))
"""The same; [m^2] is the last number."""
HEIGHT = float(MOUNTS["laser_horizontal"].position[2])
SECONDS = 200.0
"""Of a drive whose sweeps are drawn from [s]: half of a building's tour or more."""
_ELSEWHERE = 6.0
"""A wrong place is farther from the right one than this [m], so that no window around it holds both."""
LEFT = 100
"""Sweeps that are left after any kidnapping: 3 m at walking pace, and some for turning."""


@dataclass(frozen=True, slots=True)
class Condition:
    """What has changed since the map was made."""

    name: str
    hidden: float = 0.0
    """Share of the beams."""
    moved: bool = False
    """Whether all furniture was moved."""
    least: float | None = None
    """Of a hundred kidnapped robots in 400 m^2, so many must find themselves."""
    least_hinted: float | None = None
    """The same of robots with a hint."""


CLEAN = Condition("clean", least=98.0, least_hinted=99.0)
CONDITIONS = (
    CLEAN,
    Condition("30 % occluded", 0.3, least=95.0),
    Condition("furniture moved", moved=True, least=95.0),
)

_BLIND = LocalizerConfig(matcher=Matcher.NONE)
"""Trials want sweeps and odometry as of a robot that was never given its pose."""


def moments(scene: str, seed: int, condition: Condition = CLEAN) -> tuple[Moment, ...]:
    """Return the sweeps of a drive, with odometry and truth."""
    world = world_of(scene, rearranged=seed if condition.moved else None)
    recording = record(world, name=scene, seed=seed, seconds=SECONDS)
    if condition.hidden:
        hidden = tuple(occluded(recording.readings, Clutter(condition.hidden), seed=seed))
        recording = recording.with_fault(condition.name, hidden)
    run = replay(recording, Localizer(map_of(scene), recording.mounts, _BLIND))
    return run.moments[20:]


def hints(per_scene: int = 160) -> Iterator[Figure]:
    """Hints that are 3 m and 60 degrees wrong and say so, in the office and in buildings."""
    rng = np.random.default_rng(5)
    for condition in CONDITIONS:
        trials: list[HintTrial] = []
        for seed, scene in enumerate(("office", *BUILDINGS), start=51):
            drive = moments(scene, seed, condition)
            searcher = searcher_of(map_of(scene), HEIGHT)
            hint_trial(searcher, drive[0], np.random.default_rng(0))  # makes the pyramid
            for i in rng.integers(0, len(drive), per_scene).tolist():
                trials.append(trial := hint_trial(searcher, drive[i], rng))
                if trial.wrong:
                    say(f"    wrongly accepted: {scene}, {condition.name}, {trial.story}")
        yield from _of_hints(condition, trials)


def _of_hints(condition: Condition, trials: Sequence[HintTrial]) -> Iterator[Figure]:
    case, n = f"hint 3 m, 60 deg off, {condition.name}", len(trials)
    cost = np.array([t.seconds for t in trials]) * 1e3
    yield share(
        case,
        OURS,
        "best place right",
        sum(t.right for t in trials),
        n,
        least=condition.least_hinted,
    )
    yield share(case, OURS, "accepted at once and right", sum(t.taken for t in trials), n)
    yield share(case, OURS, "accepted wrongly", sum(t.wrong for t in trials), n, most=0.5)
    yield Figure(case, OURS, "computing, p50", float(np.median(cost)), "ms", n)
    p99 = float(np.percentile(cost, 99))
    yield Figure(case, OURS, "computing, p99", p99, "ms", n, most=250.0)


def wrong_hints(per_scene: int = 80) -> Iterator[Figure]:
    """Hints to another place, as of an operator who mistakes one room for another."""
    rng = np.random.default_rng(6)
    for condition in CONDITIONS:
        trials: list[HintTrial] = []
        for seed, scene in enumerate(("office", *BUILDINGS), start=51):
            drive = moments(scene, seed, condition)
            searcher = searcher_of(map_of(scene), HEIGHT)
            places = np.array([moment.truth.position[:2] for moment in drive])
            for i in rng.integers(0, len(drive), per_scene).tolist():
                far = np.flatnonzero(np.hypot(*(places - places[i]).T) > _ELSEWHERE)
                there = drive[int(rng.choice(far))].truth
                x, y = there.position[:2].tolist()
                hinted = Pose.planar(x, y, float(rng.uniform(-np.pi, np.pi)))
                hint = Hint(drive[i].stamp, hinted, np.zeros((6, 6)))
                trials.append(answer(searcher, drive[i], hint))
        case, n = f"hint to a wrong place, {condition.name}", len(trials)
        yield share(case, OURS, "accepted", sum(t.wrong for t in trials), n)
        full = sum(t.wrong and t.explained >= ALMOST_ALL for t in trials)
        yield share(case, OURS, "accepted and trusted", full, n)


def kidnapped() -> Iterator[Figure]:
    """A robot somewhere in 400 m^2 that nobody placed; it drives on by up to 3 m."""
    yield from _everywhere(BUILDINGS, (CLEAN,), 64, "400 m2", seconds=1.0)


def kidnapped_changed() -> Iterator[Figure]:
    """The same with 30 % of the beams hidden, and with all furniture moved."""
    yield from _everywhere(BUILDINGS, CONDITIONS[1:], 64, "400 m2", seconds=1.0)


def kidnapped_far() -> Iterator[Figure]:
    """The same in 2000 m^2."""
    large = replace(CLEAN, least=95.0)
    yield from _everywhere(LARGE, (large,), 100, "2000 m2", seconds=3.0)


def _everywhere(
    scenes: Sequence[str],
    conditions: Sequence[Condition],
    per_scene: int,
    size: str,
    *,
    seconds: float,
) -> Iterator[Figure]:
    """Yield the figures of each condition; a search may take so many ``seconds``."""
    rng = np.random.default_rng(7)
    for condition in conditions:
        trials: list[Kidnapping] = []
        for seed, scene in enumerate(scenes, start=61):
            drive = moments(scene, seed, condition)
            searcher = searcher_of(map_of(scene), HEIGHT)
            for i in rng.integers(0, len(drive) - LEFT, per_scene).tolist():
                trials.append(trial := kidnap_trial(searcher, drive[i:]))
                if not trial.right:
                    what = "wrong" if trial.wrong else "not settled"
                    at = drive[i].stamp / SECOND
                    say(
                        f"    {what}: {scene}, {condition.name}, from {at:.1f} s, {trial.way:.1f} m"
                    )
        case = f"kidnapped, {size}, {condition.name}"
        yield from _of_kidnappings(case, trials, condition.least, seconds)


def _of_kidnappings(
    case: str, trials: Sequence[Kidnapping], least: float | None, seconds: float
) -> Iterator[Figure]:
    n = len(trials)
    settled = sum(t.right for t in trials)
    name = f"settled right within {MOST_WAY:g} m"
    yield share(case, OURS, "best place of one sweep right", sum(t.first_right for t in trials), n)
    yield share(case, OURS, name, settled, n, least=least)
    yield share(case, OURS, "settled wrongly", sum(t.wrong for t in trials), n, most=0.5)
    ways = [t.way for t in trials if t.right] or [float("nan")]
    yield Figure(case, OURS, "way until settled, p50", float(np.median(ways)), "m", settled)
    yield Figure(case, OURS, "way until settled, p99", float(np.percentile(ways, 99)), "m", settled)
    search, total = (
        np.array([t.search_seconds for t in trials]),
        np.array([t.seconds for t in trials]),
    )
    yield Figure(case, OURS, "one search, p50", float(np.median(search)), "s", n)
    p99 = float(np.percentile(search, 99))
    yield Figure(case, OURS, "one search, p99", p99, "s", n, most=seconds)
    yield Figure(case, OURS, "all computing, p50", float(np.median(total)), "s", n)
    yield Figure(case, OURS, "all computing, p99", float(np.percentile(total, 99)), "s", n)
