"""Operations in the frames that clients send: JSON in text, and in binary as ROS# has it."""

from __future__ import annotations

import gc
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from teleop.rosbridge.errors import FrameError

_SPACE: Final = re.compile(r"[ \t\r\n]*")

_LARGE: Final = 4096
"""Length of a text from which on the collector of garbage pauses while it is read."""


_MOST: Final = 16
"""Operations in one frame; of two bytes each, a frame could hold half a million."""


def _refuse(constant: str) -> None:
    raise FrameError(f"{constant} is not JSON")


_DECODER: Final = json.JSONDecoder(parse_constant=_refuse)


def read_json(text: str) -> Any:
    """Return what a JSON text says.

    Raises:
        FrameError: If it is not JSON; it is a ValueError.
    """
    try:
        return _DECODER.decode(text)
    except RecursionError:
        raise FrameError("the JSON is nested too deeply") from None
    except ValueError as error:
        raise FrameError(f"not JSON: {error}") from None


def operations(frame: str | bytes) -> Iterator[dict[str, Any]]:
    """Yield the objects in a frame: one, as a rule, but some clients send several.

    Each is read before the next is looked at, so what comes before a mistake is still heard.

    Raises:
        FrameError: If the frame holds anything but JSON objects.
    """
    text = frame if isinstance(frame, str) else _decoded(frame)
    position = _skip(text, 0)
    if position == len(text):
        raise FrameError("the frame is empty")
    for _ in range(_MOST):
        if position == len(text):
            return
        try:
            with gc_paused(len(text)):
                value, position = _DECODER.raw_decode(text, position)
        except RecursionError:
            raise FrameError("the JSON is nested too deeply") from None
        except json.JSONDecodeError as error:
            raise FrameError(f"not JSON: {error.msg} at character {error.pos}") from None
        except ValueError as error:  # ours, and integers of more digits than Python reads
            raise FrameError(f"not JSON: {error}") from None
        if not isinstance(value, dict):
            raise FrameError(f"an operation is a JSON object, not {_NAMES[type(value)]}")
        yield value
        position = _skip(text, position)
    if position < len(text):
        raise FrameError(f"a frame holds at most {_MOST} operations")


_NAMES: Final = {
    list: "an array",
    str: "a string",
    int: "a number",
    float: "a number",
    bool: "a truth value",
    type(None): "null",
}


def _decoded(frame: bytes) -> str:
    try:
        return frame.decode()
    except UnicodeDecodeError:
        raise FrameError("a binary frame must hold JSON text in UTF-8") from None


def _skip(text: str, position: int) -> int:
    space = _SPACE.match(text, position)
    return space.end() if space else position


@contextmanager
def gc_paused(length: int) -> Iterator[None]:
    """Keep Python from looking for garbage among what is just being read.

    A megabyte of empty arrays has it look again and again: 0.7 s instead of 0.08 s in all.
    """
    pause = length >= _LARGE and gc.isenabled()
    if pause:
        gc.disable()
    try:
        yield
    finally:
        if pause:
            gc.enable()
