"""Hobby servos, by what their sheets and Arduino's library say of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.servo import Resolution, ServoBank

TABLE = load_arm()
FRAME = TABLE.pulses.frame
STRAIGHT = np.zeros(5)


def run(bank: ServoBank, wanted: np.ndarray, frames: int) -> np.ndarray:
    for _ in range(frames):
        bank.command(wanted)
        aims = bank.turn(FRAME)
    return aims


def test_ends_and_middle_of_the_range_have_the_pulses_of_arduinos_servo_library() -> None:
    for resolution in ("microsecond", "degree"):
        bank = ServoBank(TABLE, resolution)
        middle = (np.array(TABLE.lower) + TABLE.upper) / 2
        assert list(bank.widths(TABLE.lower)) == [544] * 5
        assert list(bank.widths(middle)) == [1472] * 5
        assert list(bank.widths(TABLE.upper)) == [2400] * 5


@pytest.mark.parametrize("degree", [0, 1, 7, 89, 91, 133, 179, 180])
def test_a_whole_degree_becomes_the_pulse_that_servo_write_makes_of_it(degree: int) -> None:
    # map(value, 0, 180, 544, 2400) of Arduino's core, on long integers.
    expected = degree * (2400 - 544) // 180 + 544
    bank = ServoBank(TABLE, "degree")
    for off in (-0.4, 0.0, 0.4):
        wanted = np.array(TABLE.lower) + math.radians(degree + off)
        assert list(bank.widths(wanted)) == [expected] * 5


def test_what_is_beyond_a_limit_gets_the_limits_pulse() -> None:
    bank = ServoBank(TABLE)
    assert list(bank.widths(np.array(TABLE.upper) + 1.0)) == [2400] * 5
    assert list(bank.widths(np.array(TABLE.lower) - 1.0)) == [544] * 5


@pytest.mark.parametrize(("resolution", "floor"), [("degree", 3.3e-3), ("microsecond", 0.32e-3)])
def test_rounding_alone_moves_an_outstretched_tip_by_the_known_floor(
    resolution: Resolution, floor: float
) -> None:
    # 3.3 mm and 0.32 mm rms: each angle is off by an equal share of a degree or of 1/10.3 of it, with the levers 0.41,
    # 0.41, 0.27 and 0.14 m; Servo.write's cut microseconds are 5 % of it.
    bank, rng = ServoBank(TABLE, resolution), np.random.default_rng(3)
    tip, squares = Kinematics(TABLE).tip, []
    for _ in range(2000):
        wanted = rng.uniform(-math.radians(1.0), math.radians(1.0), 5)
        given = bank.angles(bank.widths(wanted))
        squares.append(np.sum((tip(given) - tip(wanted))[:3, 3] ** 2))
    assert math.sqrt(np.mean(squares)) == pytest.approx(floor, rel=0.08)


def test_a_step_is_turned_at_the_sheets_speed_and_not_faster() -> None:
    bank = ServoBank(TABLE, angles=STRAIGHT)
    wanted = np.full(5, math.radians(40.0))
    bank.command(wanted)
    bank.turn(0.05)
    # 353 and 500 deg/s: 0.17 s and 0.12 s for 60 degrees, of the MG995's and the SG90's sheets.
    assert np.degrees(bank.shafts) == pytest.approx([17.65] * 3 + [25.0] * 2, abs=1e-9)


def test_a_servo_stops_within_its_dead_band_and_its_play() -> None:
    bank = ServoBank(TABLE, angles=STRAIGHT)
    wanted = np.full(5, math.radians(20.0))
    aims = run(bank, wanted, 20)
    # 5 us of 10.31 us a degree, and 10 us; play 0.6 and 1 degree from stop to stop.
    short = np.degrees(wanted - bank.shafts)
    assert short[:3] == pytest.approx([0.485] * 3, abs=0.05)
    assert short[3:] == pytest.approx([0.97] * 2, abs=0.05)
    assert np.degrees(bank.shafts - aims) == pytest.approx([0.3, 0.3, 0.3, 0.5, 0.5], abs=1e-9)


def test_a_reversal_is_followed_only_beyond_dead_band_and_play_and_going_on_at_once() -> None:
    bank = ServoBank(TABLE, angles=STRAIGHT)
    there = run(bank, np.full(5, math.radians(20.0)), 20).copy()
    further = run(bank, np.full(5, math.radians(20.5)), 5).copy()
    assert np.degrees(further - there) == pytest.approx([0.5] * 5, abs=0.1)
    # Twice 0.485 and 0.6 degrees for the large ones, twice 0.97 and 1 for the small ones.
    back = run(bank, np.full(5, math.radians(19.1)), 5)
    assert back == pytest.approx(further, abs=1e-12)
    back = run(bank, np.full(5, math.radians(18.5)), 5)
    assert np.degrees(further - back)[:3] == pytest.approx([2.0 - 1.57] * 3, abs=0.1)
    assert back[3:] == pytest.approx(further[3:], abs=1e-12)


def test_where_a_servo_rests_does_not_depend_on_the_length_of_its_steps() -> None:
    wanted = np.array(TABLE.poses["ready"])
    coarse, fine = ServoBank(TABLE), ServoBank(TABLE)
    run(coarse, wanted, 50)
    for _ in range(50):
        fine.command(wanted)
        for _ in range(5):
            fine.turn(FRAME / 5)
    assert fine.aims == pytest.approx(coarse.aims, abs=1e-12)


def test_an_arm_that_shall_stay_where_it_stands_does_not_move() -> None:
    for resolution in ("microsecond", "degree"):
        bank = ServoBank(TABLE, resolution)
        before = bank.aims.copy()
        assert run(bank, before, 10) == pytest.approx(before, abs=1e-15)
