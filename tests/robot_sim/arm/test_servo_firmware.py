"""The board's reader: one exact line moves it, and nothing else does."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings, strategies as st

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.servo_firmware import LONGEST, ServoFirmware, checked, checksum

TABLE = load_arm()
STANDING = (900, 850, 50, 900, 900, 0)
GOOD = checked("J 0.0 60.0 -90.0 0.0 -30.0 180.0")
WANTED = (900, 1050, 450, 900, 600, 1800)


def board(*, feedback: bool = True) -> ServoFirmware:
    firmware = ServoFirmware(TABLE, feedback=feedback)
    firmware.answer(STANDING)
    return firmware


def give(firmware: ServoFirmware, data: bytes, frames: int = 60) -> str:
    firmware.take(data, STANDING)
    for n in range(frames):
        firmware.frame()
        if n == 0:
            answer = firmware.answer(STANDING).decode()
    return answer


def test_the_checksum_is_that_of_crc_16_xmodem() -> None:
    assert checksum(b"123456789") == 0x31C3  # check value of the catalogue of CRC algorithms


def test_a_good_line_moves_the_servos_no_faster_than_the_arm_may_move() -> None:
    firmware = board()
    firmware.take(GOOD, STANDING)
    firmware.frame()
    assert firmware.written == (900, 890, 90, 900, 860, 40)  # 4 degrees in 20 ms
    give(firmware, b"")
    assert firmware.written == WANTED


def test_without_feedback_wires_the_first_line_is_taken_for_where_it_stands() -> None:
    firmware = board(feedback=False)
    assert give(firmware, b"") == ""
    assert give(firmware, GOOD, 1) == checked("W 0.0 60.0 -90.0 0.0 -30.0 180.0").decode()
    assert firmware.written == WANTED


def test_angles_of_the_feedback_wires_are_sent_in_each_frame() -> None:
    assert board().answer(STANDING) == checked("A 0.0 40.0 -130.0 0.0 0.0 0.0")


def test_a_restarted_board_says_so_once_on_a_line_of_its_own() -> None:
    firmware = ServoFirmware(TABLE)
    assert firmware.answer(STANDING).startswith(b"\n" + checked("R servos 6"))
    assert b"R" not in firmware.answer(STANDING)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"hello\n", "checksum"),
        (b"J\n", "form"),
        (b"\xff\xfe\x00\x80\x80\n", "checksum"),
        (GOOD[:-3] + b"0F\n", "checksum"),
        (GOOD.lower(), "checksum"),
        (GOOD.replace(b"\n", b"\r\n"), "checksum"),
        (b"J" * 1000 + b"\n", "length"),
        (checked("J"), "form"),
        (checked(""), "form"),
        (checked("J 0 60 -90 0 -30 180"), "form"),
        (checked("J 0.0 60.0 -90.0 0.0 -30.0"), "form"),
        (checked("J 0.0 60.0 -90.0 0.0 -30.0 180.0 0.0"), "form"),
        (checked("J 0.0  60.0 -90.0 0.0 -30.0 180.0"), "form"),
        (checked("J 0.0 60.0 -90.0 0.0 -30.0 180.0 "), "form"),
        (checked("J nan 60.0 -90.0 0.0 -30.0 180.0"), "form"),
        (checked("J 1e1 60.0 -90.0 0.0 -30.0 180.0"), "form"),
        (checked("J +0.0 60.0 -90.0 0.0 -30.0 180.0"), "form"),
        (checked("A 0.0 60.0 -90.0 0.0 -30.0 180.0"), "form"),
        (checked("J 0.0 135.1 -90.0 0.0 -30.0 180.0"), "range 2"),
        (checked("J 0.0 60.0 -90.0 0.0 -30.0 -0.1"), "range 6"),
        (checked("J 0.0 60.0 -90.0 0.0 999.9 180.0"), "range 5"),
    ],
)
def test_a_line_that_is_not_exact_is_refused_with_its_reason_and_moves_nothing(
    line: bytes, reason: str
) -> None:
    firmware = board()
    assert give(firmware, line).startswith(checked(f"E {reason} 1").decode())
    assert firmware.written is None
    give(firmware, GOOD)
    assert firmware.written == WANTED


def test_refused_lines_of_a_frame_are_answered_once_with_their_count() -> None:
    answer = give(board(), b"x y\n" * 500 + b"\n\n")
    assert answer.startswith(checked("E form 500").decode())
    assert answer.count("E ") == 1


def test_half_a_line_spoils_the_next_one_and_no_other() -> None:
    firmware = board()
    give(firmware, GOOD[:20])
    assert give(firmware, GOOD).startswith("E checksum 1*")
    assert firmware.written is None
    give(firmware, GOOD)
    assert firmware.written == WANTED


def test_lines_may_come_in_pieces_of_any_length() -> None:
    firmware = board()
    for n in range(len(GOOD)):
        firmware.take(GOOD[n : n + 1], STANDING)
    give(firmware, b"")
    assert firmware.written == WANTED


def test_no_lost_run_of_characters_and_no_changed_character_goes_unnoticed() -> None:
    for begin in range(len(GOOD) - 1):
        for end in range(begin + 1, len(GOOD)):
            firmware = board()
            firmware.take(GOOD[:begin] + GOOD[end:], STANDING)
            assert firmware.written is None, GOOD[:begin] + GOOD[end:]
    for at in range(len(GOOD) - 1):
        for byte in range(256):
            changed = GOOD[:at] + bytes([byte]) + GOOD[at + 1 :]
            firmware = board()
            firmware.take(changed, STANDING)
            assert (firmware.written is None) == (changed != GOOD), changed


@settings(max_examples=300)
@given(st.lists(st.binary(max_size=80), max_size=8), st.randoms(use_true_random=False))
def test_garbage_of_any_kind_moves_nothing(pieces: list[bytes], random_: random.Random) -> None:
    firmware = board()
    for piece in pieces:
        firmware.take(piece, STANDING)
        cut = random_.randrange(len(GOOD) - 1)
        firmware.take(GOOD[:cut] + b"\n", STANDING)
        assert len(firmware._line) <= LONGEST + 1
    firmware.frame()
    assert firmware.written is None
