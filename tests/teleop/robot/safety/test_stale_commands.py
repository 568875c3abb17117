"""Commands that are old when they arrive: the robot slows down, then stops listening, unless these limits are off."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from localization.types import SECOND
from robot_sim import DriveConfig
from teleop.errors import SettingError
from teleop.robot.inbox import DriveCommand
from teleop.robot.safety.control_state import ControlMode, SafetyConfig
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.speed_limits import SpeedLimits
from teleop.robot.safety.stale_commands import StaleLimits
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.robot.sticks import stick

OFF = StaleLimits(0, 0)


def safety(stale: StaleLimits | None = None) -> Safety:
    return Safety(SpeedLimits.of(DriveConfig()), SafetyConfig(stale=stale or StaleLimits()))


def old(age: float, forward: float = 0.4) -> DriveCommand:
    return stick("a", forward, arrival=0, age=round(age * SECOND))


def speed(robot: Safety, now: int = 0) -> float:
    return float(robot.command(now).linear[0])


@pytest.mark.parametrize(("age", "share"), [(0.0, 1.0), (0.5, 1.0), (0.75, 0.5), (0.9, 0.2)])
def test_robot_drives_slower_the_older_the_commands(age: float, share: float) -> None:
    robot = safety()
    robot.request(old(age, 0.0), 0)
    assert robot.request(old(age), 0) is None
    assert speed(robot) == pytest.approx(0.4 * share)


def test_old_commands_do_not_arm_and_the_driver_learns_why() -> None:
    robot = safety()
    why = robot.request(old(3.0, 0.0), 0)
    assert why == (
        "commands arrive 3.0 s late, the way back to you included, and 1 s is the limit:"
        " release the stick, and wait for a faster link"
    )
    assert robot.state(0).control is ControlMode.DISARMED
    assert robot.request(old(3.0), 0) == why
    assert speed(robot) == 0.0
    assert robot.state(0).link_age == 3 * SECOND


def test_robot_stops_when_commands_become_old_and_must_be_armed_again() -> None:
    robot = safety()
    robot.request(old(0.1, 0.0), 0)
    robot.request(old(0.1), 0)
    assert "1.2 s late" in (robot.request(old(1.2), 0) or "")
    assert speed(robot) == 0.0
    assert robot.request(old(0.1), 0) == "send a neutral stick first"
    robot.request(old(0.1, 0.0), 0)
    assert robot.request(old(0.1), 0) is None
    assert speed(robot) == pytest.approx(0.4)


def test_limits_that_are_switched_off_let_any_age_drive() -> None:
    robot = safety(OFF)
    robot.request(old(10.0, 0.0), 0)
    assert robot.request(old(10.0), 0) is None
    assert speed(robot) == pytest.approx(0.4)
    assert robot.state(0).stale == OFF


@given(st.floats(0.0, 100.0), st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_share_of_speed_falls_with_age_and_ends_at_the_limit(
    age: float, slow: float, more: float
) -> None:
    limits = StaleLimits(round(slow * SECOND), round((slow + more) * SECOND))
    ages = [round(age * SECOND), round((age + 0.1) * SECOND)]
    shares = [limits.speed_share(a) for a in ages]
    assert 1.0 >= shares[0] >= shares[1] >= 0.0
    if limits.refuse and limits.slow:
        assert limits.speed_share(limits.refuse) in (0.0, 1.0)


@pytest.mark.parametrize(
    ("slow", "largest", "text"),
    [(-1.0, 1.0, "must be >= 0 s"), (2.0, 1.0, "cannot slow"), (float("nan"), 1.0, ">= 0 s")],
)
def test_contradictory_limits_are_refused(slow: float, largest: float, text: str) -> None:
    with pytest.raises(SettingError, match=text):
        ServeConfig(slow_age=slow, max_age=largest)
