"""The clutch between a hand and the tip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.geometry import FloatArray, rotation_from_euler, so3_exp
from localization.types import SECOND, Pose
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.arm.hand import Clutch, Grip, heading
from teleop.robot.arm.reach import Target
from tests.teleop.robot.arm.support import READY_TIP as TIP

TICK = SECOND // 50
TURNED_MOUNT = Pose.from_euler((0.3, 0.0, 0.2), yaw=np.pi / 2)
"""The arm looks to the left of the vehicle."""


class Person:
    """A hand that is moved step by step; a clutch takes each sample."""

    def __init__(self, frame: str = "arm_base", mount: Pose | None = None) -> None:
        self.clutch = Clutch(mount or Pose.identity(), 0.02)
        self.hand = Hand(Pose.identity(), True, stamp=SECOND, frame=frame)
        self.place = np.zeros(3)
        self.turn = np.eye(3)

    def show(self, ticks: int = 1, **changes: object) -> Target | None:
        """Let a time pass and take a sample."""
        pose = Pose.from_rotation(self.place, self.turn)
        stamp = self.hand.stamp + ticks * TICK
        self.hand = replace(self.hand, **{"pose": pose, "stamp": stamp, **changes})  # type: ignore[arg-type]
        return self.clutch.take(self.hand, TIP)

    def reach(self, *way: float, turn: tuple[float, float, float] = (0, 0, 0)) -> Target:
        """Move in 50 ticks, and wait until the steady pose has come after."""
        target = None
        for tick in range(100):
            if tick < 50:
                self.place = self.place + np.array(way) / 50
                self.turn = so3_exp(np.array(turn) / 50) @ self.turn
            target = self.show()
        assert target is not None
        return target


def engaged() -> Person:
    """Return a person whose clutch has been closed for a sample."""
    person = Person()
    person.show()
    return person


def _moved(target: Target) -> FloatArray:
    return target.position - TIP[:3, 3]


@pytest.mark.parametrize("scale", [1.0, 0.25, 2.0])
def test_the_tip_is_wanted_as_far_on_as_the_hand_moved_times_the_scale(scale: float) -> None:
    person = Person()
    person.show(scale=scale)
    target = person.reach(0.1, 0.02, -0.05)
    np.testing.assert_allclose(_moved(target), scale * np.array([0.1, 0.02, -0.05]), atol=1e-4)


def test_the_gripper_turns_as_the_hand_does_whatever_the_scale() -> None:
    person = Person()
    person.show(scale=0.25)
    turn = (0.0, 0.3, -0.4)
    target = person.reach(0.0, 0.0, 0.0, turn=turn)
    np.testing.assert_allclose(target.pointing, so3_exp(turn) @ TIP[:3, 0], atol=1e-3)


def test_the_velocity_is_that_of_the_hand_times_the_scale() -> None:
    person = Person()
    person.show(scale=0.5)
    for _ in range(50):
        person.place = person.place + np.array([0.004, 0.0, 0.0])
        person.show()
    np.testing.assert_allclose(person.clutch.velocity[0], [0.1, 0.0, 0.0], atol=1e-6)


def test_a_hand_in_the_vehicles_frame_moves_the_tip_of_an_arm_that_looks_left() -> None:
    person = Person("base_link", TURNED_MOUNT)
    person.show()
    np.testing.assert_allclose(_moved(person.reach(0.0, 0.1, 0.0)), [0.1, 0.0, 0.0], atol=1e-4)


def test_ahead_in_an_operators_room_is_where_the_hand_points_first() -> None:
    person = Person("local-floor")
    person.turn = rotation_from_euler(0.2, 0.4, 2.0)
    person.show()
    ahead = np.array([np.cos(2.0), np.sin(2.0), 0.0])
    np.testing.assert_allclose(_moved(person.reach(*(0.1 * ahead))), [0.1, 0.0, 0.0], atol=1e-4)
    # Taken again with the hand turned, the room is still the same.
    person.show(engaged=False)
    person.turn = rotation_from_euler(0.0, 0.0, 1.0) @ person.turn
    person.show(engaged=True)
    np.testing.assert_allclose(_moved(person.reach(*(0.1 * ahead))), [0.1, 0.0, 0.0], atol=1e-4)
    # Another operator's is another.
    person.clutch.reset()
    person.turn = np.eye(3)
    person.show()
    np.testing.assert_allclose(_moved(person.reach(0.1, 0.0, 0.0)), [0.1, 0.0, 0.0], atol=1e-4)


@pytest.mark.parametrize("pitch", [-1.5, -0.5, 0.0, 0.5, 1.5])
def test_the_heading_of_a_hand_that_points_steeply_is_that_of_its_back(pitch: float) -> None:
    assert heading(rotation_from_euler(0.0, pitch, 0.7)) == pytest.approx(0.7)


def test_an_open_clutch_wants_nothing_and_closing_it_moves_nothing() -> None:
    person = engaged()
    person.reach(0.1, 0.0, 0.0)
    person.place = person.place + 0.5
    assert person.show(engaged=False) is None
    assert person.clutch.grip is Grip.OPEN
    target = person.show(engaged=True)
    assert target is not None
    np.testing.assert_array_equal(_moved(target), 0.0)


def test_a_hand_that_is_not_tracked_wants_nothing_and_goes_on_from_where_it_is_found() -> None:
    person = engaged()
    person.reach(0.05, 0.0, 0.0)
    assert person.show(tracked=False) is None
    assert person.clutch.grip is Grip.LOST
    person.place = person.place + np.array([0.73, 0.0, 0.0])
    assert person.show(tracked=False) is None
    target = person.show(tracked=True)
    assert target is not None
    np.testing.assert_array_equal(_moved(target), 0.0)
    np.testing.assert_allclose(_moved(person.reach(0.0, 0.1, 0.0)), [0.0, 0.1, 0.0], atol=1e-4)


@pytest.mark.parametrize("turned", [False, True])
def test_a_hand_that_jumps_opens_the_clutch_until_it_is_closed_again(turned: bool) -> None:
    person = engaged()
    if turned:
        person.turn = rotation_from_euler(0.0, 0.0, 3.0)
    else:
        person.place = person.place + np.array([0.0, 0.73, 0.0])
    for _ in range(3):
        assert person.show() is None
        assert person.clutch.grip is Grip.JUMPED
    assert person.clutch.jump == pytest.approx(0.0 if turned else 0.73)
    assert person.clutch.take(person.hand, TIP) is None
    person.show(engaged=False)
    assert person.show(engaged=True) is not None


def test_noise_between_two_samples_of_almost_one_time_is_no_jump() -> None:
    person = engaged()
    person.place = person.place + np.array([0.01, 0.0, 0.0])
    soon = replace(person.hand, pose=Pose.from_rotation(person.place, person.turn))
    assert person.clutch.take(replace(soon, stamp=soon.stamp + 1_000_000), TIP) is not None


@pytest.mark.parametrize("ticks", [10, -3])
def test_after_a_gap_or_a_step_back_of_its_clock_a_hand_begins_anew(ticks: int) -> None:
    person = engaged()
    person.place = person.place + np.array([0.05, 0.0, 0.0])
    target = person.show(ticks)
    assert target is not None
    np.testing.assert_array_equal(_moved(target), 0.0)


def test_a_new_scale_moves_nothing() -> None:
    person = engaged()
    person.reach(0.1, 0.0, 0.0)
    target = person.show(scale=0.25)
    assert target is not None
    np.testing.assert_array_equal(_moved(target), 0.0)


def test_a_sample_that_is_still_the_newest_wants_what_it_wanted() -> None:
    person = engaged()
    first = person.clutch.take(person.hand, TIP)
    assert person.clutch.take(person.hand, TIP) is first


def test_a_hand_without_stamps_is_timed_by_the_ticks() -> None:
    person = Person()
    for _ in range(60):
        person.place = person.place + np.array([0.004, 0.0, 0.0])
        assert person.show(stamp=0) is not None
    np.testing.assert_allclose(person.clutch.velocity[0], [0.2, 0.0, 0.0], atol=1e-6)
