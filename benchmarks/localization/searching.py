"""Hints and kidnappings as trials: the searches of the localiser, on sweeps whose true pose is known."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.replay.replaying import Moment
from localization.geometry import wrap_angle
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.matching.scan_consistency import BeamClassifier
from localization.relocalization.branch_and_bound import Pyramid, search_map
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.hint_search import TICK, HintSearch, SearchState
from localization.relocalization.hypotheses import Hypotheses
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_work import SearchWork
from localization.relocalization.verification import Weighing
from localization.types import SECOND, Candidate, Hint, Pose, Verdict

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
    weighing: Weighing
    hints: HintSearch
    """The localiser's own, for hints."""


def searcher_of(world: PreparedMap, height: float) -> Searcher:
    """Make a map ready; ``height`` is that of the horizontal scanner [m]."""
    config = SearchConfig()
    plan = FloorPlan(world, height, cell=config.cell, sigma=config.field_sigma)
    weighing = Weighing(BeamClassifier(world))
    hints = HintSearch(world, plan, config, weighing=weighing)
    return Searcher(world, Pyramid(plan), config, weighing, hints)


def right(found: Pose, truth: Pose) -> bool:
    """Return whether a place is the true one."""
    off = float(np.hypot(*(found.position - truth.position)[:2]))
    return off < WITHIN and abs(wrap_angle(found.yaw - truth.yaw)) < WITHIN_YAW


@dataclass(frozen=True, slots=True)
class HintTrial:
    """What became of a hint."""

    verdict: Verdict | None
    right: bool
    """Whether the best place is the true one."""
    seconds: float
    """CPU time [s]."""
    story: str
    """The places that were found, for inspection."""
    explained: float = 0.0
    """Share of the sweep that the best place explains."""

    @property
    def taken(self) -> bool:
        """Whether it was accepted and is right."""
        return self.right and self.verdict is Verdict.ACCEPTED

    @property
    def wrong(self) -> bool:
        """Whether it was accepted and is not right."""
        return not self.right and self.verdict is Verdict.ACCEPTED


def hint_trial(
    searcher: Searcher,
    moment: Moment,
    rng: np.random.Generator,
    *,
    off: float = 3.0,
    turn: float = float(np.deg2rad(60.0)),
) -> HintTrial:
    """Give a robot that knows nothing a hint that is off by so much, into any direction, and says so."""
    bearing, sign = rng.uniform(-np.pi, np.pi), rng.choice([-1.0, 1.0])
    x = float(moment.truth.position[0] + off * np.cos(bearing))
    y = float(moment.truth.position[1] + off * np.sin(bearing))
    # Three sigma make the window; 5 degrees are for the grain of its headings.
    sigma, sigma_yaw = off / 3.0, (turn + np.deg2rad(5.0)) / 3.0
    variances = [sigma**2, sigma**2, 0.0, 0.0, 0.0, sigma_yaw**2]
    hinted = Pose.planar(x, y, moment.truth.yaw + sign * turn)
    return answer(searcher, moment, Hint(moment.stamp, hinted, np.diag(variances)))


def answer(searcher: Searcher, moment: Moment, hint: Hint) -> HintTrial:
    """Give a robot that knows nothing a hint."""
    search, odom = searcher.hints, moment.odom_from_base
    state, _ = search.receive(SearchState(), hint, moment.stamp, odom)
    begun, found, now = time.thread_time(), None, moment.stamp
    state = search.begin(state, moment.sweep, odom, level_of(moment))
    while found is None and state.busy:
        now += TICK
        state, found = search.advance(state, odom, None, now=now)
    seconds = time.thread_time() - begun
    if found is None or not found.candidates:
        return HintTrial(Verdict.REJECTED, False, seconds, "nothing was found")
    best = found.candidates[0].map_from_base
    far = float(np.hypot(*(best.position - moment.truth.position)[:2]))
    degrees = np.rad2deg(wrap_angle(best.yaw - moment.truth.yaw))
    scores = ", ".join(f"{c.score:.0%}" for c in found.candidates)
    story = f"{moment.stamp / SECOND:.1f} s: {found.verdict} {far:.2f} m, {degrees:.1f} degrees off; {scores}"
    explained = found.candidates[0].score
    return HintTrial(found.verdict, right(best, moment.truth), seconds, story, explained)


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
    """Search the whole map with the first sweep and discriminate between the places by the next ones.

    As the localiser does: what is found is believed once it is surely better than the rest, and if no place is left
    the search begins anew.
    """
    weighing = searcher.weighing
    begin = moments[0]
    places, first_cost = _everywhere(searcher, begin)
    first_right = bool(places) and right(places[0].map_from_base, begin.truth)
    listed = any(right(p.map_from_base, begin.truth) for p in places)
    hypotheses = Hypotheses.of(places, begin.odom_from_base, SearchConfig())
    way, total, before = 0.0, first_cost, begin
    for moment in moments[1:]:
        step = moment.odom_from_base.position - before.odom_from_base.position
        way, before = way + float(np.hypot(*step[:2])), moment
        if way > MOST_WAY:
            break
        if not hypotheses.places or hypotheses.nowhere(weighing.belief):
            again, cost = _everywhere(searcher, moment)
            total += cost
            hypotheses = Hypotheses.of(again, moment.odom_from_base, SearchConfig())
            continue
        begun = time.thread_time()
        hypotheses, settled = hypotheses.compared(
            moment.sweep,
            moment.odom_from_base,
            searcher.world,
            weighing,
            searcher.config,
            RegistrationConfig(),
        )
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
            moment.sweep,
            searcher.world,
            searcher.pyramid,
            level_of(moment),
            searcher.config,
            weighing=searcher.weighing,
        )
    )


def run(
    work: SearchWork,
) -> tuple[tuple[Candidate, ...], float]:
    """Do all of a search at once; return what it found and its CPU time [s]."""
    begun = time.thread_time()
    while True:
        try:
            next(work)
        except StopIteration as done:
            return tuple(done.value), time.thread_time() - begun
