from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.monitoring.health import (
    HealthConfig,
    HealthMonitor,
    unobservable_axes,
)
from localization.monitoring.jump_detection import Change
from localization.types import SECOND, Health, Match, Pose, ScanConsistency

HERE = Pose.planar(1.0, 2.0, 0.0)
ALL = np.eye(6)


def match(fit: float = 0.9, directions: np.ndarray = ALL) -> Match:
    return Match(0, HERE, np.eye(6), directions, np.zeros(0), fit)


def feed(
    monitor: HealthMonitor,
    n: int,
    refusal: str | None = None,
    *,
    inlier_ratio: float = 0.9,
    consistency: ScanConsistency | None = None,
    elapsed: float = 0.1,
) -> HealthMonitor:
    for _ in range(n):
        monitor = monitor.after_sweep(match(inlier_ratio), HERE, refusal, elapsed, consistency)
    return monitor


def ask(
    monitor: HealthMonitor,
    *,
    sigma: float = 0.02,
    slipping: bool = False,
    silent: tuple[str, ...] = (),
    mounts: tuple[str, ...] = (),
) -> tuple[Health, tuple[str, ...]]:
    return monitor.after_prediction(sigma).status(slipping=slipping, silent=silent, mounts=mounts)


def test_good_sweeps_are_tracking_and_need_no_reasons() -> None:
    assert ask(feed(HealthMonitor(), 5)) == (Health.TRACKING, ())


def test_refused_sweeps_make_suspect_then_lost_in_the_words_of_the_refusal() -> None:
    monitor, c = HealthMonitor(), HealthConfig()
    states = []
    for _ in range(c.lost_after):
        monitor = feed(monitor, 1, "it fits badly")
        states.append(ask(monitor)[0])
    assert states == (
        [Health.TRACKING] * (c.suspect_after - 1)
        + [Health.SUSPECT] * (c.lost_after - c.suspect_after)
        + [Health.LOST]
    )
    assert ask(monitor)[1] == ("it fits badly",)
    assert monitor.lost
    assert monitor.doubtful


def test_given_pose_that_explains_little_is_suspect_until_metres_agree() -> None:
    monitor = HealthMonitor.placed(HealthConfig(), explained=0.62)
    monitor = feed(monitor, 5)
    state, reasons = ask(monitor)
    assert state is Health.SUSPECT
    assert "explains only 62%" in reasons[0]
    assert "undo" in reasons[0]
    assert ask(monitor.after_distance(2.9))[0] is Health.SUSPECT
    assert ask(monitor.after_distance(3.1))[0] is Health.TRACKING
    assert ask(monitor.after_check())[0] is Health.TRACKING, "a search has found no better place"
    assert ask(HealthMonitor.placed(HealthConfig()))[0] is Health.TRACKING


def test_pose_that_was_replaced_is_trusted_at_once_only_after_a_jump_and_if_the_new_one_explains_all() -> (
    None
):
    stood = feed(HealthMonitor(), 5)
    jumped = stood.after_jump(THROUGH, Change.MOST)
    assert ask(HealthMonitor.after_replacement(jumped, 7.0))[0] is Health.TRACKING
    for before, full in ((stood, True), (stood, False), (jumped, False)):
        monitor = HealthMonitor.after_replacement(before, 7.0, full=full)
        state, (reason,) = ask(monitor)
        assert state is Health.SUSPECT
        assert reason.startswith("a search moved the pose by 7.0 m: undo it if that is wrong")
        assert ask(monitor.after_distance(2.9))[0] is Health.SUSPECT
        assert ask(monitor.after_distance(3.1))[0] is Health.TRACKING


def test_poor_fit_is_doubtful_though_not_refused() -> None:
    monitor = feed(HealthMonitor(), 3, inlier_ratio=0.49)
    health, reasons = ask(monitor)
    assert health is Health.SUSPECT
    assert reasons == ("the map explains only 49% of the sweep",)


def test_crowd_before_the_scanners_raises_doubt_but_no_alarm_however_long_it_stays() -> None:
    crowd = ScanConsistency(0.55, 0.5, 0.02, 0.03)
    monitor = feed(HealthMonitor(), 200, inlier_ratio=0.45, consistency=crowd)
    assert ask(monitor)[0] is Health.SUSPECT
    assert not monitor.lost


def test_crowd_that_steps_up_for_a_moment_raises_no_doubt() -> None:
    c = HealthConfig()
    sweeps = round(c.occluded_suspect_after / SECOND / 0.1)
    crowd, through = ScanConsistency(0.55, 0.5, 0.02, 0.03), ScanConsistency(0.55, 0.2, 0.3, 0.05)
    states = [
        ask(feed(HealthMonitor(), n, inlier_ratio=0.45, consistency=crowd))[0]
        for n in (1, sweeps - 1, sweeps + 1)
    ]
    assert states == [Health.TRACKING, Health.TRACKING, Health.SUSPECT]
    # Beams through mapped surfaces contradict the pose.
    doubted = feed(HealthMonitor(), c.lost_after - 1, inlier_ratio=0.45, consistency=through)
    assert ask(doubted)[0] is Health.SUSPECT


def test_share_about_the_limit_is_one_doubt() -> None:
    """One sweep well above the limit ends it, or a few just above."""
    monitor = feed(HealthMonitor(), 3, inlier_ratio=0.49)
    states = []
    for share in (0.51, 0.49, 0.51, 0.51, 0.51):
        monitor = feed(monitor, 1, inlier_ratio=share)
        states.append(ask(monitor)[0])
    assert states == [Health.SUSPECT] * 4 + [Health.TRACKING]
    again = feed(HealthMonitor(), 3, inlier_ratio=0.49)
    assert ask(feed(again, 1, inlier_ratio=0.6))[0] is Health.TRACKING


def test_sweeps_that_a_crowd_hides_altogether_are_lost_only_after_a_while() -> None:
    crowd, c = ScanConsistency(0.8, 0.78, 0.02, 0.0), HealthConfig()
    monitor = feed(
        HealthMonitor(),
        c.occluded_lost_after - 1,
        "it fits badly",
        inlier_ratio=0.2,
        consistency=crowd,
    )
    assert not monitor.lost
    assert feed(monitor, 1, "it fits badly", inlier_ratio=0.2, consistency=crowd).lost


def test_sweeps_that_pass_through_the_map_or_fit_elsewhere_are_lost_soon() -> None:
    through, crowd = ScanConsistency(0.55, 0.2, 0.3, 0.05), ScanConsistency(0.3, 0.3, 0.0, 0.0)
    after = HealthConfig().lost_after
    assert feed(HealthMonitor(), after, inlier_ratio=0.45, consistency=through).lost
    elsewhere = feed(
        HealthMonitor(), after, "it fits where it cannot be", inlier_ratio=0.7, consistency=crowd
    )
    assert elsewhere.lost


def test_one_good_sweep_ends_suspicion_but_not_loss() -> None:
    monitor = feed(feed(HealthMonitor(), 5, "bad"), 1)
    assert ask(monitor)[0] is Health.TRACKING
    monitor = feed(feed(HealthMonitor(), 12, "bad"), 2)
    assert ask(monitor)[0] is Health.LOST
    assert ask(feed(monitor, 1))[0] is Health.TRACKING


def test_good_sweeps_between_bad_ones_keep_it_from_being_lost() -> None:
    monitor = HealthMonitor()
    for _ in range(10):
        monitor = feed(feed(monitor, 11, "bad"), 1)
    assert not monitor.lost


def test_position_known_poorly_is_lost_and_says_how_poorly() -> None:
    monitor = feed(HealthMonitor(), 5)
    assert ask(monitor, sigma=1.2) == (Health.LOST, ("position is known to 1.2 m only",))


def test_slipping_is_said_when_nothing_worse_is() -> None:
    assert ask(feed(HealthMonitor(), 5), slipping=True)[0] is Health.SLIPPING
    assert ask(feed(HealthMonitor(), 5, "bad"), slipping=True)[0] is Health.SUSPECT


def test_silent_sensors_are_named_whatever_the_state() -> None:
    for monitor, wanted in (
        (feed(HealthMonitor(), 5), Health.DEGRADED),
        (feed(HealthMonitor(), 5, "bad"), Health.SUSPECT),
        (feed(HealthMonitor(), 15, "bad"), Health.LOST),
    ):
        health, reasons = ask(monitor, silent=("wheels", "laser_vertical"))
        assert health is wanted
        assert reasons[-2:] == ("nothing from wheels", "nothing from laser_vertical")


def test_doubt_about_a_mount_is_a_note_and_changes_no_state() -> None:
    doubt = ("laser_horizontal seems mounted about 1.2 degrees off in yaw",)
    for monitor in (feed(HealthMonitor(), 5), feed(HealthMonitor(), 5, "bad")):
        assert ask(monitor, mounts=doubt)[0] is ask(monitor)[0]
    assert ask(feed(HealthMonitor(), 5), mounts=doubt) == (Health.TRACKING, doubt)


def test_directions_without_hold_are_named_in_the_robots_words() -> None:
    monitor = HealthMonitor()
    monitor = monitor.after_sweep(match(directions=ALL[1:]), HERE, None, 0.1)
    assert ask(monitor) == (Health.DEGRADED, ("unobservable: forward",))
    monitor = feed(monitor, 1)
    assert ask(monitor)[0] is Health.TRACKING


@pytest.mark.parametrize(
    ("yaw", "blind"), [(0.0, "forward"), (np.pi / 2, "sideways"), (np.pi, "forward")]
)
def test_unobservable_axes_are_those_of_the_robot_not_the_map(yaw: float, blind: str) -> None:
    assert unobservable_axes(match(directions=ALL[1:]), Pose.planar(0, 0, yaw)) == (blind,)


def test_match_that_keeps_nothing_is_blind_all_over() -> None:
    names = unobservable_axes(match(directions=np.zeros((0, 6))), HERE)
    assert names == ("forward", "sideways", "up", "roll", "pitch", "yaw")
    assert unobservable_axes(match(), HERE) == ()


@given(news=st.lists(st.sampled_from(["good", "poor", "refused"]), max_size=60))
def test_state_has_reasons_unless_all_is_well(news: list[str]) -> None:
    monitor = HealthMonitor()
    for item in news:
        match item:
            case "good" | "poor":
                monitor = feed(monitor, 1, inlier_ratio=0.9 if item == "good" else 0.3)
            case "refused":
                monitor = feed(monitor, 1, "bad")
        health, reasons = ask(monitor)
        assert health is Health.TRACKING or reasons
        assert (health is Health.LOST) == monitor.lost


# What the map does not explain

CROWD = ScanConsistency(0.4, 0.37, 0.02, 0.01)
THROUGH = ScanConsistency(0.3, 0.06, 0.2, 0.04)
BEYOND = ScanConsistency(0.95, 0.0, 0.0, 0.95)


def test_crowd_is_reported_and_costs_no_trust() -> None:
    monitor = feed(HealthMonitor(), 2, inlier_ratio=0.6, consistency=CROWD)
    assert ask(monitor) == (Health.TRACKING, ())
    health, (reason,) = ask(feed(monitor, 20, inlier_ratio=0.6, consistency=CROWD))
    assert health is Health.TRACKING
    assert "ends before mapped surfaces: people" in reason
    assert not monitor.doubtful
    assert ask(feed(monitor, 20, consistency=ScanConsistency(0.02, 0.0, 0.0, 0.02)))[1] == ()


def test_sweeps_that_pass_through_walls_make_suspect_within_two_seconds_but_never_lost() -> None:
    monitor, checks, first = HealthMonitor(), 0, None
    for i in range(150):
        monitor = feed(monitor, 1, inlier_ratio=0.7, consistency=THROUGH)
        checks += monitor.needs_check
        if first is None and ask(monitor)[0] is Health.SUSPECT:
            first = i
    assert first is not None
    assert first < 20
    assert checks == 2
    health, (reason,) = ask(monitor)
    assert health is Health.SUSPECT
    assert "passes through mapped surfaces: things gone, or a wrong pose" in reason
    assert not monitor.lost
    assert (
        ask(feed(monitor, 20, consistency=ScanConsistency(0.0, 0.0, 0.0, 0.0)))[0]
        is Health.TRACKING
    )


def test_robot_that_leaves_the_map_is_suspect_but_not_lost() -> None:
    monitor = feed(HealthMonitor(), 5)
    for _ in range(100):
        monitor = feed(monitor, 1, "it fits badly", inlier_ratio=0.05, consistency=BEYOND)
    health, (reason,) = ask(monitor)
    assert health is Health.SUSPECT
    assert reason == "it fits badly: the robot has left the map and goes by its own motion"
    assert not monitor.lost
    assert ask(feed(monitor, 1))[0] is Health.TRACKING
    assert ask(feed(monitor, 12, "it fits badly", consistency=THROUGH))[0] is Health.LOST


def test_estimate_that_no_scanner_speaks_to_is_suspect() -> None:
    monitor = feed(HealthMonitor(), 5)
    health, reasons = monitor.status(
        slipping=False, silent=("a", "b"), blind="all scanners are silent"
    )
    assert health is Health.SUSPECT
    assert reasons[0] == "all scanners are silent: only the robot's own motion is known"
    assert reasons[1:] == ("nothing from a", "nothing from b")


@pytest.mark.parametrize(("elapsed", "sweeps"), [(0.025, 48), (0.1, 12), (1.5, 3)])
def test_break_in_what_is_seen_is_suspect_until_sweeps_have_fit_for_a_time_and_then_wants_a_check(
    elapsed: float, sweeps: int
) -> None:
    monitor = feed(HealthMonitor(), 5)
    monitor = monitor.after_jump(ScanConsistency(0.5, 0.48, 0.01, 0.01), Change.MOST)
    assert ask(monitor)[0] is Health.TRACKING
    monitor = monitor.after_jump(THROUGH, Change.MOST)
    reason = "what is seen changed at once: was the robot carried?"
    assert ask(monitor) == (Health.SUSPECT, (reason,))
    checks = []
    for _ in range(sweeps):
        monitor = feed(monitor, 1, elapsed=elapsed)
        checks.append(monitor.needs_check)
    assert checks == [False] * (len(checks) - 1) + [True]
    assert not feed(monitor, 1).needs_check
    assert ask(monitor) == (Health.TRACKING, ())


def test_change_of_a_part_of_what_is_seen_is_a_jump_if_more_passes_through_the_map_with_it() -> (
    None
):
    usual = ScanConsistency(0.15, 0.01, 0.02, 0.12)
    monitor = feed(HealthMonitor(), 60, consistency=usual)
    crowd = ScanConsistency(0.46, 0.31, 0.03, 0.12)
    another_aisle = ScanConsistency(0.24, 0.04, 0.05, 0.15)
    assert monitor.after_jump(crowd, Change.PART) is monitor
    assert monitor.after_jump(another_aisle, Change.NONE) is monitor
    assert monitor.after_jump(None, Change.PART) is monitor
    assert ask(monitor.after_jump(another_aisle, Change.PART))[0] is Health.SUSPECT


def test_change_of_most_of_what_is_seen_is_a_jump_if_much_more_contradicts_the_map_with_it() -> (
    None
):
    usual = ScanConsistency(0.2, 0.0, 0.02, 0.12)
    crowd = ScanConsistency(0.4, 0.2, 0.02, 0.18)
    elsewhere = ScanConsistency(0.7, 0.3, 0.03, 0.37)
    for config in (HealthConfig(), HealthConfig(jump_growth=-1.0)):
        monitor = feed(HealthMonitor(config), 60, consistency=usual)
        unmoved = monitor.after_jump(crowd, Change.MOST) is monitor
        assert unmoved == (config.jump_growth > 0.0)
        assert ask(monitor.after_jump(crowd, Change.UNKNOWN))[0] is Health.SUSPECT
        assert ask(monitor.after_jump(elsewhere, Change.MOST))[0] is Health.SUSPECT
