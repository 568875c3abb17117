"""Recorded commands are read as they were written, and a bad line is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop.errors import SettingError
from teleop.scenario.operators.command_file import (
    CommandRecorder,
    SentOperation,
    read_commands,
)

PUBLISH = {"op": "publish", "topic": "/joy", "msg": {"axes": [0.1, 1 / 3], "buttons": []}}
CALL = {"op": "call_service", "service": "/teleop/estop", "args": {}, "id": "call:1"}


def test_commands_are_read_as_they_were_sent(tmp_path: Path) -> None:
    recorder = CommandRecorder()
    recorder.add(0, PUBLISH)
    recorder.add(20_000_000, CALL)
    recorder.save(tmp_path / "commands.jsonl")
    found = read_commands(tmp_path / "commands.jsonl")
    assert found == (SentOperation(0, PUBLISH), SentOperation(20_000_000, CALL))


def test_tokens_are_not_recorded(tmp_path: Path) -> None:
    recorder = CommandRecorder()
    recorder.add(0, {"op": "auth", "token": "a secret"})
    recorder.save(tmp_path / "commands.jsonl")
    assert (tmp_path / "commands.jsonl").read_text() == ""


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("{", "line 2: Expecting"),
        ("[" * 100_000, "line 2"),
        ("[]", "line 2: needs 'stamp' and 'operation'"),
        ('{"stamp": 1, "operation": {"op": "publish"}, "x": 1}', "and nothing else"),
        ('{"stamp": 1.5, "operation": {"op": "publish"}}', "whole number of nanoseconds"),
        ('{"stamp": true, "operation": {"op": "publish"}}', "whole number of nanoseconds"),
        ('{"stamp": 1, "operation": {"topic": "/joy"}}', "an object with 'op'"),
        ('{"stamp": 1, "operation": {"op": "auth", "token": "x"}}', "not replayed"),
        ('{"stamp": 0, "operation": {"op": "publish"}}', "before that of the line above"),
    ],
)
def test_bad_line_is_named(tmp_path: Path, line: str, text: str) -> None:
    file = tmp_path / "commands.jsonl"
    file.write_text('{"stamp": 1, "operation": {"op": "publish"}}\n' + line + "\n")
    with pytest.raises(SettingError, match=text) as error:
        read_commands(file)
    assert "commands.jsonl" in str(error.value)
    assert "\n" not in str(error.value)


def test_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        SettingError, match=r"cannot read the commands in gone\.jsonl: No such file"
    ):
        read_commands(tmp_path / "gone.jsonl")


def test_file_that_is_no_text_is_named(tmp_path: Path) -> None:
    (tmp_path / "commands.jsonl").write_bytes(b"\xff\xfe")
    with pytest.raises(SettingError, match="not text"):
        read_commands(tmp_path / "commands.jsonl")
