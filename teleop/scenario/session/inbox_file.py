"""What clients wanted of the robot, tick by tick, as lines of JSON: enough to repeat a run to the bit.

A message is an object of its fields, beside the name of its class, ``kind``; so is each value in it that is no number,
text or list.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, Final, TextIO, get_args, get_type_hints

import msgspec
import numpy as np

from localization.geometry import FloatArray
from localization.types import Hint, Pose, Twist
from teleop.errors import TeleopError
from teleop.joystick import VelocityRequest
from teleop.robot.arm.arm_commands import Wish
from teleop.robot.inbox import InboxMessage

_WISHES: Final = [kind for part in get_args(Wish) for kind in (get_args(part) or (part,))]
_PARTS: Final = (VelocityRequest, Twist, Hint, Pose)
_KINDS: Final[Mapping[str, Any]] = {
    kind.__name__: kind for kind in (*get_args(InboxMessage), *_WISHES, *_PARTS)
}
"""Classes of all messages and of what they hold, by name."""


class InboxFileError(TeleopError):
    """The file of a run's messages is damaged; the message names file and line."""


class InboxWriter:
    """Writes the messages of each tick that has any: one line a tick."""

    def __init__(self, path: Path) -> None:
        self._file: TextIO = path.open("w", encoding="utf-8")

    def write(self, number: int, messages: Sequence[InboxMessage]) -> None:
        """Write the messages of a tick.

        Args:
            number: Number of the tick, from 0.
            messages: Its messages, in order.
        """
        if messages:
            line = {"tick": number, "messages": messages}
            self._file.write(json.dumps(line, separators=(",", ":"), default=_plain) + "\n")
            # What has been recorded is on the disk, whatever happens to the process.
            self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _plain(value: Any) -> Any:
    """Return a value that JSON does not know as one that it does."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    kind: Any = type(value)
    return {"kind": kind.__name__} | {name: getattr(value, name) for name in _types(kind)}


def read_inboxes(path: Path) -> dict[int, list[InboxMessage]]:
    """Return the messages of each tick that has any.

    Raises:
        InboxFileError: If the file is damaged.
    """
    inboxes: dict[int, list[InboxMessage]] = {}
    last = -1
    with path.open("rb") as file:
        for number, text in enumerate(file, 1):
            try:
                tick, messages = _tick(json.loads(text))
                if tick <= last:
                    raise ValueError(f"tick {tick} after tick {last}")
                inboxes[tick], last = messages, tick
            except (ValueError, OverflowError, RecursionError) as error:
                raise InboxFileError(f"{path}:{number}: is damaged: {error}") from None
    return inboxes


def _tick(line: Any) -> tuple[int, list[InboxMessage]]:
    """Return number and messages of a tick; raise ValueError for anything else."""
    match line:
        case {"tick": int(tick), "messages": [*messages], **more} if not more:
            return tick, [_value("a message", InboxMessage, each) for each in messages]
    raise ValueError("not the messages of a tick")


def _value(name: str, wanted: Any, value: Any) -> Any:
    """Return the value of a type; raise ValueError if it is of another."""
    try:
        if wanted == FloatArray:
            return np.array(msgspec.convert(value, list[float | list[float]]), dtype=float)
        if not isinstance(value, dict):
            return msgspec.convert(value, wanted)
    except msgspec.ValidationError as error:
        raise ValueError(f"{name}: {error}") from None
    except TypeError:  # one of several classes is wanted
        raise ValueError(f"{name} must be an object, got {value!r:.40}") from None
    if not isinstance(read := _object(value), wanted):
        raise ValueError(f"{name} is not a {type(read).__name__}")
    return read


def _object(values: dict[str, Any]) -> object:
    """Return the object of a class that ``_plain`` made these values of."""
    kind = _KINDS.get(str(values.pop("kind", "")))
    if kind is None:
        raise ValueError("an object of no known kind")
    types = _types(kind)
    if wrong := types.keys() ^ values.keys():
        raise ValueError(f"{kind.__name__} has no or unknown fields: {', '.join(sorted(wrong))}")
    return kind(**{name: _value(name, types[name], value) for name, value in values.items()})


@cache
def _types(kind: Any) -> Mapping[str, Any]:
    """Return the types of a class's fields by name, but for those that follow from others."""
    types = get_type_hints(kind)
    return {field.name: types[field.name] for field in fields(kind) if field.init}
