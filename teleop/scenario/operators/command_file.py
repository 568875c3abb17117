"""Recorded commands: each operation that a client sent, with the robot's time; a line of JSON each.

A line is ``{"stamp": 1500000000, "operation": {"op": "publish", "topic": "/joy", "msg": {...}}}``, with the stamp in
[ns] from the start of the run and the operation as rosbridge has it. Tokens are never written.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from teleop.errors import SettingError

COMMANDS_FILE: Final = "commands.jsonl"
"""Name of the file in a run's folder."""

LARGEST_FILE: Final = 1_000_000_000
"""Largest file that is read [bytes]."""


@dataclass(frozen=True, slots=True)
class SentOperation:
    """An operation, and when it was sent."""

    stamp: int
    """Robot time [ns]."""
    operation: Mapping[str, Any]
    """The operation as it was sent, stamps of the client's clock included."""


class CommandRecorder:
    """Keeps what a client sends; the recorder of a ``Wire``."""

    def __init__(self) -> None:
        self.sent: list[SentOperation] = []
        """All operations so far, in their order."""

    def add(self, now: int, operation: Mapping[str, Any]) -> None:
        """Keep an operation that was sent at a robot time [ns], unless it shows a token."""
        if operation.get("op") != "auth":
            self.sent.append(SentOperation(now, operation))

    def save(self, path: Path) -> None:
        """Write all operations so far."""
        with path.open("w", encoding="utf-8") as file:
            for command in self.sent:
                file.write(json.dumps(asdict(command), separators=(",", ":")) + "\n")


def read_commands(path: Path) -> tuple[SentOperation, ...]:
    """Read what a recorder saved, or somebody else.

    Raises:
        SettingError: If it cannot be read, or a line is no command; the message names file and line.
    """
    try:
        if (size := path.stat().st_size) > LARGEST_FILE:
            raise SettingError(f"{path.name}: {size} bytes; at most {LARGEST_FILE} are read")
        lines = path.read_text(encoding="utf-8").split("\n")
    except OSError as error:
        raise SettingError(f"cannot read the commands in {path.name}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SettingError(f"{path.name} is not text in UTF-8") from None
    commands: list[SentOperation] = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            command = _command(line)
            if commands and command.stamp < commands[-1].stamp:
                raise ValueError("its stamp is before that of the line above it")
        except (ValueError, RecursionError) as error:
            raise SettingError(
                f"{path.name}, line {number}: {error}; a line is"
                ' {"stamp": 1500000000, "operation": {"op": "publish", "topic": "/joy", "msg": {}}}'
            ) from None
        commands.append(command)
    return tuple(commands)


def _command(line: str) -> SentOperation:
    value = json.loads(line)
    if not isinstance(value, dict) or set(value) != {"stamp", "operation"}:
        raise ValueError("needs 'stamp' and 'operation', and nothing else")
    stamp, operation = value["stamp"], value["operation"]
    if type(stamp) is not int or stamp < 0:
        raise ValueError("'stamp' must be a whole number of nanoseconds, at least 0")
    if not isinstance(operation, dict) or not isinstance(operation.get("op"), str):
        raise ValueError("'operation' must be an object with 'op'")
    if operation["op"] == "auth":
        raise ValueError("'auth' is not replayed: the run gives the token")
    return SentOperation(stamp, operation)
