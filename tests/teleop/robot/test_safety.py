"""Lease, deadman, watchdog and e-stop, on a clock that is just a number."""

from __future__ import annotations

import numpy as np
from hypothesis import given, strategies as st

from localization.types import SECOND, Twist
from teleop.joystick import VelocityRequest
from teleop.robot.safety import ControlMode, Safety

NEUTRAL = VelocityRequest(Twist.planar(0.0, 0.0), enabled=True)
FORWARD = VelocityRequest(Twist.planar(0.4, 0.1), enabled=True)
RELEASED = VelocityRequest(Twist.planar(0.4, 0.1), enabled=False)


def armed(client: str = "a") -> Safety:
    safety = Safety()
    safety.request(client, NEUTRAL, 0)
    return safety


def moving(safety: Safety, now: int) -> bool:
    twist = safety.command(now)
    return bool(twist.linear.any() or twist.angular.any())


def test_nothing_moves_before_a_neutral_stick_was_seen() -> None:
    safety = Safety()
    assert safety.request("a", FORWARD, 0) == "show a neutral stick first"
    assert not moving(safety, 0)
    safety.request("a", NEUTRAL, 1)
    assert safety.request("a", FORWARD, 2) is None
    assert moving(safety, 2)


def test_released_deadman_stops_at_once_and_rearms() -> None:
    safety = armed()
    safety.request("a", FORWARD, 1)
    safety.request("a", RELEASED, 2)
    assert not moving(safety, 2)
    safety.request("a", FORWARD, 3)
    assert moving(safety, 3)


def test_silence_stops_after_the_watchdog_and_costs_the_lease_later() -> None:
    safety = armed()
    safety.request("a", FORWARD, 0)
    assert moving(safety, SECOND // 2)
    assert not moving(safety, SECOND // 2 + 1)
    assert safety.state(SECOND).control is ControlMode.DISARMED
    assert "no command for" in safety.state(SECOND).reason
    assert safety.state(3 * SECOND).control is ControlMode.IDLE


def test_second_driver_waits_until_the_first_is_gone() -> None:
    safety = armed("a")
    assert "a drives" in (safety.request("b", NEUTRAL, 1) or "")
    safety.disconnected("a")
    assert safety.request("b", NEUTRAL, 2) is None
    assert safety.state(2).controller == "b"


def test_disconnect_of_a_bystander_changes_nothing() -> None:
    safety = armed("a")
    safety.request("a", FORWARD, 1)
    safety.disconnected("b")
    assert moving(safety, 2)


def test_take_over_stops_the_robot_and_asks_the_new_driver_to_rearm() -> None:
    safety = armed("a")
    safety.request("a", FORWARD, 1)
    safety.take_over("b", 2)
    assert not moving(safety, 2)
    assert safety.request("b", FORWARD, 3) == "show a neutral stick first"
    assert "b drives" in (safety.request("a", FORWARD, 3) or "")


def test_estop_holds_through_disconnect_and_until_reset() -> None:
    safety = armed("a")
    safety.request("a", FORWARD, 1)
    safety.stop("b")
    assert not moving(safety, 1)
    safety.disconnected("b")
    assert "e-stop by b" in (safety.request("a", FORWARD, 2) or "")
    safety.reset("a")
    assert safety.request("a", FORWARD, 3) == "show a neutral stick first"


def test_wishes_beyond_the_limits_are_cut() -> None:
    safety = armed()
    safety.request("a", VelocityRequest(Twist.planar(1e308, -1e308), enabled=True), 1)
    twist = safety.command(1)
    assert twist.linear[0] == safety.config.max_speed
    assert twist.angular[2] == -safety.config.max_turn


EVENTS = st.tuples(
    st.sampled_from(["neutral", "forward", "released", "gone", "take", "stop", "reset", "wait"]),
    st.sampled_from("ab"),
    st.integers(0, SECOND),
)


@given(st.lists(EVENTS, max_size=40))
def test_robot_moves_only_for_an_armed_driver_whose_word_is_fresh(
    events: list[tuple[str, str, int]],
) -> None:
    safety, now, last_forward = Safety(), 0, {"a": -1, "b": -1}
    for kind, client, wait in events:
        now += wait
        match kind:
            case "neutral":
                safety.request(client, NEUTRAL, now)
            case "forward":
                safety.request(client, FORWARD, now)
                last_forward[client] = now
            case "released":
                safety.request(client, RELEASED, now)
            case "gone":
                safety.disconnected(client)
            case "take":
                safety.take_over(client, now)
            case "stop":
                safety.stop(client)
            case "reset":
                safety.reset(client)
        state = safety.state(now)
        if moving(safety, now):
            assert state.control is ControlMode.ARMED
            assert now - last_forward[state.controller] <= safety.config.watchdog
        assert np.isfinite(state.twist.linear).all()
