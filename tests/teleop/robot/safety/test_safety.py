"""Lease, deadman, watchdog, e-stop and speed limits, on a clock that is just a number."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import SECOND, Twist
from robot_sim import DriveConfig
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import DriveCommand, EStop, EStopReset
from teleop.robot.safety.control_state import ControlMode, SafetyConfig
from teleop.robot.safety.estop import estop_after
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.speed_limits import SpeedLimits
from tests.teleop.robot.sticks import wanted

TICK = SafetyConfig().tick

NEUTRAL, FORWARD, RELEASED = wanted(0.0), wanted(0.4, 0.1), wanted(0.4, 0.1, enabled=False)


def idle() -> Safety:
    return Safety(SpeedLimits.of(DriveConfig()))


def armed(client: str = "a") -> Safety:
    safety = idle()
    ask(safety, client, NEUTRAL, 0)
    return safety


def ask(safety: Safety, client: str, request: VelocityRequest, now: int) -> str | None:
    """Have a client's stick arrive at a time, in the tick of that time."""
    return safety.request(DriveCommand(client, request, arrival=now), now)


def moving(safety: Safety, now: int) -> bool:
    twist = safety.command(now)
    return bool(twist.linear.any() or twist.angular.any())


def test_nothing_moves_before_a_neutral_stick() -> None:
    safety = idle()
    assert ask(safety, "a", FORWARD, 0) == "send a neutral stick first"
    assert not moving(safety, 0)
    ask(safety, "a", NEUTRAL, 1)
    assert ask(safety, "a", FORWARD, 2) is None
    assert moving(safety, 2)


def test_released_deadman_stops_at_once_and_rearms() -> None:
    safety = armed()
    ask(safety, "a", FORWARD, 1)
    ask(safety, "a", RELEASED, 2)
    assert not moving(safety, 2)
    ask(safety, "a", FORWARD, 3)
    assert moving(safety, 3)


def test_silence_stops_the_robot_then_ends_the_lease() -> None:
    safety = armed()
    ask(safety, "a", FORWARD, 0)
    assert moving(safety, SECOND // 2 - TICK)
    assert not moving(safety, SECOND // 2 - TICK + 1), "the next tick would be too late"
    assert safety.state(SECOND).control is ControlMode.DISARMED
    assert "no command for" in safety.state(SECOND).reason
    assert safety.state(3 * SECOND).control is ControlMode.IDLE


def test_second_driver_waits_until_the_first_is_gone() -> None:
    safety = armed("a")
    assert "a drives" in (ask(safety, "b", NEUTRAL, 1) or "")
    safety.disconnected("a")
    assert ask(safety, "b", NEUTRAL, 2) is None
    assert safety.state(2).controller == "b"


def test_disconnect_of_a_bystander_changes_nothing() -> None:
    safety = armed("a")
    ask(safety, "a", FORWARD, 1)
    safety.disconnected("b")
    assert moving(safety, 2)


def test_estop_holds_through_disconnect_and_until_reset() -> None:
    safety = armed("a")
    ask(safety, "a", FORWARD, 1)
    safety.stop(EStop("b"))
    assert not moving(safety, 1)
    safety.disconnected("b")
    assert "e-stop by b" in (ask(safety, "a", FORWARD, 2) or "")
    safety.reset(EStopReset("a"))
    assert ask(safety, "a", FORWARD, 3) == "send a neutral stick first"


@pytest.mark.parametrize(("holder", "admin"), [("alice", False), ("bob", True)])
def test_estop_is_reset_by_its_owner_or_an_admin(holder: str, admin: bool) -> None:
    safety = armed()
    safety.stop(EStop("a", "alice"))
    safety.stop(EStop("b", "bob"))  # the first one stays its owner
    rejection = safety.reset(EStopReset("b", "bob"))
    assert rejection == "alice stopped the robot; only that token or an admin resets it"
    assert safety.state(1).control is ControlMode.ESTOP
    assert safety.reset(EStopReset("c", holder, admin)) is None
    assert safety.state(1).control is ControlMode.IDLE


def test_pending_messages_decide_who_may_reset_the_estop() -> None:
    stop, reset = EStop("a", "alice"), EStopReset("a", "alice")
    assert estop_after(None, [stop, EStop("b", "bob")]) is stop
    assert estop_after(None, [stop, EStopReset("b", "bob")]) is stop
    assert estop_after(stop, [reset]) is None
    assert estop_after(stop, [reset, EStop("b", "bob")]) == EStop("b", "bob")


def test_requests_beyond_the_limits_are_scaled_along_their_curve() -> None:
    safety = armed()
    ask(safety, "a", wanted(1.4, -1.0), 1)
    twist = safety.command(1)
    assert twist.linear[0] == pytest.approx(0.7)
    assert twist.angular[2] == pytest.approx(-0.5)
    ask(safety, "a", wanted(0.1, math.radians(280.0)), 2)
    twist = safety.command(2)
    assert twist.angular[2] == pytest.approx(math.radians(140.0))
    assert twist.linear[0] == pytest.approx(0.05)


@given(st.floats(allow_nan=False, allow_infinity=False), st.floats(-1e308, 1e308))
def test_no_request_exceeds_the_limits(forward: float, turn: float) -> None:
    limits = SpeedLimits.of(DriveConfig())
    twist = limits.limited(Twist.planar(forward, turn))
    assert abs(twist.linear[0]) <= limits.max_speed * (1.0 + 1e-12)
    assert abs(twist.angular[2]) <= limits.max_turn * (1.0 + 1e-12)


EVENTS = st.tuples(
    st.sampled_from(["neutral", "forward", "released", "gone", "take", "stop", "reset", "wait"]),
    st.sampled_from("ab"),
    st.integers(0, SECOND),
)


@given(st.lists(EVENTS, max_size=40))
def test_robot_moves_only_for_an_armed_driver_with_a_recent_command(
    events: list[tuple[str, str, int]],
) -> None:
    safety, now, last_forward = idle(), 0, {"a": -1, "b": -1}
    for kind, client, wait in events:
        now += wait
        match kind:
            case "neutral":
                ask(safety, client, NEUTRAL, now)
            case "forward":
                ask(safety, client, FORWARD, now)
                last_forward[client] = now
            case "released":
                ask(safety, client, RELEASED, now)
            case "gone":
                safety.disconnected(client)
            case "take":
                safety.take_over(client, now)
            case "stop":
                safety.stop(EStop(client))
            case "reset":
                safety.reset(EStopReset(client))
        state = safety.state(now)
        if moving(safety, now):
            assert state.control is ControlMode.ARMED
            assert now - last_forward[state.controller] <= safety.config.watchdog
        assert np.isfinite(state.twist.linear).all()


def test_reset_without_an_estop_leaves_the_robot_to_its_driver() -> None:
    safety = armed()
    assert safety.reset(EStopReset("b", admin=True)) is None
    state = safety.state(0)
    assert (state.control, state.controller) == (ControlMode.ARMED, "a")
