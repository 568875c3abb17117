"""What clients wanted survives its file to the bit, and a damaged file is refused in one line."""

from __future__ import annotations

import json
import math
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.types import Hint, Pose, Twist
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import ArmWish, DriveCommand, EStop, InboxMessage, PoseHint, TakeOver
from teleop.scenario.session.inbox_file import InboxFileError, InboxWriter, read_inboxes

NAMES = st.text() | st.sampled_from(['"}\n{', "\x1b[2J\x00", "<script>", "\u2028\u202e", "\ud800"])
INTEGERS = st.integers(-(2**70), 2**70)


def vectors(size: int, limit: float = 1e308) -> st.SearchStrategy[np.ndarray]:
    numbers = st.floats(-limit, limit)
    return st.lists(numbers, min_size=size, max_size=size).map(np.array)


def covariance(numbers: np.ndarray) -> np.ndarray:
    matrix = numbers.reshape(6, 6)
    np.fill_diagonal(matrix, np.abs(np.diag(matrix)))
    return matrix


QUATERNIONS = vectors(4, 1.0).filter(lambda q: float(q @ q) > 1e-3)
POSES = st.builds(Pose, vectors(3, 1e6), QUATERNIONS)
OF_TYPE: dict[Any, st.SearchStrategy[Any]] = {
    str: NAMES,
    int: INTEGERS,
    bool: st.booleans(),
    float: st.floats(allow_nan=False, allow_infinity=False),
    type(None): st.none(),
    Pose: POSES,
    Twist: st.builds(Twist, vectors(3), vectors(3)),
    Hint: st.builds(Hint, INTEGERS, POSES, vectors(36, 1e12).map(covariance)),
}


def values(of: Any) -> st.SearchStrategy[Any]:
    """Return a strategy of the values of a type."""
    if of in OF_TYPE:
        return OF_TYPE[of]
    if not (parts := get_args(of)):
        types = get_type_hints(of)
        return st.builds(of, **{field.name: values(types[field.name]) for field in fields(of)})
    if get_origin(of) is not tuple:
        return st.one_of([values(part) for part in parts])
    if parts[-1] is ...:
        return st.lists(values(parts[0]), max_size=3).map(tuple)
    return st.tuples(*map(values, parts))


MESSAGES: st.SearchStrategy[InboxMessage] = values(InboxMessage)


def same(one: object, other: object) -> bool:
    """Return whether two values are equal to the bit, and of the same types."""
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.tobytes() == other.tobytes()
    if is_dataclass(one):
        parts = [field.name for field in fields(one)]
        return type(one) is type(other) and all(
            same(getattr(one, part), getattr(other, part)) for part in parts
        )
    return type(one) is type(other) and one == other


def written(path: Path, *ticks: tuple[int, list[InboxMessage]]) -> Path:
    writer = InboxWriter(path)
    for number, inbox in ticks:
        writer.write(number, inbox)
    writer.close()
    return path


@settings(max_examples=40)
@given(st.lists(st.lists(MESSAGES, min_size=1, max_size=3), max_size=3))
def test_every_message_survives_writing_and_reading_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory, inboxes: list[list[InboxMessage]]
) -> None:
    path = tmp_path_factory.mktemp("run") / "inbox.jsonl"
    read = read_inboxes(written(path, *((3 * i, inbox) for i, inbox in enumerate(inboxes))))
    assert list(read) == [3 * i for i in range(len(inboxes))]
    for mine, others in zip(inboxes, read.values(), strict=True):
        assert len(mine) == len(others)
        assert all(map(same, mine, others))


def test_smallest_numbers_and_the_sign_of_zero_survive(tmp_path: Path) -> None:
    twist = Twist(np.array([5e-324, -0.0, math.nextafter(0.1, 1.0)]), np.array([-0.0, 1e308, 0.1]))
    command = DriveCommand("ann", VelocityRequest(twist, enabled=True))
    (read,) = read_inboxes(written(tmp_path / "inbox.jsonl", (0, [command])))[0]
    assert same(command, read)


def test_ticks_without_messages_take_no_line(tmp_path: Path) -> None:
    path = written(tmp_path / "inbox.jsonl", (0, []), (1, [TakeOver("ann")]), (2, []))
    assert len(path.read_text().splitlines()) == 1
    assert read_inboxes(path) == {1: [TakeOver("ann")]}


def test_names_cannot_break_out_of_their_line(tmp_path: Path) -> None:
    name = '"}]}\n{"tick":0,"messages":[]}\r\u2028\x1b[2J\x00'
    path = written(tmp_path / "inbox.jsonl", (0, [EStop(name)]))
    text = path.read_bytes()
    assert text.count(b"\n") == 1
    assert all(32 <= byte < 127 for byte in text[:-1])
    assert read_inboxes(path) == {0: [EStop(name)]}


def test_line_is_on_the_disk_before_the_file_is_closed(tmp_path: Path) -> None:
    writer = InboxWriter(tmp_path / "inbox.jsonl")
    writer.write(0, [TakeOver("ann")])
    assert read_inboxes(tmp_path / "inbox.jsonl") == {0: [TakeOver("ann")]}
    writer.close()


GOOD = '{"tick":0,"messages":[{"kind":"TakeOver","client":"ann"}]}\n'
TWIST = {"kind": "Twist", "linear": [0.1, 0, 0], "angular": [0, 0, 0]}
DRIVE = {
    "kind": "DriveCommand",
    "client": "ann",
    "request": {"kind": "VelocityRequest", "twist": TWIST, "enabled": True},
    "stamp": 0,
    "arrival": None,
    "age": 0,
    "stream": False,
    "rested": False,
}
POSE = {"kind": "Pose", "position": [0, 0, 0], "quaternion_wxyz": [1, 0, 0, 0]}
HINT = {"kind": "Hint", "stamp": 0, "map_from_base": POSE, "covariance": [[0] * 6] * 6}
HINTED = {"kind": "PoseHint", "client": "ann", "hint": HINT}
WISH = {
    "kind": "ArmWish",
    "client": "ann",
    "wish": {"kind": "Cancel", "number": 1},
    "arrival": None,
    "age": 0,
    "rested": False,
}


def driving(**twist: object) -> dict[str, object]:
    return {**DRIVE, "request": {**DRIVE["request"], "twist": {**TWIST, **twist}}}  # type: ignore[dict-item]


def line(*inbox: object, tick: object = 1) -> bytes:
    return json.dumps({"tick": tick, "messages": inbox}).encode()


DAMAGED: dict[str, bytes] = {
    "cut": GOOD[:-10].encode(),
    "cut in a name": GOOD.replace("ann", "zo\u00eb").encode()[:-7],
    "not utf-8": b'{"tick":1,"messages":["\xff\xfe"]}',
    "a picture": b"\x89PNG\r\n\x1a\n\x00\x00",
    "empty line": b"\n",
    "no object": b"[]",
    "a number": b"5",
    "null": b"null",
    "other keys": b'{"stamp":1,"op":"publish"}',
    "more keys": b'{"tick":1,"messages":[],"more":0}',
    "messages of text": b'{"tick":1,"messages":"TakeOver"}',
    "message of text": line("TakeOver"),
    "message of a number": line(5),
    "message of a list": line(["kind"]),
    "unknown kind": line({"kind": "Fly", "client": "ann"}),
    "no kind": line({"client": "ann"}),
    "kind of a list": line({"kind": ["TakeOver"], "client": "ann"}),
    "no client": line({"kind": "TakeOver"}),
    "unknown field": line({"kind": "TakeOver", "client": "ann", "x": 1}),
    "client of a number": line({"kind": "TakeOver", "client": 5}),
    "stamp of a text": line({**DRIVE, "stamp": "1"}),
    "stamp of a fraction": line({**DRIVE, "stamp": 1.5}),
    "stamp that is true": line({**DRIVE, "stamp": True}),
    "flag of a number": line({**DRIVE, "stream": 1}),
    "request of nothing": line({**DRIVE, "request": None}),
    "short vector": line(driving(linear=[0.1])),
    "vector of texts": line(driving(linear=["a"] * 3)),
    "vector of vectors of two lengths": line(driving(linear=[[1.0], [1.0, 2.0], [1.0]])),
    "vector too large": line(driving(linear=[10**400] * 3)),
    "vector that is a pose": line(driving(linear=POSE)),
    "request that is a twist": line({**DRIVE, "request": TWIST}),
    "message that is a pose": line(POSE),
    "short covariance": line({**HINTED, "hint": {**HINT, "covariance": [[0] * 6] * 5}}),
    "no quaternion": line(
        {**HINTED, "hint": {**HINT, "map_from_base": {**POSE, "quaternion_wxyz": [0] * 4}}}
    ),
    "wish of nothing": line({**WISH, "wish": None}),
    "wish of no kind": line({**WISH, "wish": {"number": 1}}),
    "wish that is a message": line({**WISH, "wish": {"kind": "TakeOver", "client": "ann"}}),
    "wish without a number": line({**WISH, "wish": {"kind": "Cancel"}}),
    "short motion": line({**WISH, "wish": {"kind": "JointJog", "rates": [0.0] * 4}}),
    "hint of nothing": line({**HINTED, "hint": {}}),
    "tick of a text": line(tick="1"),
    "tick again": line(tick=0),
    "tick before the first": line(tick=-1),
    "nested without end": b"[" * 100_000,
    "a number without end": b'{"tick":' + b"9" * 10_000 + b',"messages":[]}',
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_file_is_refused_with_its_line(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "inbox.jsonl"
    path.write_bytes(GOOD.encode() + DAMAGED[damage] + b"\n")
    with pytest.raises(InboxFileError) as error:
        read_inboxes(path)
    text = str(error.value)
    assert text.startswith(f"{path}:2: is damaged: ")
    assert "\n" not in text
    assert len(text) < len(str(path)) + 200


def test_undamaged_lines_of_these_tests_are_read(tmp_path: Path) -> None:
    path = tmp_path / "inbox.jsonl"
    path.write_bytes(GOOD.encode() + line(DRIVE, HINTED, WISH))
    inbox = read_inboxes(path)[1]
    assert [type(message) for message in inbox] == [DriveCommand, PoseHint, ArmWish]
