"""What the referee counts and notes, of ticks made by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from localization.types import SECOND, Health, Hint, HintVerdict, Pose, Verdict
from robot_sim import TICK_NS
from teleop.robot.inbox import PoseHint
from teleop.scenario.files.limits import Limits
from teleop.scenario.referee.outcome import Event, EventKind
from teleop.scenario.referee.referee import GoalPoint, Referee
from tests.teleop.scenario.referee.ticks import Ticks, drive_command

NEAR = GoalPoint("near", 1.0, 0.0, 0.5, 0)
FAR = GoalPoint("far", 5.0, 0.0, 0.5, 0)


def referee(*goals: GoalPoint) -> Referee:
    return Referee(goals, Limits())


def texts(judge: Referee, kind: EventKind) -> list[str]:
    return [event.text for event in judge.events if event.kind is kind]


def test_goals_count_only_in_their_order() -> None:
    judge, ticks = referee(NEAR, FAR), Ticks()
    judge.take(ticks.tick(5.0))
    assert judge.reached == 0
    judge.take(ticks.tick(1.0))
    assert judge.reached == 1
    assert not judge.all_reached
    judge.take(ticks.tick(5.0))
    assert judge.all_reached
    assert texts(judge, EventKind.GOAL) == ["reached goal 1: near", "reached goal 2: far"]
    assert judge.judged()[1]["goal_time"] == pytest.approx(0.06)


def test_goal_is_reached_at_its_distance_and_not_a_hair_before() -> None:
    judge, ticks = referee(NEAR), Ticks()
    judge.take(ticks.tick(0.5 - 1e-9))
    assert judge.reached == 0
    judge.take(ticks.tick(0.5))
    assert judge.reached == 1


def test_goal_is_reached_by_truth_and_not_by_the_estimate() -> None:
    judge, ticks = referee(NEAR), Ticks()
    judge.take(ticks.tick(9.0, guess=(1.0, 0.0, 0.0)))
    assert judge.reached == 0
    judge.take(ticks.tick(1.0, guess=(9.0, 0.0, 0.0)))
    assert judge.reached == 1


def test_goal_to_stay_at_counts_after_that_time_without_a_break() -> None:
    judge, ticks = referee(GoalPoint("stay", 1.0, 0.0, 0.5, 5 * TICK_NS)), Ticks()
    for _ in range(5):
        judge.take(ticks.tick(1.0))
    judge.take(ticks.tick(3.0))
    for _ in range(5):
        judge.take(ticks.tick(1.0))
    assert judge.reached == 0
    judge.take(ticks.tick(1.0))
    assert judge.reached == 1


def test_goals_at_one_place_are_reached_one_a_tick() -> None:
    judge, ticks = referee(NEAR, NEAR, NEAR), Ticks()
    for count in (1, 2, 3):
        judge.take(ticks.tick(1.0))
        assert judge.reached == count


def test_without_goals_none_is_missing_and_none_is_reached() -> None:
    judge = referee()
    judge.take(Ticks().tick())
    assert not judge.all_reached
    _, figures, checks = judge.judged()
    assert figures["goal_time"] == 0.0
    assert [check.name for check in checks] == ["violations"]


def test_touch_counts_once_though_the_hull_bounces_along_the_wall() -> None:
    judge, ticks = referee(), Ticks()
    for i in range(200):
        judge.take(ticks.tick(touching=() if i % 3 else ("wall",)))
    assert judge.contacts == 1
    assert texts(judge, EventKind.CONTACT) == ["touched wall"]


def test_wall_that_is_touched_again_after_a_second_counts_again() -> None:
    judge, ticks = referee(), Ticks()
    for clear, contacts in ((48, 1), (49, 2)):
        judge.take(ticks.tick(touching=("wall",)))
        for _ in range(clear):
            judge.take(ticks.tick())
        judge.take(ticks.tick(touching=("wall",)))
        assert judge.contacts == contacts


def test_each_obstacle_counts_by_itself() -> None:
    judge, ticks = referee(), Ticks()
    judge.take(ticks.tick(touching=("chair", "wall")))
    judge.take(ticks.tick(touching=("table", "wall")))
    assert judge.contacts == 3


def test_hints_of_clients_count_and_that_of_the_start_does_not() -> None:
    judge, ticks = referee(), Ticks()
    hint = Hint(0, Pose.identity(), np.zeros((6, 6)))
    judge.take(ticks.tick(inbox=[PoseHint("", hint)]))
    answer = HintVerdict(0, hint, Verdict.REJECTED, "no pose explains the sweep")
    judge.take(ticks.tick(inbox=[PoseHint("ann", hint), PoseHint("bob", hint)], verdict=answer))
    assert judge.judged()[1]["hints"] == 2.0
    assert texts(judge, EventKind.HINT) == [
        "hint by ann",
        "hint by bob",
        "hint rejected: no pose explains the sweep",
    ]


def test_ages_of_all_commands_are_kept_in_seconds() -> None:
    judge, ticks = referee(), Ticks()
    commands = [drive_command("ann", 0.1, age=SECOND // 4), drive_command("bob", 0.1)]
    judge.take(ticks.tick(inbox=commands))
    assert judge.command_ages == [0.25, 0.0]


def test_change_of_health_is_noted_once_with_its_first_reason() -> None:
    judge, ticks = referee(), Ticks()
    judge.take(ticks.tick(health=Health.WAITING, known=False))
    for _ in range(3):
        judge.take(ticks.tick())
    judge.take(ticks.tick(health=Health.LOST, reasons=("nothing fits", "at all")))
    assert texts(judge, EventKind.HEALTH) == ["tracking", "lost: nothing fits"]


def test_events_have_time_and_true_place() -> None:
    judge, ticks = referee(), Ticks()
    judge.take(ticks.tick(3.0, 4.0, guess=(0.0, 0.0, 0.0)))
    judge.note(EventKind.CLIENT, "ann <b>\x1b[2J left\n")
    # What a text holds is the reports' to escape; the referee keeps it as it is.
    client = Event(TICK_NS, EventKind.CLIENT, "ann <b>\x1b[2J left\n", 3.0, 4.0)
    assert judge.events[-1] == client


def test_event_before_the_first_tick_is_where_the_robot_starts() -> None:
    judge = Referee((), Limits(), (7.0, -2.0))
    judge.note(EventKind.FAULT, "struck at once")
    assert judge.events == [Event(0, EventKind.FAULT, "struck at once", 7.0, -2.0)]


def test_violations_are_counted_and_nothing_else_is() -> None:
    judge = referee()
    for kind in EventKind:
        judge.note(kind, "something")
    assert judge.violations == 1
    (check,) = judge.judged()[2]
    assert (check.name, check.value, check.met) == ("violations", 1.0, False)


def test_run_without_a_single_tick_is_judged_all_the_same() -> None:
    lines, figures, checks = Referee((NEAR,), Limits(position_max=1.0, nees=(0.0, 9.0))).judged()
    assert len(lines.stamps) == 0
    assert figures["duration"] == figures["distance"] == figures["lost"] == 0.0
    assert math.isnan(figures["position_max"])
    met = {check.name: check.met for check in checks}
    assert met == {"goals": False, "position_max": False, "nees": False, "violations": True}


def test_digest_follows_every_bit_of_truth_estimate_and_command() -> None:
    changes: list[dict[str, float | tuple[float, float, float]]] = [
        {},
        {"x": np.nextafter(1.0, 2.0)},
        {"guess": (np.nextafter(1.0, 2.0), 0.0, 0.0)},
        {"command": 1e-300},
        {"speed": 1e-300},
    ]
    digests = set()
    for change in changes:
        judge = referee()
        judge.take(Ticks().tick(**{"x": 1.0, "guess": (1.0, 0.0, 0.0), **change}))  # type: ignore[arg-type]
        digests.add(judge.log.sha256)
    assert len(digests) == len(changes)
