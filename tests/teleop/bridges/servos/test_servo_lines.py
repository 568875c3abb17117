"""Lines between bridge and board."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.servo_firmware import ServoFirmware, checked
from teleop.bridges.servos.servo_lines import (
    LONGEST,
    Angles,
    LineReader,
    Refusal,
    Started,
    joint_line,
)

ROOT = Path(__file__).parents[4]
ANSWER = checked("A 0.0 40.0 -130.0 -0.5 0.0 180.0")
ANGLES = Angles((0.0, 40.0, -130.0, -0.5, 0.0, 180.0), measured=True)


def test_a_line_has_one_decimal_and_the_checksum_that_the_board_expects() -> None:
    line = joint_line([0.04, -0.04, -90.06, 12.34, 1e-9, 180.0])
    assert line == checked("J 0.0 0.0 -90.1 12.3 0.0 180.0")


@given(st.tuples(*(st.floats(low, low + 180.0) for low in (-90, -45, -135, -90, -90, 0))))
def test_every_pose_of_the_arm_is_a_line_that_the_board_takes(degrees: tuple[float, ...]) -> None:
    board = ServoFirmware(load_arm(), feedback=False)
    line = joint_line(degrees)
    assert len(line) <= LONGEST
    board.take(line, [])
    assert board.written is not None
    read = [(at + zero) / 10 for at, zero in zip(board.written, board.lower, strict=True)]
    assert read == pytest.approx(degrees, abs=0.0501)


@pytest.mark.parametrize(
    ("degrees", "message"),
    [
        ([0.0] * 5, "a board takes 6 angles"),
        ([0.0] * 7, "a board takes 6 angles"),
        ([0.0, float("nan"), 0.0, 0.0, 0.0, 0.0], "angle 2 is nan degrees"),
        ([0.0, 0.0, float("-inf"), 0.0, 0.0, 0.0], "angle 3 is -inf degrees"),
        ([0.0] * 5 + [1e9], r"angle 6 is 1e\+09 degrees"),
    ],
)
def test_what_are_no_six_angles_becomes_no_line(degrees: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        joint_line(degrees)


def test_answers_of_a_board_are_read() -> None:
    reader = LineReader()
    data = checked("R servos 6") + checked("E range 2 17") + checked("E checksum 3") + ANSWER
    assert reader.take(data + checked("W 0.0 0.0 0.0 0.0 0.0 0.0")) == [
        Started(6),
        Refusal("range 2", 17),
        Refusal("checksum", 3),
        ANGLES,
        Angles((0.0,) * 6, measured=False),
    ]
    assert reader.unreadable == 0


def test_board_that_restarts_within_a_line_is_read() -> None:
    reader = LineReader()
    begun = ServoFirmware(load_arm()).answer([0] * 6)
    assert reader.take(ANSWER[:12] + begun)[0] == Started(6)
    assert reader.unreadable == 1


@pytest.mark.parametrize(
    "line",
    [
        b"booting...\r\n",
        b"\xff\x00\xfe\n",
        ANSWER[:-4] + b"FFFF\n",
        ANSWER[7:],
        checked("A 1.0 2.0 3.0"),
        checked("A 1.0 2.0 3.0 4.0 5.0 6.0 7.0"),
        checked("A nan 2.0 3.0 4.0 5.0 6.0"),
        checked("J 1.0 2.0 3.0 4.0 5.0 6.0"),
        checked("E " + "x" * 80 + " 1"),
        b"A" * 100_000 + b"\n",
    ],
)
def test_what_is_no_answer_is_counted_and_the_next_one_is_read(line: bytes) -> None:
    reader = LineReader()
    assert reader.take(line + ANSWER) == [ANGLES]
    assert reader.unreadable == 1


@given(st.binary(max_size=300), st.integers(1, 40))
def test_answers_are_read_whatever_the_pieces_that_they_come_in(before: bytes, size: int) -> None:
    data = before + b"\n" + ANSWER + ANSWER[:9]
    reader, answers = LineReader(), []
    for begin in range(0, len(data), size):
        answers += reader.take(data[begin : begin + size])
    assert answers == [ANGLES]


def test_lines_in_the_documentation_are_lines() -> None:
    page = (ROOT / "docs/servos.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\| `([JAWER] [^`]*)` \|", page, re.MULTILINE)
    assert [line[0] for line in lines] == list("JAWER")
    board, reader = ServoFirmware(load_arm(), feedback=False), LineReader()
    board.take(f"{lines[0]}\n".encode(), [])
    assert board.written == (900, 1050, 450, 900, 600, 1800)
    assert len(reader.take("".join(f"{line}\n" for line in lines[1:]).encode())) == 4
