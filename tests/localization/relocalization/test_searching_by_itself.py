"""A robot that does not know where it is looks by itself, and places itself only after driving."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

from localization.config import LocalizerConfig
from localization.evaluation.fault_injection import kidnapped
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.matching.scan_consistency import BeamClassifier
from localization.monitoring.belief import Belief, BeliefConfig
from localization.pipeline.localizer import Localizer
from localization.relocalization.hint_search import SearchState
from localization.relocalization.hypotheses import Hypotheses, Hypothesis
from localization.relocalization.relocalizer import CurrentPose, Relocalizer, RelocalizerState
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_schedule import (
    SearchCause,
    SearchSchedule,
    SearchScheduleConfig,
)
from localization.relocalization.search_window import Window
from localization.relocalization.verification import Weighing
from localization.types import (
    SECOND,
    Candidate,
    Estimate,
    Health,
    Hint,
    Pose,
    Reading,
    Scan,
    Verdict,
    end_of,
)
from tests.support_rooms import HALL, MOUNTS, SQUARE, Drive, apart

START = Pose.planar(2.6, 1.6, 0.2)
SEARCHES = SearchScheduleConfig()
EXACT = np.zeros((6, 6))


def run(localizer: Localizer, readings: Iterable[Reading]) -> list[Estimate]:
    """Feed readings; return the estimate whenever time advances."""
    estimates: list[Estimate] = []
    for reading in readings:
        estimate = localizer.add(reading)
        if not estimates or estimate.stamp > estimates[-1].stamp:
            estimates.append(estimate)
    return estimates


def first(estimates: Sequence[Estimate], health: Health) -> float:
    """Return when a state was first reported [s]."""
    return next(e.stamp for e in estimates if e.health is health) / SECOND


@pytest.mark.slow
def test_robot_without_a_pose_searches_after_five_seconds_and_places_itself_once_it_drove(
    hall: PreparedMap,
) -> None:
    drive = Drive(HALL, START, (9.0, 0.0, 0.0), (4.0, 0.4, 0.3), noise=0.012, seed=4)
    estimates = run(Localizer(hall, MOUNTS), drive.readings())
    assert first(estimates, Health.RELOCALISING) == pytest.approx(5.0, abs=0.3)
    standing = [e for e in estimates if e.stamp < 9 * SECOND]
    assert all(e.map_from_base is None for e in standing)
    proposed = standing[-1]
    assert proposed.health is Health.RELOCALISING
    assert "drive on to make sure" in proposed.reasons[0]
    assert apart(proposed.hypotheses[0].map_from_base, drive.pose(proposed.stamp))[0] < 0.05
    last = estimates[-1]
    assert last.map_from_base is not None
    assert apart(last.map_from_base, drive.pose(last.stamp))[0] < 0.02
    placed = next(e.stamp for e in estimates if e.map_from_base is not None)
    assert placed < 12 * SECOND


@pytest.mark.slow
def test_robot_of_which_a_third_is_hidden_takes_no_place_that_another_nearly_equals(
    hall: PreparedMap,
) -> None:
    """The hall looks much the same from the opposite side; what distinguishes them is small beside what is hidden."""
    drive = Drive(HALL, START, (6.0, 0.0, 0.0), (4.0, 0.4, 0.3), noise=0.012, seed=4)
    last = run(Localizer(hall, MOUNTS), (hidden(r) for r in drive.readings()))[-1]
    assert last.map_from_base is None
    assert last.health is Health.RELOCALISING
    best, *others = last.hypotheses
    assert apart(best.map_from_base, drive.pose(last.stamp))[0] < 0.1
    assert others


def hidden(reading: Reading) -> Reading:
    """Return a scan of which something on the robot hides every third beam; other readings as they are."""
    if not isinstance(reading, Scan):
        return reading
    ranges = reading.ranges.copy()
    ranges[::3] = 0.4
    return replace(reading, ranges=ranges)


def test_rejected_hint_begins_a_search_at_once_and_its_answer_says_so(hall: PreparedMap) -> None:
    drive = Drive(HALL, START, (1.0, 0.0, 0.0), (4.0, 0.4, 0.3), noise=0.012, seed=4)
    wrong = Hint(0, Pose.planar(6.5, 3.5, -2.0), np.diag([0.04, 0.04, 0.0, 0.0, 0.0, 0.01]))
    estimates = run(Localizer(hall, MOUNTS), [wrong, *drive.readings()])
    answer = next(e for e in estimates if e.verdict is not None)
    assert answer.verdict is not None
    assert answer.verdict.verdict is Verdict.REJECTED
    assert answer.verdict.reason.endswith("; the whole map is searched")
    assert answer.reasons == ("searching the whole map (the hint was rejected)",)
    assert answer.stamp < SECOND
    last = estimates[-1]
    assert last.map_from_base is not None
    assert apart(last.map_from_base, drive.pose(last.stamp))[0] < 0.02


def test_hint_outside_the_map_begins_a_search_too(hall: PreparedMap) -> None:
    drive = Drive(HALL, START, (0.4, 0.0, 0.0), noise=0.012, seed=4)
    far = Hint(0, Pose.planar(90.0, 3.5, -2.0), EXACT)
    estimates = run(Localizer(hall, MOUNTS), [far, *drive.readings()])
    assert any("searching the whole map" in why for e in estimates for why in e.reasons)


def test_search_gives_way_to_a_hint_and_goes_on_if_that_is_rejected(hall: PreparedMap) -> None:
    drive = Drive(HALL, START, (1.0, 0.0, 0.0), noise=0.012, seed=4)
    localizer = Localizer(hall, MOUNTS)
    localizer.relocalize()
    readings = list(drive.readings())
    begun = next(i for i, r in enumerate(readings) if r.stamp >= SECOND // 5)
    wrong = Hint(0, Pose.planar(6.5, 3.5, -2.0), np.diag([0.04, 0.04, 0.0, 0.0, 0.0, 0.01]))
    estimates = run(localizer, [*readings[:begun], wrong, *readings[begun:]])
    verdicts = [e.verdict.verdict for e in estimates if e.verdict is not None]
    assert verdicts == [Verdict.REJECTED]
    assert apart(estimates[-1].hypotheses[0].map_from_base, START)[0] < 0.05


def test_robot_that_stands_where_places_look_alike_proposes_them_all_and_takes_none(
    square: PreparedMap,
) -> None:
    drive = Drive(SQUARE, Pose.planar(0.8, 0.3, 0.4), (3.0, 0.0, 0.0), noise=0.012, seed=1)
    localizer = Localizer(square, MOUNTS)
    localizer.relocalize()
    last = run(localizer, drive.readings())[-1]
    assert last.map_from_base is None
    assert len(last.hypotheses) >= 4
    assert last.health is Health.RELOCALISING
    assert last.reasons[0].endswith("places explain what is seen: drive on to make sure")


@pytest.mark.slow
def test_carried_robot_that_stands_is_not_placed_anew_and_finds_itself_within_a_metre_of_driving(
    hall: PreparedMap,
) -> None:
    before = Drive(HALL, START, (3.0, 0.3, 0.2), noise=0.012, seed=4)
    there = Pose.planar(5.2, 3.6, -2.4)
    after = Drive(HALL, there, (3.0, 0.0, 0.0), (4.0, 0.4, 0.4), noise=0.012, seed=5)
    spliced = list(kidnapped([Hint(0, START, EXACT), *before.readings()], after.readings()))
    estimates = run(Localizer(hall, MOUNTS), spliced)
    begin = before.end + SECOND // 50
    placed = [e.stamp for e in estimates if any("placed anew" in why for why in e.reasons)]
    assert len(placed) == 2
    assert 3 * SECOND < placed[1] - begin < 6 * SECOND
    way = np.hypot(*(after.pose(placed[1] - begin).position - there.position)[:2])
    assert way < 1.0
    last = estimates[-1]
    assert last.map_from_base is not None
    assert apart(last.map_from_base, after.pose(last.stamp - begin))[0] < 0.02


def carried_within_a_sweep(before: Drive, after: Drive, share: float) -> Iterator[Reading]:
    """Two drives as one; a share of the first sweep after the carry is of the place where the robot was."""
    mixed = set[str]()
    for reading in kidnapped(before.readings(), after.readings()):
        if (
            isinstance(reading, Scan)
            and reading.stamp >= before.end
            and reading.scanner not in mixed
        ):
            mixed.add(reading.scanner)
            old = before.scan(reading.scanner, before.end).ranges
            count = int(share * len(old))
            reading = replace(reading, ranges=np.append(old[:count], reading.ranges[count:]))
        yield reading


@pytest.mark.slow
@pytest.mark.parametrize("way", [0.45, -1.2])
@pytest.mark.parametrize("share", [0.0, 0.8], ids=["between sweeps", "late in a sweep"])
def test_robot_that_is_carried_a_little_while_it_drives_is_right_again_within_a_metre(
    hall: PreparedMap, way: float, share: float
) -> None:
    before = Drive(HALL, START, (3.0, 0.3, 0.2), noise=0.012, seed=4)
    there = before.pose(before.end) @ Pose.planar(way, 0.0, 0.0)
    after = Drive(HALL, there, (6.0, 0.4, 0.3), noise=0.012, seed=5)
    readings = carried_within_a_sweep(before, after, share)
    estimates = run(Localizer(hall, MOUNTS), [Hint(0, START, EXACT), *readings])
    begin, wrong = before.end + SECOND // 50, before.end
    for e in estimates:
        if e.stamp <= begin:
            continue
        assert e.map_from_base is not None
        if apart(e.map_from_base, after.pose(e.stamp - begin))[0] > 0.05:
            wrong = e.stamp
            believed = e.health in (Health.TRACKING, Health.DEGRADED)
            assert not believed or e.stamp < begin + 0.3 * SECOND
    assert np.hypot(*(after.pose(wrong - begin).position - there.position)[:2]) < 1.3


def test_hint_is_searched_for_with_a_sweep_that_began_after_it(hall: PreparedMap) -> None:
    """A robot that was just carried by hand would have its true place refused for what it saw before."""
    before = Drive(HALL, START, (3.0, 0.3, 0.2), noise=0.012, seed=4)
    there = before.pose(before.end) @ Pose.planar(-1.2, 0.0, 0.0)
    after = Drive(HALL, there, (1.0, 0.4, 0.3), noise=0.012, seed=5)
    readings = list(carried_within_a_sweep(before, after, 0.9))
    at = next(k for k, r in enumerate(readings) if end_of(r) > before.end + SECOND // 20)
    hint = Hint(end_of(readings[at]), there, EXACT)
    given = [Hint(0, START, EXACT), *readings[:at], hint, *readings[at:]]
    estimates = run(Localizer(hall, MOUNTS), given)
    (verdict,) = [e.verdict for e in estimates if e.verdict and e.verdict.hint is hint]
    assert verdict.verdict is Verdict.ACCEPTED
    assert apart(verdict.candidates[0].map_from_base, there)[0] < 0.2


def test_late_scan_does_not_change_what_a_search_finds(hall: PreparedMap) -> None:
    drive = Drive(HALL, START, (2.0, 0.0, 0.0), noise=0.012, seed=4)
    readings = list(drive.readings())
    held = next(r for r in readings if isinstance(r, Scan) and r.stamp > SECOND // 2)
    late = [r for r in readings if r is not held]
    late.insert(next(i for i, r in enumerate(late) if r.stamp > SECOND), held)
    found = []
    for order in (readings, late):
        localizer = Localizer(hall, MOUNTS)
        localizer.relocalize()
        found.append(run(localizer, order)[-1].hypotheses[0].map_from_base.position.tolist())
    assert found[0] == pytest.approx(found[1], abs=1e-3)


# The schedule


def test_doubt_with_each_scan_of_a_sparse_log_does_not_search_the_map_with_each(
    hall: PreparedMap,
) -> None:
    """A scan comes each 0.7 m and shows other walls than the last, as if the robot had been carried."""
    relocalizer = Relocalizer(hall, MOUNTS, LocalizerConfig(), BeamClassifier(hall), by_itself=True)
    state, begun = RelocalizerState(), 0
    for i in range(20):
        odom = Pose.planar(0.7 * i, 0.0, 0.0)
        current = CurrentPose(odom, EXACT, placed=True, lost=False, doubtful=True)
        sweep = HALL.sweep(START, stamp=2 * i * SECOND)
        state = relocalizer.begin(state.with_doubt(), sweep, odom, current)
        begun += state.search.task is not None
        state = replace(state, search=SearchState())
    assert begun == 7  # 13.3 m, one in 2.1 m


def test_search_of_the_same_kind_begins_again_only_after_some_way_or_time() -> None:
    schedule = SearchSchedule().moved(Pose.identity()).with_cause(SearchCause.LOST)
    assert schedule.ready(SECOND, SEARCHES)
    again = schedule.started(SECOND).with_cause(SearchCause.LOST)
    assert not again.ready(5 * SECOND, SEARCHES)
    assert again.ready(11 * SECOND, SEARCHES)
    assert again.moved(Pose.planar(1.6, 0.0, 0.0)).ready(2 * SECOND, SEARCHES)
    assert again.with_cause(SearchCause.REQUESTED).ready(SECOND, SEARCHES)


def test_request_is_not_replaced_by_a_weaker_cause() -> None:
    schedule = SearchSchedule().with_cause(SearchCause.REQUESTED).with_cause(SearchCause.DOUBT)
    assert schedule.cause is SearchCause.REQUESTED


# Giving up


def test_places_that_no_sweep_speaks_for_are_given_up_however_well_one_of_them_fits_the_last() -> (
    None
):
    """One of several wrong places explains a lot of the last sweep, nearly always."""
    belief = BeliefConfig()
    lucky = weighed((-2.1, -4.0, -3.1, 0.5))
    other = weighed((-3.0, -3.2, -4.4, -4.1), Pose.planar(4.0, 0.0, 0.0))
    assert Hypotheses((lucky, other)).nowhere(belief)
    assert not Hypotheses((weighed((-2.1,)), weighed((-3.0,)))).nowhere(belief)
    good = weighed((5.2, -1.0, -2.0, 1.5))
    assert not Hypotheses((good, other)).nowhere(belief)


SURE = Belief.of_found(BeliefConfig()).odds
"""Odds, as a logarithm, at which a place is believed."""


def weighed(evidence: tuple[float, ...], at: Pose | None = None) -> Hypothesis:
    """A place with the evidence of some sweeps."""
    return Hypothesis(at or Pose.identity(), (0.7,) * len(evidence), evidence)


def test_estimate_that_stands_is_one_of_the_places_that_a_search_compares() -> None:
    found = (Candidate(Pose.planar(1.0, 0.0, 0.0), 0.6),)
    here = Pose.planar(5.0, 5.0, 0.0)
    places = Hypotheses.of(found, Pose.identity(), SearchConfig(), present=here).places
    assert [p.map_from_base for p in places] == [found[0].map_from_base, here]
    assert [p.score for p in places] == [0.6, 0.0]
    assert Hypotheses.of((), Pose.identity(), SearchConfig(), present=here).places == ()


def test_of_places_alike_that_near_which_the_robot_was_lost_has_the_better_odds() -> None:
    found = [Candidate(Pose.planar(x, 0.0, 0.2), 0.9, 5.0) for x in (9.0, 1.0)]
    found.append(Candidate(Pose.planar(1.0, 0.0, 3.0), 0.9, 5.0))
    around = Window(1.5, 0.5, 0.0, half_width=1.0, half_yaw=0.3)
    places = Hypotheses.of(found, Pose.identity(), SearchConfig(), around=around, prior=4.6).places
    assert [p.prior for p in places] == [0.0, 4.6, 0.0]
    far, near, turned = places
    assert near.advantage(far) == near.advantage(turned) == pytest.approx(4.6)


@pytest.mark.parametrize(
    ("elsewhere", "prior", "replaced"),
    [
        ((5.0, 5.0), 0.0, False),
        ((7.5, 7.5), 0.0, True),
        ((7.5, 7.5), 4.6, False),
        ((7.5,) * 8, 4.6, True),
    ],
)
def test_estimate_that_stands_is_replaced_only_by_a_place_that_surely_outdoes_it(
    elsewhere: tuple[float, ...], prior: float, replaced: bool
) -> None:
    place = weighed(elsewhere, Pose.planar(1.0, 0.0, 0.0))
    estimate = replace(weighed((4.0,) * len(elsewhere)), prior=prior, present=True)
    assert (place.advantage(estimate) > SURE) is replaced


def test_what_two_places_have_in_common_weakens_nothing_that_distinguishes_them() -> None:
    """As in one of two rooms alike, and then in the passage between them."""
    room, passage = (6.0,) * 20, (5.0, 6.0, 6.0)
    right, wrong = weighed((*room, *passage)), weighed((*room, 1.0, 3.0, 2.5))
    short, twin = weighed(passage), weighed((1.0, 3.0, 2.5))
    assert right.advantage(wrong) == pytest.approx(short.advantage(twin))
    assert right.advantage(wrong) > SURE
    assert wrong.advantage(right) == pytest.approx(-right.advantage(wrong))


def test_what_speaks_for_a_place_now_and_against_it_then_says_little() -> None:
    steady, torn = weighed((2.0,) * 6), weighed((7.0, -3.0) * 3)
    assert steady.total == torn.total
    assert steady.advantage(weighed((0.0,) * 6)) > 4.5
    assert torn.advantage(steady) == pytest.approx(0.0)


ELSEWHERE = Candidate(Pose.planar(5.5, 2.5, 2.5), 0.6)
THERE, NOW = Pose.planar(3.0, 2.5, 0.2), Pose.planar(3.4, 2.6, 0.3)
"""Where the robot was when places were found, and where it is when they are compared."""


def compared(
    hall: PreparedMap, found: Sequence[Candidate], odom: Pose, present: Pose | None
) -> tuple[Hypothesis, ...]:
    """The places of a search, and the estimate that stood, after a look at the hall by a robot at ``NOW``."""
    search = SearchConfig()
    places = Hypotheses.of(found, Pose.identity(), search, present=THERE)
    sweep, weighing = HALL.sweep(NOW, stamp=SECOND), Weighing(BeamClassifier(hall))
    left, _ = places.compared(
        sweep, odom, hall, weighing, search, RegistrationConfig(), present=present
    )
    return left.places


def test_estimate_that_is_held_off_its_place_is_compared_with_others_at_its_place(
    hall: PreparedMap,
) -> None:
    """Decimetres off, the right place explains less than a wrong one may, and moving on does not change that."""
    off = NOW @ Pose.planar(0.15, 0.15, 0.17)
    places = compared(hall, [ELSEWHERE], Pose.planar(0.4, 0.0, 0.1), off)
    (stands,) = (p for p in places if p.present)
    assert stands.shares[-1] > 0.95
    assert apart(stands.map_from_base, NOW)[0] < 0.02


def test_estimate_is_not_defended_by_what_it_would_explain_at_a_place_that_a_search_found(
    hall: PreparedMap,
) -> None:
    """A sweep pulls a pose by decimetres, to a place that is then another one's."""
    off, search = Pose.planar(0.4, 0.0, 0.0), SearchConfig()
    found = [Candidate(THERE, 1.0)]
    places = Hypotheses.of(found, Pose.identity(), search, present=THERE @ off)
    left, _ = places.compared(
        HALL.sweep(NOW, stamp=SECOND),
        Pose.planar(0.4, 0.0, 0.1),
        hall,
        Weighing(BeamClassifier(hall)),
        search,
        RegistrationConfig(),
        present=NOW @ off,
    )
    best, *others = left.places
    assert not best.present
    assert apart(best.map_from_base, NOW)[0] < 0.02
    assert all(p.present and p.shares[-1] < best.shares[-1] - 0.1 for p in others)


@pytest.mark.parametrize("found", [[ELSEWHERE], [ELSEWHERE, Candidate(THERE, 1.0)]])
def test_estimate_that_stands_is_compared_where_it_was_registered_not_where_odometry_leads(
    hall: PreparedMap, found: list[Candidate]
) -> None:
    """Odometry that turns too far on the way loses the right place; the estimate has not."""
    odom = Pose.planar(0.4, 0.0, 1.4)
    best, *_ = compared(hall, found, odom, NOW)
    assert best.shares[-1] > 0.95
    assert apart(best.map_from_base, NOW)[0] < 0.02
    lost = compared(hall, found, odom, None)
    assert all(p.shares[-1] < 0.8 for p in lost), "odometry alone leads elsewhere"


@pytest.mark.parametrize("doubtful", [True, False])
def test_estimate_is_moved_to_where_a_check_settles_it_only_if_it_is_doubted(
    hall: PreparedMap, doubtful: bool
) -> None:
    """Shoved among people, a robot is decimetres off and sure to the centimetre: no sweep moves it as far as that."""
    relocalizer = Relocalizer(hall, MOUNTS, LocalizerConfig(), BeamClassifier(hall), by_itself=True)
    off = NOW @ Pose.planar(0.15, 0.15, 0.0)
    places = Hypotheses.of(
        [Candidate(THERE, 1.0, 9.0)], Pose.identity(), SearchConfig(), present=THERE
    )
    state = RelocalizerState(hypotheses=places, checking=True)
    current = CurrentPose(off, EXACT, placed=True, lost=False, doubtful=doubtful, odds=-1.0)
    sweep = HALL.sweep(NOW, stamp=SECOND)
    after, placement = relocalizer.disambiguate(state, sweep, Pose.planar(0.4, 0.1, 0.1), current)
    assert not after.checking
    if doubtful:
        assert placement is not None
        assert apart(placement.map_from_base, NOW)[0] < 0.02
    else:
        assert placement is None


# Carried off: places that were being compared are given up.

PLACES = (Candidate(Pose.planar(1.0, 2.0, 0.0), 0.97), Candidate(Pose.planar(7.0, 2.0, 0.0), 0.95))


def test_comparing_begins_again_with_a_search_at_once() -> None:
    places = Hypotheses.of(PLACES, Pose.identity(), SearchConfig())
    state = RelocalizerState(hypotheses=places, cause=SearchCause.REQUESTED).carried_off()
    assert state.hypotheses.places == ()
    assert state.schedule.cause is SearchCause.REQUESTED
    assert state.schedule.ready(SECOND, SearchScheduleConfig())


def test_robot_that_compares_nothing_goes_on_as_before() -> None:
    state = RelocalizerState()
    assert state.carried_off() is state
