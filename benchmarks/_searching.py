"""Hints and kidnappings as trials: the searches of the localiser, on sweeps whose true pose is known."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks._replaying import Moment
from localization.geometry import wrap_angle
from localization.hypotheses import Hypotheses, HypothesesConfig
from localization.prepared import PreparedMap
from localization.relocalization import (
    FloorPlan,
    SearchConfig,
    Window,
    distinguishable,
)
from localization.types import Candidate, Pose
from localization.whole_map import Pyramid, search_map

WITHIN, WITHIN_YAW = 0.10, np.deg2rad(2.0)
"""A place that is found is right within [m, rad]."""
MOST_WAY = 3.0
"""A kidnapped robot drives on by so much at most [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Searcher:
    """A map made ready for searching, and what counts as found."""

    world: PreparedMap
    pyramid: Pyramid
    config: SearchConfig


def searcher_of(world: PreparedMap, height: float) -> Searcher:
    """Make a map ready; ``height`` is that of the horizontal scanner [m]."""
    config = SearchConfig()
    plan = FloorPlan(world, height, cell=config.cell, sigma=config.field_sigma)
    return Searcher(world, Pyramid(plan), config)


def right(found: Pose, truth: Pose) -> bool:
    """Return whether a place is the true one."""
    off = float(np.hypot(*(found.position - truth.position)[:2]))
    return off < WITHIN and abs(wrap_angle(found.yaw - truth.yaw)) < WITHIN_YAW


@dataclass(frozen=True, slots=True)
class HintTrial:
    """What became of a hint."""

    right: bool
    """Whether the best place is the true one."""
    accepted: bool
    """Whether it was told apart from the others at once."""
    seconds: float
    """CPU time [s]."""


def hint_trial(
    searcher: Searcher,
    moment: Moment,
    rng: np.random.Generator,
    *,
    off: float = 3.0,
    turn: float = float(np.deg2rad(60.0)),
) -> HintTrial:
    """Search around a hint that is off by so much, into any direction, and knows it."""
    bearing, sign = rng.uniform(-np.pi, np.pi), rng.choice([-1.0, 1.0])
    x = float(moment.truth.position[0] + off * np.cos(bearing))
    y = float(moment.truth.position[1] + off * np.sin(bearing))
    window = Window(x, y, moment.truth.yaw + sign * turn, off, turn + float(np.deg2rad(5.0)))
    places, seconds = run(
        search_map(
            moment.sweep,
            searcher.world,
            searcher.pyramid,
            level_of(moment),
            searcher.config,
            window,
        )
    )
    if not places:
        return HintTrial(False, False, seconds)
    c = searcher.config
    clear = len(places) < 2 or distinguishable(places[0].score, places[1].score, c)
    accepted = places[0].score >= c.least_fit and clear
    return HintTrial(right(places[0].map_from_base, moment.truth), accepted, seconds)


@dataclass(frozen=True, slots=True)
class Kidnapping:
    """How a kidnapped robot found itself."""

    first_right: bool
    """Whether the best place of the first sweep is the true one."""
    listed: bool
    """Whether the true place is among those found."""
    right: bool
    """Whether it settled on the true place within the way allowed."""
    wrong: bool
    """Whether it settled on another."""
    way: float
    """That it drove [m]."""
    search_seconds: float
    """CPU time of searching the whole map once [s]."""
    seconds: float
    """CPU time of all, until it was settled [s]."""


def kidnap_trial(searcher: Searcher, moments: Sequence[Moment]) -> Kidnapping:
    """Search the whole map with the first sweep and tell places apart by the next ones.

    As the localiser does: what is found is believed only after some way, and if no place is left the
    search begins anew.
    """
    settings = HypothesesConfig()
    hypotheses = Hypotheses(searcher.world, searcher.config, settings)
    begin = moments[0]
    places, first_cost = _everywhere(searcher, begin)
    first_right = bool(places) and right(places[0].map_from_base, begin.truth)
    listed = any(right(p.map_from_base, begin.truth) for p in places)
    hypotheses.begin(places, begin.odom_from_base)
    way, total, before = 0.0, first_cost, begin
    for moment in moments[1:]:
        step = moment.odom_from_base.position - before.odom_from_base.position
        way, before = way + float(np.hypot(*step[:2])), moment
        if way > MOST_WAY:
            break
        if not hypotheses.open or hypotheses.exhausted:
            again, cost = _everywhere(searcher, moment)
            total += cost
            hypotheses.drop()
            hypotheses.begin(again, moment.odom_from_base)
            continue
        begun = time.thread_time()
        settled = hypotheses.look(moment.sweep, moment.odom_from_base)
        total += time.thread_time() - begun
        if settled is not None:
            good = right(settled.map_from_base, moment.truth)
            return Kidnapping(first_right, listed, good, not good, way, first_cost, total)
    return Kidnapping(first_right, listed, False, False, way, first_cost, total)


def level_of(moment: Moment) -> Pose:
    """Return what the robot knows of how it stands: height, roll and pitch of an even floor."""
    return Pose.from_euler([0.0, 0.0, moment.truth.position[2]])


def _everywhere(searcher: Searcher, moment: Moment) -> tuple[tuple[Candidate, ...], float]:
    return run(
        search_map(
            moment.sweep, searcher.world, searcher.pyramid, level_of(moment), searcher.config
        )
    )


def run(
    work: Generator[None, None, tuple[Candidate, ...]],
) -> tuple[tuple[Candidate, ...], float]:
    """Do all of a search at once; return what it found and its CPU time [s]."""
    begun = time.thread_time()
    while True:
        try:
            next(work)
        except StopIteration as done:
            return tuple(done.value), time.thread_time() - begun
