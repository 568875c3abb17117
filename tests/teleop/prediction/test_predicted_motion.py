"""Where the robot will be: by hand, and as the console's page says it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from teleop.prediction.predicted_motion import Command, DriveLimits, Motion, predicted

LIMITS = DriveLimits(0.5, 1.0, 2.0, 4.0, lag=0.04)
REST = Motion(0.0, 0.0, 0.0)


def end(commands: list[Command], until: float, known: Motion = REST, stamp: float = 0.0) -> Motion:
    *_, last = predicted(known, stamp, commands, until, LIMITS)
    return last


def test_robot_at_rest_speeds_up_once_its_wheels_answer() -> None:
    command = [Command(-1.0, 0.0, 0.0), Command(0.0, 0.4, 0.0)]
    assert end(command, 0.02) == REST
    # 0.8 s to 0.4 m/s, which are 0.16 m, and the rest at full speed; the wheels begin in the tick after the lag.
    moved = end(command, 2.02)
    assert (moved.x, moved.forward) == pytest.approx((0.16 + 0.4 * 1.2, 0.4), abs=0.005)


def test_robot_brakes_faster_than_it_speeds_up_and_rests_before_it_turns_round() -> None:
    moves = [Command(-2.0, 0.5, 0.0)]
    assert end([*moves, Command(0.0, 0.0, 0.0)], 2.0).x == pytest.approx(
        0.5**2 / 2 + 0.5 * 0.02, abs=0.001
    )
    back = [m.forward for m in predicted(REST, 0.0, [*moves, Command(0.0, -0.5, 0.0)], 2.0, LIMITS)]
    assert 0.0 in back
    assert back[-1] == pytest.approx(-0.5)


def test_robot_that_turns_as_it_drives_follows_a_circle() -> None:
    quarter = end([Command(-3.0, 0.5, 0.5)], math.pi)
    assert (quarter.x, quarter.y, quarter.yaw) == pytest.approx((1.0, 1.0, math.pi / 2), abs=0.01)


def test_speeds_at_the_known_pose_follow_from_the_commands_before_it() -> None:
    known = Motion(3.0, 4.0, math.pi / 2, forward=9.0)
    first, *_ = predicted(
        known, 0.0, [Command(-2.0, 0.0, 0.0), Command(-0.5, 0.5, 0.0)], 1.0, LIMITS
    )
    assert first.forward == pytest.approx(0.23, abs=0.011)
    assert (first.x, first.y) == (3.0, 4.0)


def test_page_and_display_say_the_same() -> None:
    """``predicted_motion.test.ts`` reads the same file."""
    file = Path(__file__).parent / "predictions.json"
    cases = json.loads(file.read_text(encoding="utf-8"))
    assert len(cases) >= 5
    for case in cases:
        commands = [Command(*command) for command in case["commands"]]
        limits = DriveLimits(**case["limits"])
        found = list(
            predicted(Motion(*case["known"]), case["stamp"], commands, case["until"], limits)
        )
        assert len(found) == case["count"]
        last = found[-1]
        assert [last.x, last.y, last.yaw, last.forward, last.turn] == pytest.approx(
            case["last"], abs=1e-9
        )
