"""A second arm that follows lines of text, with the errors of its servos."""

from __future__ import annotations

import numpy as np
import pytest

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.servo import Resolution
from robot_sim.arm.servo_board import ServoBoard
from robot_sim.arm.servo_firmware import checked, decimal

TABLE = load_arm()
TICK = 20_000_000
READY = np.array(TABLE.poses["ready"])


def line(angles: np.ndarray, opening: float = 0.0) -> bytes:
    words = [decimal(round(10 * degrees)) for degrees in [*np.degrees(angles), opening]]
    return checked("J " + " ".join(words))


def run(board: ServoBoard, data: bytes, time: float) -> str:
    board.take(data)
    return board.advance(round(1e9 * time)).decode()


@pytest.mark.parametrize("resolution", ["degree", "microsecond"])
def test_it_takes_the_pose_within_rounding_dead_band_and_play(resolution: Resolution) -> None:
    board = ServoBoard(TABLE, resolution)
    run(board, line(READY, 90.0), 2.0)
    off = np.abs(np.degrees(board.angles - READY))
    rounding = 0.5 + 0.1 if resolution == "degree" else 0.05
    assert np.all(off <= rounding + np.array([0.485 + 0.3] * 3 + [0.97 + 0.5] * 2) + 1e-6)
    assert np.any(off > 0.2)
    assert board.opening == pytest.approx(TABLE.gripper.opening / 2)


def test_it_sends_what_its_potentiometers_read() -> None:
    board = ServoBoard(TABLE)
    last = run(board, line(READY), 2.0).splitlines()[-1]
    kind, *words = last.partition("*")[0].split()
    assert kind == "A"
    read = np.array([float(word) for word in words[:5]])
    # A step of the converter is 0.36 degrees.
    assert read == pytest.approx(np.degrees(board.servos.shafts), abs=0.37)


def test_a_step_of_the_pose_is_not_faster_than_the_arm_may_move() -> None:
    board = ServoBoard(TABLE, angles=np.zeros(5))
    run(board, line(np.zeros(5)), 1.0)
    before = board.angles.copy()
    board.take(line(np.full(5, 0.7)))
    for _ in range(20):
        board.advance(TICK)
        assert np.max(np.abs(board.angles - before)) <= TABLE.motion.speed * 0.02 + np.radians(0.6)
        before = board.angles.copy()


def test_first_motion_is_within_two_frames_and_the_time_of_a_line() -> None:
    board = ServoBoard(TABLE)
    run(board, line(board.angles), 0.999)
    before, time = board.angles.copy(), 0
    board.take(line(READY))
    while np.allclose(board.angles, before):
        board.advance(1_000_000)
        time += 1
    assert time <= 20 + 20 + 5


def test_characters_come_and_go_at_the_lines_rate() -> None:
    board = ServoBoard(TABLE)
    board.take(b"x" * 11_520)
    board.advance(500_000_000)
    assert board.waiting == pytest.approx(5760, abs=2)
    answers = ServoBoard(TABLE).advance(10**9)
    assert answers.count(b"*") == 50  # R and 49 angles; the last are on the way


def test_where_it_is_does_not_depend_on_how_its_time_is_cut() -> None:
    coarse, fine = ServoBoard(TABLE), ServoBoard(TABLE)
    for board in (coarse, fine):
        board.take(line(READY) + b"garbage\n" + line(READY, 30.0))
    sent = coarse.advance(500_000_000)
    assert b"".join(fine.advance(777_777) for _ in range(642)) + fine.advance(667_166) == sent
    assert np.array_equal(coarse.angles, fine.angles)


def test_a_flood_delays_no_frame_and_the_newest_line_wins() -> None:
    board, rate = ServoBoard(TABLE), 11_520 // len(line(READY, 10.0))
    for n in range(rate):
        board.take(line(READY, 90.0 if n == rate - 1 else 10.0))
    answers = board.advance(1_100_000_000)
    assert answers.count(b"A ") in (53, 54)
    board.advance(10**9)
    assert board.opening == pytest.approx(TABLE.gripper.opening / 2)


def test_a_restart_in_mid_line_leaves_the_arm_where_it_is_until_a_whole_line_comes() -> None:
    board = ServoBoard(TABLE)
    run(board, line(READY), 2.0)
    there = board.angles.copy()
    run(board, line(np.zeros(5))[:15], 0.5)
    board.reset()
    said = run(board, line(np.zeros(5))[15:], 0.5)
    assert "R servos 6" in said
    assert "E " in said
    assert np.array_equal(board.angles, there)
    run(board, line(READY), 1.0)
    assert board.angles == pytest.approx(there, abs=np.radians(0.7))


def test_silence_leaves_the_arm_where_it_is() -> None:
    board = ServoBoard(TABLE)
    run(board, line(READY), 2.0)
    there = board.angles.copy()
    board.advance(10 * 10**9)
    assert np.array_equal(board.angles, there)
