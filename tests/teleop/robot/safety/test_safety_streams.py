"""Velocity streams without a deadman button: when they drive, and when they owe a zero first."""

from __future__ import annotations

import pytest

from localization.types import SECOND
from teleop.robot.inbox import DriveCommand, EStop, EStopReset
from teleop.robot.safety.arming import ZERO_FIRST, ZERO_OR_PAUSE
from teleop.robot.safety.control_state import ControlMode
from teleop.robot.safety.safety import Safety
from tests.teleop.robot.safety.test_safety import idle, moving
from tests.teleop.robot.sticks import stick

MS = SECOND // 1000


def twist(
    client: str = "a", forward: float = 0.4, *, at: int, rested: bool = False
) -> DriveCommand:
    return stick(client, forward, arrival=at, stream=True, rested=rested)


def say(robot: Safety, command: DriveCommand) -> str | None:
    assert command.arrival is not None
    return robot.request(command, command.arrival)


def test_stream_that_begins_with_motion_on_a_free_lease_drives() -> None:
    robot = idle()
    assert say(robot, twist(at=0)) is None
    assert moving(robot, 0)


def test_stream_owes_a_zero_after_an_estop_from_any_client() -> None:
    robot = idle()
    say(robot, twist(at=0))
    robot.stop(EStop("b"))
    robot.reset(EStopReset("b"))
    for client in ("a", "newcomer"):
        assert say(robot, twist(client, at=1)) == ZERO_FIRST
        assert not moving(robot, 1)
        assert say(robot, twist(client, 0.0, at=2)) is None
        assert say(robot, twist(client, at=3)) is None
        assert moving(robot, 3)
        robot.disconnected(client)


def test_both_sides_of_a_take_over_owe_a_zero() -> None:
    robot = idle()
    say(robot, twist("a", at=0))
    robot.take_over("b", 1)
    assert say(robot, twist("b", at=2)) == ZERO_FIRST
    say(robot, twist("b", 0.0, at=3))
    assert say(robot, twist("b", at=4)) is None
    robot.disconnected("b")
    assert say(robot, twist("a", at=5)) == ZERO_FIRST


@pytest.mark.parametrize("stall", [0.8, 3.0, 10.0])
def test_burst_behind_a_stall_never_drives(stall: float) -> None:
    """Nor does the stream that goes on behind it, until it has paused or sent a zero."""
    robot = idle()
    now = 0
    for _ in range(10):
        say(robot, twist(at=now))
        now += 100 * MS
    for tick in range(int(stall * 50)):
        robot.command(now + tick * 20 * MS)
    now += int(stall * SECOND)
    assert not moving(robot, now)
    for _ in range(20):  # all at once
        assert say(robot, twist(at=now)) == ZERO_OR_PAUSE
    for _ in range(30):
        now += 100 * MS
        assert say(robot, twist(at=now)) == ZERO_OR_PAUSE
        assert not moving(robot, now)
    assert say(robot, twist(forward=0.0, at=now)) is None
    assert say(robot, twist(at=now)) is None
    assert moving(robot, now)


def test_pause_over_a_working_link_lets_a_stopped_stream_drive_again() -> None:
    robot = idle()
    say(robot, twist(at=0))
    assert not moving(robot, SECOND)
    assert say(robot, twist(at=2 * SECOND, rested=True)) is None
    assert moving(robot, 2 * SECOND)


def test_stick_must_be_neutral_however_long_it_paused() -> None:
    robot = idle()
    assert robot.request(stick("a", 0.4, arrival=0, rested=True), 0) == "send a neutral stick first"


def test_all_clients_are_forgotten_when_the_server_is_lost() -> None:
    robot = idle()
    say(robot, twist(at=0))
    robot.server_lost("the server has ended")
    assert not moving(robot, 1)
    assert robot.state(1).control is ControlMode.IDLE
    assert robot.state(1).reason == "the server has ended"
    assert say(robot, twist("a", at=2)) is None, "another client may have this name now"


def test_estop_by_nobody_with_a_name_is_released_by_those_who_may_drive() -> None:
    robot = idle()
    robot.stop(EStop("visitor"))
    viewer = EStopReset("v", "viewer")
    assert robot.reset(viewer) == (
        "visitor stopped the robot; only an operator or an admin resets it"
    )
    assert robot.reset(EStopReset("d", "driver", operator=True)) is None
    robot.stop(EStop("a", "alice"))
    assert robot.reset(EStopReset("d", "driver", operator=True)) == (
        "alice stopped the robot; only that token or an admin resets it"
    )
