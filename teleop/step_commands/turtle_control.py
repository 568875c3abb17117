"""The commands of the topic ``turtle_control``: JSON objects of one or more keys, in order.

======== =============================== ===========================================================
key      value                           effect
======== =============================== ===========================================================
distance number, or number as text [m]   length of a step from now on
angle    whole degrees, or such a text   size of a turn from now on
movement up, down, left, right           one step forward or back by distance, one turn by angle
action   photo                           one photograph
======== =============================== ===========================================================

Beside these, which are those of a thesis about AR glasses, ``invert_turns`` (true or false) says from now on
whether ``right`` turns to the left and ``left`` to the right, as in that thesis' own program.

The sizes persist for each sender; who reads for several keeps one ``StepSizes`` for each.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

from teleop.step_commands.commands import (
    MAX_DISTANCE,
    Photo,
    Step,
    StepCommand,
    StepCommandError,
)

MAX_LENGTH: Final = 4096
"""Characters of the longest command; the examples are below 100."""

_NUMBER: Final = re.compile(r"\s*[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?\s*")
_MOVEMENTS: Final = ("up", "down", "left", "right")


@dataclass(frozen=True, slots=True)
class StepSizes:
    """What a sender has set so far, and how its turns are meant."""

    distance: float | None = None
    """Length of a step [m]; None until the sender has set it."""
    angle: int | None = None
    """Size of a turn [deg]; None until the sender has set it."""
    speed: float = 0.0
    """Speed of straight steps [m/s]; 0 for the robot's own."""
    turn_speed: float = 0.0
    """Speed of turns [rad/s]; 0 for the robot's own."""
    right_turns_left: bool = False
    """Whether ``right`` turns to the left and ``left`` to the right, as in the thesis' own program."""


Parsed = tuple[StepSizes, tuple[StepCommand, ...]]
"""The sizes from now on, and what is to be done, in order."""


def read_turtle_control(text: str | bytes, sizes: StepSizes) -> Parsed:
    """Return what a command sets and asks for; if any of its keys is invalid, none has an effect.

    Args:
        text: The command as JSON text, in UTF-8 if it is bytes.
        sizes: What its sender has set before.

    Raises:
        StepCommandError: If it is no such command, or moves before the size of the motion is set.
    """
    commands: list[StepCommand] = []
    for key, value in _pairs(text):
        sizes, command = _READERS[key](value, sizes)
        if command is not None:
            commands.append(command)
    return sizes, tuple(commands)


def _pairs(text: str | bytes) -> list[tuple[str, object]]:
    """Return keys and values of the object, in order."""
    if len(text) > MAX_LENGTH:
        raise StepCommandError(f"a command has at most {MAX_LENGTH} characters, got {len(text)}")
    try:
        decoded = text.decode() if isinstance(text, bytes) else text
        parsed = json.loads(decoded, object_pairs_hook=_Pairs)
    except (ValueError, RecursionError):
        parsed = None
    if not isinstance(parsed, _Pairs) or not parsed.pairs:
        raise StepCommandError(
            f'a command is a JSON object such as {{"movement": "up"}}, got {text!r:.60}'
        )
    keys = [key for key, _ in parsed.pairs]
    for key in keys:
        if key not in _READERS:
            raise StepCommandError(f"unknown key {key!r:.40}; known are {', '.join(_READERS)}")
        if keys.count(key) > 1:
            raise StepCommandError(f"{key} is given twice; send one object for each")
    return parsed.pairs


class _Pairs:
    """A JSON object with the order of its keys, and with those that are there twice."""

    def __init__(self, pairs: list[tuple[str, object]]) -> None:
        self.pairs = pairs


_Read = tuple[StepSizes, StepCommand | None]


def _distance(value: object, sizes: StepSizes) -> _Read:
    distance = _number(value)
    if distance is None or not 0.0 < distance <= MAX_DISTANCE:
        raise StepCommandError(
            f'distance must be a number of metres above 0 and up to {MAX_DISTANCE:g}, such as 0.5 or "0.5",'
            f" got {_shown(value)}"
        )
    return replace(sizes, distance=distance), None


def _angle(value: object, sizes: StepSizes) -> _Read:
    angle = _number(value)
    if angle is None or not angle.is_integer() or not 1.0 <= angle <= 360.0:
        raise StepCommandError(
            f'angle must be whole degrees from 1 to 360, such as 15 or "15", got {_shown(value)}'
        )
    return replace(sizes, angle=int(angle)), None


def _movement(value: object, sizes: StepSizes) -> _Read:
    if value not in _MOVEMENTS:
        raise StepCommandError(
            f"movement must be one of {', '.join(_MOVEMENTS)}, got {_shown(value)}"
        )
    if value in ("up", "down"):
        if sizes.distance is None:
            raise StepCommandError(
                f'movement {value} needs the length of a step: send {{"distance": 0.5}} first'
            )
        length = sizes.distance if value == "up" else -sizes.distance
        return sizes, Step(distance=length, speed=sizes.speed)
    if sizes.angle is None:
        raise StepCommandError(
            f'movement {value} needs the size of a turn: send {{"angle": 15}} first'
        )
    left = (value == "left") is not sizes.right_turns_left
    size = math.radians(sizes.angle)
    return sizes, Step(angle=size if left else -size, speed=sizes.turn_speed)


def _action(value: object, sizes: StepSizes) -> _Read:
    if value != "photo":
        raise StepCommandError(f"action must be photo, got {_shown(value)}")
    return sizes, Photo()


def _invert_turns(value: object, sizes: StepSizes) -> _Read:
    if not isinstance(value, bool):
        raise StepCommandError(f"invert_turns must be true or false, got {_shown(value)}")
    return replace(sizes, right_turns_left=value), None


_READERS: Final[Mapping[str, Callable[[object, StepSizes], _Read]]] = {
    "distance": _distance,
    "angle": _angle,
    "movement": _movement,
    "action": _action,
    "invert_turns": _invert_turns,
}
"""Read the value of each key."""


def _number(value: object) -> float | None:
    """Return a number, also one that is given as text; None if it is neither."""
    if isinstance(value, str) and _NUMBER.fullmatch(value):
        return float(value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return None
    return None


def _shown(value: object) -> str:
    return "an object" if isinstance(value, _Pairs) else f"{value!r:.40}"
