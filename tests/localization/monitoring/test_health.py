from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.monitoring.belief import BeliefConfig
from localization.monitoring.health import (
    HealthConfig,
    HealthMonitor,
    Refusal,
    unobservable_axes,
)
from localization.monitoring.jump_detection import Change
from localization.types import Health, Match, Pose, ScanConsistency

HERE = Pose.planar(1.0, 2.0, 0.0)
ALL = np.eye(6)
GOOD = ScanConsistency(0.06, 0.02, 0.01, 0.03)
CROWD = ScanConsistency(0.55, 0.5, 0.02, 0.03)
HIDDEN = ScanConsistency(0.8, 0.78, 0.02, 0.0)
CLOSE = ScanConsistency(0.98, 0.98, 0.0, 0.0)
MOVED = ScanConsistency(0.3, 0.06, 0.2, 0.04)
WRONG = ScanConsistency(0.6, 0.2, 0.3, 0.1)
BEYOND = ScanConsistency(0.95, 0.0, 0.0, 0.95)
ELSEWHERE = Refusal("it fits where it cannot be", excess=100.0)
CHANGED = "what is seen changed at once: was the robot carried?"


def match(fit: float = 0.9, directions: np.ndarray = ALL) -> Match:
    return Match(0, HERE, np.eye(6), directions, np.zeros(0), fit)


def feed(
    monitor: HealthMonitor,
    n: int,
    consistency: ScanConsistency | None = GOOD,
    *,
    refusal: Refusal | None = None,
    elapsed: float = 0.1,
    change: Change | None = None,
    blind: bool = False,
    slipping: bool = False,
) -> HealthMonitor:
    explained = 1.0 - consistency.unexplained if consistency else 0.0
    for _ in range(n):
        monitor = monitor.after_sweep(
            match(explained), HERE, refusal, elapsed, 0.3 * elapsed, consistency, change, blind, slipping
        )  # fmt: skip
    return monitor


def found() -> HealthMonitor:
    return HealthMonitor.placed(HealthConfig(), BeliefConfig())


STOOD = feed(HealthMonitor(), 20)
CARRIED = feed(STOOD, 1, ScanConsistency(0.45, 0.1, 0.15, 0.2), change=Change(0.6, 0.1))


def ask(
    monitor: HealthMonitor,
    *,
    sigma: float = 0.02,
    slipping: bool = False,
    silent: tuple[str, ...] = (),
    mounts: tuple[str, ...] = (),
) -> tuple[Health, tuple[str, ...]]:
    return monitor.after_prediction(sigma).status(slipping=slipping, silent=silent, mounts=mounts)


def until(monitor: HealthMonitor, state: Health, seen: ScanConsistency, elapsed: float) -> float:
    """The time until sweeps have brought it to a state [s]."""
    seconds = 0.0
    while ask(monitor)[0] is not state:
        monitor, seconds = feed(monitor, 1, seen, elapsed=elapsed), seconds + elapsed
        assert seconds < 20.0
    return seconds


def test_good_sweeps_are_tracking_and_need_no_reasons() -> None:
    assert ask(STOOD) == (Health.TRACKING, ())


def test_sweeps_that_contradict_the_map_make_suspect_then_lost_in_words() -> None:
    states = [ask(feed(STOOD, n, WRONG))[0] for n in range(21)]
    assert states[0] is Health.TRACKING
    assert states == sorted(states, key=[Health.TRACKING, Health.SUSPECT, Health.LOST].index)
    assert {Health.SUSPECT, Health.LOST} < set(states)
    lost = feed(STOOD, 20, WRONG)
    assert ask(lost)[1][0].startswith("the map explains only 40% of the sweep")
    assert lost.doubtful


def test_time_until_a_wrong_pose_is_lost_hardly_depends_on_how_often_sweeps_come() -> None:
    times = [until(STOOD, Health.LOST, WRONG, elapsed) for elapsed in (0.025, 0.05, 0.1, 0.2)]
    assert max(times) < 2.0
    assert max(times) - min(times) <= 0.3


def test_lost_pose_is_trusted_again_once_sweeps_fit_for_a_time() -> None:
    lost = feed(STOOD, 60, WRONG)
    assert ask(feed(lost, 1))[0] is Health.LOST
    assert 0.4 < until(lost, Health.TRACKING, GOOD, 0.1) < 2.0


def test_no_single_sweep_makes_a_pose_lost_and_two_that_agree_do() -> None:
    once = feed(STOOD, 1, WRONG, change=Change(0.9, 1.0), elapsed=1.0)
    assert ask(once)[0] is Health.SUSPECT
    assert ask(feed(once, 1, WRONG, elapsed=1.0))[0] is Health.LOST
    assert ask(feed(once, 2, elapsed=1.0))[0] is Health.TRACKING


def test_crowd_before_the_scanners_is_no_alarm_however_long_it_stays() -> None:
    assert ask(feed(STOOD, 600, CROWD))[0] is Health.TRACKING
    hidden = Refusal("it fits badly")
    assert not feed(STOOD, 50, HIDDEN, refusal=hidden).lost


def test_sweeps_that_fit_where_the_robot_cannot_be_are_lost_soon() -> None:
    assert feed(STOOD, 20, GOOD, refusal=ELSEWHERE).lost
    assert feed(STOOD, 20, None, refusal=ELSEWHERE).lost
    assert ask(feed(STOOD, 20, GOOD, refusal=ELSEWHERE))[1] == (ELSEWHERE.reason,)


def test_sweep_that_fits_elsewhere_speaks_against_the_pose_as_far_as_it_is_beyond_the_gate() -> (
    None
):
    before = STOOD.belief.odds
    excess = (0.1, 2.0, 6.0, 100.0)
    lost = [
        before - feed(STOOD, 1, refusal=Refusal("elsewhere", x), elapsed=1.0).belief.odds
        for x in excess
    ]
    assert lost == sorted(lost)
    assert lost[1] - lost[0] == pytest.approx(0.95)
    assert lost[3] == pytest.approx(before + 1.0), "one sweep makes no pose lost"


def test_refused_sweep_that_is_mostly_hidden_does_not_speak_for_the_pose() -> None:
    doubted = feed(STOOD, 3, WRONG)
    hidden = feed(doubted, 20, CLOSE, refusal=Refusal("it fits badly"))
    assert hidden.belief.odds <= feed(doubted, 20, None).belief.odds
    assert feed(doubted, 20, CLOSE).belief.odds > doubted.belief.odds


def test_robot_whose_wheels_slip_while_no_sweep_is_of_use_is_suspect_within_two_seconds() -> None:
    badly = Refusal("it fits badly")
    assert ask(feed(STOOD, 20, CLOSE, refusal=badly))[0] is Health.TRACKING
    assert ask(feed(STOOD, 20, CROWD, slipping=True))[0] is Health.TRACKING
    health, (reason,) = ask(feed(STOOD, 20, CLOSE, refusal=badly, slipping=True), slipping=True)
    assert health is Health.SUSPECT
    assert reason == "it fits badly while the wheels slip"


def test_sweeps_that_are_compared_with_nothing_say_nothing() -> None:
    assert ask(feed(STOOD, 20, None))[0] is Health.TRACKING


def test_position_known_poorly_is_lost_and_says_how_poorly_until_it_is_known_again() -> None:
    assert ask(STOOD, sigma=1.2) == (Health.LOST, ("position is known to 1.2 m only",))
    assert ask(STOOD.after_prediction(1.2), sigma=0.1)[0] is Health.TRACKING


def test_slipping_is_said_when_nothing_worse_is() -> None:
    assert ask(STOOD, slipping=True)[0] is Health.SLIPPING
    assert ask(feed(STOOD, 20, MOVED), slipping=True)[0] is Health.SUSPECT


def test_silent_sensors_are_named_whatever_the_state() -> None:
    for monitor, wanted in (
        (STOOD, Health.DEGRADED),
        (feed(STOOD, 20, MOVED), Health.SUSPECT),
        (feed(STOOD, 20, WRONG), Health.LOST),
    ):
        health, reasons = ask(monitor, silent=("wheels", "laser_vertical"))
        assert health is wanted
        assert reasons[-2:] == ("nothing from wheels", "nothing from laser_vertical")


def test_doubt_about_a_mount_is_a_note_and_changes_no_state() -> None:
    doubt = ("laser_horizontal seems mounted about 1.2 degrees off in yaw",)
    for monitor in (STOOD, feed(STOOD, 20, MOVED)):
        assert ask(monitor, mounts=doubt)[0] is ask(monitor)[0]
    assert ask(STOOD, mounts=doubt) == (Health.TRACKING, doubt)


def test_directions_without_hold_are_named_in_the_robots_words() -> None:
    monitor = STOOD.after_sweep(match(directions=ALL[1:]), HERE, None, 0.1, 0.0, GOOD)
    assert ask(monitor) == (Health.DEGRADED, ("unobservable: forward",))
    assert ask(feed(monitor, 1))[0] is Health.TRACKING


@pytest.mark.parametrize(
    ("yaw", "blind"), [(0.0, "forward"), (np.pi / 2, "sideways"), (np.pi, "forward")]
)
def test_unobservable_axes_are_those_of_the_robot_not_the_map(yaw: float, blind: str) -> None:
    assert unobservable_axes(match(directions=ALL[1:]), Pose.planar(0, 0, yaw)) == (blind,)


def test_match_that_keeps_nothing_is_blind_all_over() -> None:
    names = unobservable_axes(match(directions=np.zeros((0, 6))), HERE)
    assert names == ("forward", "sideways", "up", "roll", "pitch", "yaw")
    assert unobservable_axes(match(), HERE) == ()


SEEN = [GOOD, CROWD, HIDDEN, MOVED, WRONG, BEYOND, None]


@given(news=st.lists(st.sampled_from(SEEN), max_size=60))
def test_state_has_reasons_unless_all_is_well(news: list[ScanConsistency | None]) -> None:
    monitor = HealthMonitor()
    for seen in news:
        monitor = feed(monitor, 1, seen)
        health, reasons = ask(monitor)
        assert health is Health.TRACKING or all(reasons)
        assert health is Health.TRACKING or reasons
        assert (health is Health.LOST) == monitor.lost


# What the map does not explain


def test_crowd_is_reported_and_costs_no_trust() -> None:
    assert ask(feed(STOOD, 2, CROWD)) == (Health.TRACKING, ())
    health, (reason,) = ask(feed(STOOD, 20, CROWD))
    assert health is Health.TRACKING
    assert "ends before mapped surfaces: people" in reason
    assert ask(feed(feed(STOOD, 20, CROWD), 20))[1] == ()


def test_sweeps_of_which_most_fits_but_some_passes_through_walls_are_suspect_never_lost() -> None:
    assert until(STOOD, Health.SUSPECT, MOVED, 0.1) < 2.0
    monitor = feed(STOOD, 150, MOVED)
    health, (reason,) = ask(monitor)
    assert health is Health.SUSPECT
    assert "passes through mapped surfaces: things gone, or a wrong pose" in reason
    assert not monitor.lost
    assert until(monitor, Health.TRACKING, GOOD, 0.1) < 1.5


def test_doubt_that_lasts_wants_other_places_searched_but_no_moments_doubt_does() -> None:
    checks = [feed(STOOD, n, MOVED).needs_check for n in range(40)]
    first = checks.index(True)
    begun = [feed(STOOD, n, MOVED).doubtful for n in range(40)].index(True)
    assert (first - begun) * 0.1 == pytest.approx(HealthConfig().check_after, abs=0.11)
    assert all(checks[first:])
    assert not feed(STOOD, 60, WRONG).needs_check, "a lost robot is searched for anyway"


def test_robot_that_leaves_the_map_is_suspect_but_not_lost() -> None:
    badly = Refusal("it fits badly")
    monitor = feed(STOOD, 100, BEYOND, refusal=badly)
    health, (reason,) = ask(monitor)
    assert health is Health.SUSPECT
    assert reason == "it fits badly: the robot has left the map and goes by its own motion"
    assert not monitor.needs_check
    assert until(monitor, Health.TRACKING, GOOD, 0.1) < 1.5
    assert until(monitor, Health.LOST, WRONG, 0.1) < 2.0


def test_estimate_that_no_scanner_speaks_to_is_suspect() -> None:
    health, reasons = STOOD.status(
        slipping=False, silent=("a", "b"), blind="all scanners are silent"
    )
    assert health is Health.SUSPECT
    assert reasons[0] == "all scanners are silent: only the robot's own motion is known"
    assert reasons[1:] == ("nothing from a", "nothing from b")


def test_break_in_what_is_seen_is_suspect_until_sweeps_fit_and_then_wants_a_check() -> None:
    assert ask(CARRIED) == (Health.SUSPECT, (CHANGED,))
    assert not CARRIED.needs_check
    monitor = CARRIED
    while monitor.doubtful:
        monitor = feed(monitor, 1)
    assert monitor.needs_check
    assert not monitor.after_check().needs_check


def test_another_view_is_a_change_only_where_the_map_explains_less_of_it_than_before() -> None:
    another_aisle = ScanConsistency(0.24, 0.04, 0.1, 0.1)
    assert ask(feed(STOOD, 1, another_aisle, change=Change(0.4, 0.1)))[0] is Health.SUSPECT
    assert ask(feed(STOOD, 1, another_aisle, change=Change(0.02, 0.1)))[0] is Health.TRACKING
    assert ask(feed(STOOD, 1, GOOD, change=Change(0.4, 0.1)))[0] is Health.TRACKING


def test_robot_that_drove_without_a_sweep_is_believed_only_as_far_as_the_next_one_fits() -> None:
    fits, fits_not = (feed(STOOD, 1, seen, elapsed=3.0, blind=True) for seen in (GOOD, WRONG))
    assert not fits.doubtful
    assert fits.unconfirmed == HealthConfig().agreement_distance
    assert fits_not.carried
    assert ask(fits_not)[0] is Health.SUSPECT
