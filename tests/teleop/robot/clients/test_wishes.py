"""What clients want, between its arrival and the tick that takes it."""

from __future__ import annotations

from teleop.robot.arm.arm_commands import ArmTwist, GripperGoal, JointJog
from teleop.robot.clients.wishes import Wishes
from teleop.robot.inbox import ArmWish, EStop, InboxMessage, TakeOver
from tests.teleop.robot.sticks import stick


def test_only_the_newest_command_of_each_client_waits() -> None:
    wishes = Wishes()
    old, other, new = stick("a", 0.1), stick("b", 0.2), stick("a", 0.3)
    for message in (old, other, new):
        wishes.post(message)
    assert wishes.take() == [other, new]
    assert wishes.take() == []


def test_repeated_estops_wait_once_and_order_is_kept() -> None:
    wishes = Wishes()
    for message in (EStop("a"), EStop("a"), TakeOver("b"), EStop("a")):
        assert wishes.post(message)
    assert wishes.take() == [EStop("a"), TakeOver("b"), EStop("a")]


def test_what_was_sent_is_outstanding_until_the_robot_has_taken_it() -> None:
    wishes = Wishes()
    messages: list[InboxMessage] = [EStop("a"), TakeOver("b"), EStop("c")]
    for message in messages[:2]:
        wishes.post(message)
    assert wishes.send() == messages[:2]
    wishes.post(messages[2])
    assert list(wishes.outstanding()) == messages
    wishes.taken(1)
    assert list(wishes.outstanding()) == messages[1:]
    wishes.send()
    wishes.taken(3)
    assert list(wishes.outstanding()) == [], "what the robot said of the second one was lost"


def test_number_of_waiting_messages_is_bounded() -> None:
    wishes = Wishes()
    accepted = sum(wishes.post(TakeOver(f"client {n}")) for n in range(5000))
    assert accepted == 1000
    assert not wishes.post(EStop("late"))


def test_of_each_clients_streams_to_the_arm_only_the_newest_of_each_kind_waits() -> None:
    wishes = Wishes()
    zeros = (0.0, 0.0, 0.0)
    old, new = (ArmWish("a", ArmTwist((x, 0.0, 0.0), zeros)) for x in (0.1, 0.2))
    jog, other = ArmWish("a", JointJog((0.1, *zeros, 0.0))), ArmWish("b", old.wish)
    goals = [ArmWish("a", GripperGoal(number, 0.0)) for number in (1, 2)]
    for message in (old, jog, goals[0], other, goals[1], new):
        wishes.post(message)
    assert wishes.take() == [jog, goals[0], other, goals[1], new]
