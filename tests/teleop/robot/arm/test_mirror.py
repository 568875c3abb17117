"""A second arm, compared with this one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.types import SECOND
from robot_sim.arm.servo_board import ServoBoard
from robot_sim.arm.servo_firmware import checked, decimal
from teleop.robot.arm.mirror import ArmMirror, MirrorState, explained
from teleop.robot.arm.mirror_delay import delay_of
from tests.teleop.robot.arm.support import TABLE

TICK = SECOND // 50


def hand(time: float) -> np.ndarray:
    """Return a smooth motion of all joints [rad]."""
    phases = 2 * np.pi * time * np.array([0.31, 0.23, 0.41, 0.37, 0.29]) + np.arange(5)
    return np.array(TABLE.poses["ready"]) + 0.4 * np.sin(phases)


def follow(
    mirror: ArmMirror,
    begin: float,
    end: float,
    delay: float = 0.0,
    off: np.ndarray | float = 0.0,
) -> MirrorState:
    for n in range(round(begin * 50), round(end * 50)):
        stamp = n * TICK
        mirror.moved(stamp, hand(stamp / SECOND))
        degrees = np.degrees(hand(stamp / SECOND - delay) + off)
        assert mirror.take(stamp, [*degrees, 90.0], source="bridge") == ""
    state = mirror.state(stamp)
    assert state is not None
    return state


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.06, 0.2, 0.41])
def test_the_delay_is_found_from_the_motion(delay: float) -> None:
    state = follow(ArmMirror(TABLE), 0.0, 4.0, delay)
    assert state.behind == pytest.approx(delay, abs=0.004)
    assert state.status == ("behind" if delay > 0.15 else "following")
    if delay == 0.2:
        assert state.reason == "the second arm follows 200 ms behind"


def test_the_error_is_that_against_the_arm_at_the_same_time() -> None:
    state = follow(ArmMirror(TABLE), 0.0, 3.0, 0.1)
    at = state.stamp / SECOND
    assert state.error == pytest.approx(hand(at - 0.1) - hand(at), abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 0.5), st.integers(0, 1000))
def test_rounding_and_constant_errors_hide_no_delay(delay: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    own_times, times = np.arange(0.0, 3.0, 0.02), np.arange(1.0, 3.0, 0.02) + rng.uniform(0, 0.02)
    times = times[times <= own_times[-1]]
    own = np.array([hand(t) for t in own_times])
    other = np.radians(np.rint(np.degrees([hand(t - delay) for t in times])))
    found = delay_of(own_times, own, times, other + rng.uniform(-0.02, 0.02, 5))
    assert found == pytest.approx(delay, abs=0.01)


def test_an_arm_at_rest_shows_no_delay() -> None:
    times = np.arange(0.0, 3.0, 0.02)
    still = np.tile(hand(0.0), (len(times), 1))
    noise = np.random.default_rng(1).normal(0.0, 0.005, still.shape)
    assert delay_of(times, still, times, still + noise) is None


def test_a_joint_that_is_off_is_named_after_half_a_second() -> None:
    mirror = ArmMirror(TABLE)
    assert follow(mirror, 0.0, 2.0).status == "following"
    off = np.array([0.0, 0.0, -0.12, 0.0, 0.0])
    assert follow(mirror, 2.0, 2.4, off=off).status == "following"
    state = follow(mirror, 2.4, 2.7, off=off)
    assert state.status == "off"
    assert state.reason == (
        "the second arm's elbow (arm_joint_3) is -6.9 deg off; its servos explain 2.5"
    )
    assert follow(mirror, 2.7, 3.0).status == "following"


def test_a_second_arm_that_falls_silent_is_lost_and_found_again() -> None:
    mirror = ArmMirror(TABLE)
    last = follow(mirror, 0.0, 2.0).stamp
    assert (state := mirror.state(last + 1_200_000_000)) is not None
    assert state.status == "lost"
    assert state.age == pytest.approx(1.2)
    assert state.reason.startswith("no angles of the second arm for 1.2 s")
    assert follow(mirror, 3.0, 3.1).status == "following"


def test_angles_that_are_no_angles_are_refused_with_the_field() -> None:
    mirror = ArmMirror(TABLE)
    for degrees in ([], [0.0] * 4, [0.0, 0.0, float("nan"), 0.0, 0.0], [float("inf")] * 6):
        assert mirror.take(0, degrees, source="a") == "data must be 5 finite angles or more [deg]"
    mirror.moved(0, hand(0.0))
    assert mirror.state(0) is None


def test_of_two_bridges_the_first_is_taken_until_it_falls_silent() -> None:
    mirror = ArmMirror(TABLE)
    mirror.moved(0, hand(0.0))
    angles = np.degrees(hand(0.0)).tolist()
    assert mirror.take(0, angles, source="first") == ""
    assert "first sends the angles" in mirror.take(TICK, [0.0] * 5, source="second")
    assert mirror.take(SECOND, [0.0] * 5, source="second") == ""


def test_angles_that_a_board_only_writes_are_said_to_be_so() -> None:
    mirror = ArmMirror(TABLE)
    mirror.moved(0, hand(0.0))
    mirror.take(0, np.degrees(hand(0.0)).tolist(), source="bridge", measured=False)
    assert (state := mirror.state(0)) is not None
    assert "as its board writes: its servos have no feedback wires" in state.reason


def test_what_servos_explain_is_their_rounding_dead_bands_and_play() -> None:
    # 0.96 degrees, twice 5 or 10 us of 10.31 us a degree, and 0.6 or 1 degree of play.
    large, small = 0.96 + 0.97 + 0.6, 0.96 + 1.94 + 1.0
    assert np.degrees(explained(TABLE)) == pytest.approx([large] * 3 + [small] * 2, abs=0.01)


def test_a_healthy_board_follows_a_hand_within_what_its_servos_explain() -> None:
    mirror, board = ArmMirror(TABLE), ServoBoard(TABLE)
    states = []
    for n in range(500):
        stamp, angles = n * TICK, hand(min(n * 0.02, 8.0))
        mirror.moved(stamp, angles)
        words = [decimal(round(10 * degrees)) for degrees in [*np.degrees(angles), 0.0]]
        board.take(checked("J " + " ".join(words)))
        for line in board.advance(TICK).decode().splitlines():
            if line.startswith("A"):
                back = [float(word) for word in line.partition("*")[0].split()[1:]]
                mirror.take(stamp, back, source="bridge")
        if (state := mirror.state(stamp)) is not None and n > 100:
            states.append(state)
    assert {state.status for state in states} == {"following"}
    assert 0.02 < states[-1].behind <= 0.06
    assert np.all(np.abs(states[-1].error) <= explained(TABLE))
