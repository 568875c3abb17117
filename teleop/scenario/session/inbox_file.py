"""What clients wanted of the robot, tick by tick, as lines of JSON: enough to repeat a run to the bit."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Final, TextIO

import numpy as np

from localization.geometry import FloatArray
from localization.types import Hint, Pose, Twist
from teleop.errors import TeleopError
from teleop.joystick import VelocityRequest
from teleop.robot import inbox
from teleop.robot.inbox import ArmWish, InboxMessage
from teleop.scenario.session.arm_wish_file import plain_wish, read_wish

_KINDS: Final[Mapping[str, type[Any]]] = {
    kind.__name__: kind
    for kind in (
        inbox.DriveCommand,
        inbox.PoseHint,
        inbox.TakeOver,
        inbox.Ask,
        inbox.Give,
        inbox.Refuse,
        inbox.EStop,
        inbox.EStopReset,
        inbox.Undo,
        inbox.Relocalize,
        inbox.Disconnected,
        inbox.StepGoal,
        inbox.StepCancel,
        inbox.StepAlive,
        inbox.StepAnswered,
        inbox.ArmWish,
    )
}
"""All kinds of messages, by name."""


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
            line = {"tick": number, "messages": [_plain(message) for message in messages]}
            self._file.write(json.dumps(line, separators=(",", ":")) + "\n")
            # What has been recorded is on the disk, whatever happens to the process.
            self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


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
            return tick, [_message(each) for each in messages]
    raise ValueError("not the messages of a tick")


def _plain(message: InboxMessage) -> dict[str, Any]:
    values: dict[str, Any] = {"kind": type(message).__name__}
    for field in fields(message):
        value = getattr(message, field.name)
        if isinstance(value, VelocityRequest):
            value = {
                "linear": value.twist.linear.tolist(),
                "angular": value.twist.angular.tolist(),
                "enabled": value.enabled,
            }
        elif isinstance(value, Hint):
            value = {
                "stamp": value.stamp,
                "position": value.map_from_base.position.tolist(),
                "quaternion_wxyz": value.map_from_base.quaternion_wxyz.tolist(),
                "covariance": value.covariance.ravel().tolist(),
            }
        elif isinstance(message, ArmWish) and field.name == "wish":
            value = plain_wish(value)
        values[field.name] = value
    return values


def _message(values: Any) -> InboxMessage:
    kind = _KINDS.get(str(values.pop("kind", ""))) if isinstance(values, dict) else None
    if kind is None:
        raise ValueError("a message of no known kind")
    types = {field.name: str(field.type) for field in fields(kind)}
    if wrong := types.keys() ^ values.keys():
        raise ValueError(f"{kind.__name__} has no or unknown fields: {', '.join(sorted(wrong))}")
    read = {name: _value(name, types[name], value) for name, value in values.items()}
    message: InboxMessage = kind(**read)
    return message


def _value(name: str, wanted: str, value: Any) -> object:
    if reader := _READERS.get(wanted):
        return reader(value)
    if ("None" if value is None else type(value).__name__) not in wanted.split(" | "):
        raise ValueError(f"{name} must be {wanted}, got {value!r:.40}")
    return value


def _request(values: Any) -> VelocityRequest:
    match values:
        case {"linear": [*linear], "angular": [*angular], "enabled": bool(enabled)}:
            return VelocityRequest(Twist(_numbers(linear), _numbers(angular)), enabled)
    raise ValueError("not a request")


def _hint(values: Any) -> Hint:
    match values:
        case {
            "stamp": int(stamp),
            "position": [*position],
            "quaternion_wxyz": [*quaternion],
            "covariance": [*covariance],
        }:
            pose = Pose(_numbers(position), _numbers(quaternion))
            return Hint(stamp, pose, _numbers(covariance).reshape(6, 6))
    raise ValueError("not a hint")


def _numbers(values: list[Any]) -> FloatArray:
    if not all(isinstance(value, int | float) for value in values):
        raise ValueError("a number is missing")
    return np.array(values, dtype=float)


_READERS: Final[Mapping[str, Callable[[Any], object]]] = {
    "VelocityRequest": _request,
    "Hint": _hint,
    "Wish": read_wish,
}
"""Reads the fields that are not plain, by their type."""
