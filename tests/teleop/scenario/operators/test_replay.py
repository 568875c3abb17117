"""Recorded commands are sent again as they were, at their times."""

from __future__ import annotations

from localization.types import SECOND
from teleop.scenario.operators.command_file import (
    CommandRecorder,
    SentOperation,
)
from teleop.scenario.operators.follower import Follower
from teleop.scenario.operators.operator import Briefing, GoalPlace
from teleop.scenario.operators.replay import Replay
from tests.teleop.scenario.operators.unicycle import Unicycle

GOAL = GoalPlace((3.0, 0.0), 0.3, way=((3.0, 0.0),))


def test_replayed_commands_come_at_the_same_times_with_the_same_stamps() -> None:
    robot, again, recorder = Unicycle(), Unicycle(), CommandRecorder()
    robot.seat(Follower(), Briefing((GOAL,), 0), recorder)
    robot.run(8.0)
    replay = Replay(recorder.sent)
    again.seat(replay, Briefing((), 0))
    again.run(8.0)
    assert replay.done
    assert again.commands == robot.commands
    assert again.stamps == robot.stamps
    assert again.x == robot.x


def test_commands_without_ends_are_done_at_once() -> None:
    replay = Replay(())
    robot = Unicycle()
    robot.seat(replay, Briefing((), 0))
    assert replay.done


def test_operations_of_any_kind_are_replayed() -> None:
    robot = Unicycle()
    call = {"op": "call_service", "service": "/localization/undo", "id": "x"}
    robot.seat(Replay([SentOperation(SECOND, call)]), Briefing((), 0))
    robot.run(0.9)
    assert robot.calls == []
    robot.run(0.2)
    assert robot.calls == ["/localization/undo"]
