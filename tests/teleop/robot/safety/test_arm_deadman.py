"""Lease, clutch, watchdog, stale limits and e-stop of the arm, apart from those of the wheels."""

from __future__ import annotations

import pytest

from localization.types import SECOND, Pose
from teleop.robot.arm.arm_commands import ArmTwist, Hand, JointJog, Stream, TipTarget
from teleop.robot.inbox import ArmWish, Ask, DriveCommand, EStop, EStopReset, Give
from teleop.robot.safety.arm_deadman import OPEN_FIRST, ZERO_OR_PAUSE
from teleop.robot.safety.control_state import ControlMode
from teleop.robot.safety.safety import Safety
from tests.teleop.robot.safety.test_safety import FORWARD, NEUTRAL, TICK, idle

CLOSED, OPEN = Hand(Pose.identity(), engaged=True), Hand(Pose.identity(), engaged=False)
JOG, REST = JointJog((0.1, 0.0, 0.0, 0.0, 0.0)), JointJog((0.0,) * 5)


def ask(
    safety: Safety,
    stream: Stream,
    now: int,
    client: str = "a",
    *,
    age: int = 0,
    rested: bool = False,
) -> str | None:
    """Have a client's command to the arm arrive at a time, in the tick of that time."""
    message = ArmWish(client, stream, arrival=now, age=age, rested=rested)
    return safety.request_arm(message, stream, now)


def engaged(client: str = "a") -> Safety:
    safety = idle()
    ask(safety, OPEN, 0, client)
    assert ask(safety, CLOSED, 0, client) is None
    return safety


def in_force(safety: Safety, now: int) -> bool:
    safety.expire(now)
    return safety.arm.engaged


def test_hand_moves_the_arm_only_after_its_clutch_was_open() -> None:
    safety = idle()
    assert ask(safety, CLOSED, 0) == OPEN_FIRST
    assert not in_force(safety, 0)
    ask(safety, OPEN, 1)
    assert ask(safety, CLOSED, 2) is None
    assert in_force(safety, 2)


@pytest.mark.parametrize(
    "stream", [JOG, ArmTwist((0.1, 0.0, 0.0), (0.0, 0.0, 0.0)), TipTarget(Pose.identity())]
)
def test_streams_without_a_clutch_move_the_arm_at_once(stream: Stream) -> None:
    safety = idle()
    assert ask(safety, stream, 0) is None
    assert in_force(safety, 0)


def test_silence_stops_the_arm_until_the_clutch_is_closed_again() -> None:
    safety = engaged()
    assert in_force(safety, SECOND // 2 - TICK)
    assert not in_force(safety, SECOND // 2 - TICK + 1), "the next tick would be too late"
    assert "no command to the arm for" in safety.arm.reason
    assert ask(safety, CLOSED, SECOND) == OPEN_FIRST
    ask(safety, OPEN, SECOND)
    assert ask(safety, CLOSED, SECOND) is None


def test_stream_that_fell_silent_owes_a_zero_or_a_pause() -> None:
    safety = idle()
    ask(safety, JOG, 0)
    assert ask(safety, JOG, SECOND) == ZERO_OR_PAUSE
    assert ask(safety, JOG, 3 * SECOND, rested=True) is None
    assert ask(safety, JOG, 4 * SECOND) == ZERO_OR_PAUSE
    ask(safety, REST, 4 * SECOND)
    assert ask(safety, JOG, 4 * SECOND) is None


def test_arm_and_wheels_share_the_lease_but_not_the_watchdog() -> None:
    safety = idle()
    safety.request(DriveCommand("a", NEUTRAL, arrival=0), 0)
    safety.request(DriveCommand("a", FORWARD, arrival=0), 0)
    for now in range(0, 4 * SECOND, SECOND // 10):
        ask(safety, OPEN if now == 0 else CLOSED, now)
    later = 4 * SECOND - SECOND // 10
    assert in_force(safety, later)
    assert not safety.command(later).linear.any(), "commands to the arm drive no wheel"
    assert safety.state(later).controller == "a", "and keep the lease"
    assert safety.state(later).control is ControlMode.DISARMED
    assert safety.state(later + 3 * SECOND).controller == ""


def test_wheels_keep_no_arm_in_force() -> None:
    safety = engaged()
    for now in range(0, SECOND, SECOND // 10):
        safety.request(DriveCommand("a", NEUTRAL, arrival=now), now)
    assert not in_force(safety, SECOND)
    assert safety.state(SECOND).control is ControlMode.ARMED


@pytest.mark.parametrize("stream", [CLOSED, JOG])
def test_who_has_no_lease_is_refused_and_an_open_clutch_is_not(stream: Stream) -> None:
    safety = engaged("a")
    assert ask(safety, stream, 1, "b") == "a drives; call /teleop/take_over"
    assert ask(safety, OPEN, 1, "b") is None
    assert in_force(safety, 1)


def test_take_over_stops_the_arm_and_both_must_begin_anew() -> None:
    safety = engaged("a")
    ask(safety, OPEN, 1, "b")
    ask(safety, CLOSED, 1, "b")
    safety.take_over("b", 2)
    assert not in_force(safety, 2)
    assert ask(safety, CLOSED, 3, "b") == OPEN_FIRST
    ask(safety, OPEN, 4, "b")
    assert ask(safety, CLOSED, 5, "b") is None


def test_refused_stream_of_the_winner_owes_a_zero_after_a_take_over() -> None:
    safety = engaged("a")
    ask(safety, JOG, 1, "b")
    safety.take_over("b", 2)
    assert ask(safety, JOG, 3, "b") == ZERO_OR_PAUSE


def test_giving_the_robot_away_stops_the_arm() -> None:
    safety = engaged("a")
    safety.ask(Ask("b", 1), 1)
    assert safety.give(Give("a"), 2) is None
    assert not in_force(safety, 2)


def test_estop_stops_the_arm_and_refuses_it_until_it_is_reset() -> None:
    safety = engaged()
    safety.stop(EStop("b"))
    assert not in_force(safety, 1)
    assert "e-stop by b is latched" in str(ask(safety, CLOSED, 2))
    assert ask(safety, OPEN, 2) is None
    safety.reset(EStopReset("b"))
    assert ask(safety, CLOSED, 3) == OPEN_FIRST, "opening it under the e-stop shows nothing"


def test_late_commands_stop_the_arm() -> None:
    safety = engaged()
    assert "late" in str(ask(safety, CLOSED, 1, age=2 * SECOND))
    assert not in_force(safety, 1)
    assert ask(safety, CLOSED, 2) == OPEN_FIRST


def test_goal_takes_the_free_lease_and_is_refused_to_others() -> None:
    safety = idle()
    assert safety.admit_arm_goal("a", 0, 0) is None
    assert "a drives" in str(safety.admit_arm_goal("b", 0, 1))
    safety.arm_alive("a", SECOND, SECOND)
    assert safety.state(2 * SECOND).controller == "a"
    safety.arm_alive("b", 3 * SECOND, 3 * SECOND)
    assert safety.state(4 * SECOND).controller == "", "another one's life keeps no lease"


def test_server_that_is_lost_takes_all_clutches_with_it() -> None:
    safety = engaged()
    safety.server_lost("the server has ended")
    assert not in_force(safety, 1)
    assert ask(safety, CLOSED, 2) == OPEN_FIRST


def test_stream_at_rest_ends_no_other_kind_of_command() -> None:
    safety = engaged()
    ask(safety, REST, 1)
    assert in_force(safety, 1)
    ask(safety, OPEN, 2)
    assert not in_force(safety, 2)


def test_zero_of_a_stream_opens_no_clutch() -> None:
    safety = idle()
    ask(safety, REST, 0)
    assert ask(safety, CLOSED, 1) == OPEN_FIRST


def test_sign_of_life_for_a_goal_keeps_no_command_in_force() -> None:
    safety = engaged()
    for now in range(0, SECOND, SECOND // 10):
        safety.arm_alive("a", now, now)
    assert not in_force(safety, SECOND)
    assert safety.state(SECOND).controller == "a"
