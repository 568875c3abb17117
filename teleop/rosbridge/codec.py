"""Messages to text and bytes: rosbridge's JSON and CBOR, written by their types.

JSON is pure ASCII, because the clients of Unity read it so, and holds no NaN, because they die of
it. In CBOR, arrays of numbers are RFC 8746 typed arrays, which are copied and not converted.
"""

from __future__ import annotations

import json
import math
from binascii import b2a_base64
from collections.abc import Mapping
from typing import Any, Final, Literal, TypeAlias

import cbor2
import numpy as np
from numpy.typing import NDArray

from teleop.rosbridge.errors import FrameError, MessageError
from teleop.rosbridge.messages import BLOBS, DTYPES, default_value
from teleop.rosbridge.registry import Registry
from teleop.rosbridge.types import (
    DURATION,
    TIME,
    Field,
    Message,
    MessageType,
    short_name,
)

Stamps: TypeAlias = Literal["both", "ros1", "ros2"]
"""How the parts of a stamp are called: ``secs, nsecs`` in ROS 1, ``sec, nanosec`` in ROS 2."""

TAGS: Final = {
    "byte": 64,
    "uint16": 69,
    "uint32": 70,
    "uint64": 71,
    "int8": 72,
    "int16": 77,
    "int32": 78,
    "int64": 79,
    "float32": 85,
    "float64": 86,
}
"""Tags of the little-endian typed arrays (RFC 8746, section 2.1)."""

_ARRAYS: Final = {tag: DTYPES[kind] for kind, tag in TAGS.items()}

_DEEPEST: Final = 100
"""Levels of CBOR; a message of ROS has about ten."""


class Codec:
    """Writes messages of a registry's types."""

    def __init__(self, registry: Registry, *, stamps: Stamps = "both") -> None:
        self._registry = registry
        self._stamp_names = {
            "both": (("sec", "nanosec"), ("secs", "nsecs")),
            "ros2": (("sec", "nanosec"),),
            "ros1": (("secs", "nsecs"),),
        }[stamps]

    def json(self, kind: MessageType, message: Message) -> str:
        """Return a message as JSON text; fields left out are written with their defaults.

        Raises:
            MessageError: If the message does not fit its type, or holds what JSON cannot.
        """
        out: list[str] = []
        try:
            self._json(kind, message, out)
        except (TypeError, ValueError, OverflowError) as error:
            raise _unfit(kind, error) from error
        return "".join(out)

    def cbor(self, kind: MessageType, message: Message) -> Message:
        """Return a message as ``write_cbor`` takes it: typed arrays in the place of arrays.

        Raises:
            MessageError: If the message does not fit its type.
        """
        try:
            return self._plain(kind, message)
        except (TypeError, ValueError, OverflowError) as error:
            raise _unfit(kind, error) from error

    def _json(self, kind: MessageType, message: Message, out: list[str]) -> None:
        if kind.name in (TIME, DURATION):
            out.append(json.dumps(self._stamp(message), separators=(",", ":")))
            return
        separator = "{"
        for field, value in self._values(kind, message):
            out.append(f'{separator}"{field.name}":')
            separator = ","
            self._json_value(field, value, out)
        out.append("{}" if separator == "{" else "}")

    def _json_value(self, field: Field, value: Any, out: list[str]) -> None:
        if not field.repeated:
            self._json_element(field, value, out)
        elif field.kind in BLOBS:
            # Base64 needs no escapes: we spare the JSON writer the reading of a megabyte.
            out += ('"', b2a_base64(_blob(value), newline=False).decode("ascii"), '"')
        elif field.kind in DTYPES:
            out.append(_numbers_text(field, _numbers(field, value)))
        else:
            separator = "["
            for part in value:
                out.append(separator)
                separator = ","
                self._json_element(field, part, out)
            out.append("[]" if separator == "[" else "]")

    def _json_element(self, field: Field, value: Any, out: list[str]) -> None:
        if field.nested:
            self._json(self._registry[field.kind], value, out)
            return
        plain = _plain_element(field, value)
        if isinstance(plain, float) and not math.isfinite(plain):
            raise ValueError(f"field {field.name} is {plain}, which JSON does not have")
        out.append(json.dumps(plain))

    def _plain(self, kind: MessageType, message: Message) -> Message:
        if kind.name in (TIME, DURATION):
            return self._stamp(message)
        return {
            field.name: self._plain_value(field, value)
            for field, value in self._values(kind, message)
        }

    def _plain_value(self, field: Field, value: Any) -> Any:
        if field.repeated and field.kind in BLOBS:
            return _blob(value)
        if field.repeated and field.kind in DTYPES:
            return cbor2.CBORTag(TAGS[field.kind], _numbers(field, value).tobytes())
        parts = value if field.repeated else (value,)
        if field.nested:
            kind = self._registry[field.kind]
            done: list[Any] = [self._plain(kind, part) for part in parts]
        else:
            done = [_plain_element(field, part) for part in parts]
        return done if field.repeated else done[0]

    def _values(self, kind: MessageType, message: Message) -> list[tuple[Field, Any]]:
        if not isinstance(message, Mapping):
            raise TypeError(f"a {short_name(kind.name)} is a dict, not a {type(message).__name__}")
        values = []
        known = 0
        for field in kind.fields:
            if field.name in message:
                known += 1
                values.append((field, message[field.name]))
            else:
                values.append((field, default_value(self._registry, kind, field)))
        if known < len(message):
            strays = set(message) - {field.name for field in kind.fields}
            raise ValueError(f"it has no field {', '.join(sorted(map(str, strays)))}")
        for field, value in values:
            if field.size and len(value) != field.size:
                raise ValueError(f"field {field.name} is a {field.text}, got {len(value)} elements")
        return values

    def _stamp(self, message: Message) -> Message:
        strays = set(message) - {"sec", "nanosec"}
        if strays:
            raise ValueError(f"a stamp has sec and nanosec, not {', '.join(sorted(strays))}")
        parts = int(message.get("sec", 0)), int(message.get("nanosec", 0))
        return {
            name: part
            for names in self._stamp_names
            for name, part in zip(names, parts, strict=True)
        }


def write_json(value: object) -> str:
    """Return JSON text of an operation: ASCII, compact, and without NaN."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def write_cbor(value: object) -> bytes:
    """Return an operation in CBOR."""
    return cbor2.dumps(value)


def read_cbor(data: bytes) -> Any:
    """Return what CBOR bytes hold; typed arrays become numpy arrays.

    Raises:
        FrameError: If the bytes are not CBOR.
    """
    try:
        return cbor2.loads(data, tag_hook=_untag, max_depth=_DEEPEST)
    except (cbor2.CBORError, ValueError, TypeError, OverflowError, MemoryError) as error:
        raise FrameError(f"not CBOR: {error}") from error


def _untag(tag: cbor2.CBORTag, immutable: bool) -> Any:
    dtype = _ARRAYS.get(tag.tag)
    if dtype is None or not isinstance(tag.value, bytes):
        return tag
    return np.frombuffer(tag.value, dtype)


def _unfit(kind: MessageType, error: Exception) -> MessageError:
    return MessageError(f"cannot write a {short_name(kind.name)}: {error}")


def _plain_element(field: Field, value: Any) -> str | bool | int | float:
    if field.kind == "string":
        if not isinstance(value, str):
            raise TypeError(f"field {field.name} is a string, got {type(value).__name__}")
        return value
    if field.kind == "bool":
        return bool(value)
    if field.kind.startswith("float"):
        return float(value)
    number = int(value)
    if number != value:
        raise ValueError(f"field {field.name} is an {field.kind}, got {value}")
    return number


def _blob(value: Any) -> bytes:
    if isinstance(value, bytes):
        return value
    if isinstance(value, np.ndarray):
        if value.dtype != np.uint8:
            raise TypeError(f"bytes are uint8, got an array of {value.dtype}")
        return value.tobytes()
    return bytes(value)


def _numbers(field: Field, value: Any) -> NDArray[Any]:
    array: NDArray[Any] = np.asarray(value, DTYPES[field.kind])
    if array.ndim != 1:
        raise ValueError(f"field {field.name} is a row of numbers, got {array.ndim} dimensions")
    return array


def _numbers_text(field: Field, array: NDArray[Any]) -> str:
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"field {field.name} holds NaN or infinity, which JSON does not have")
    if array.dtype == np.float32 and array.size:
        array = _shortest(array)
    if array.dtype == np.int8 and array.size:
        return f"[{_small_numbers_text(array)}]"
    # A list's text is JSON for numbers, but for its spaces.
    return str(array.tolist()).replace(" ", "")


_SMALL: Final = np.array([f"{i if i < 128 else i - 256},".encode() for i in range(256)])
"""Texts of all bytes, by their bits, each filled up with zeros to the length of the longest."""


def _small_numbers_text(array: NDArray[Any]) -> str:
    """Return the numbers of a row of bytes, which occupancy grids have a million of.

    Looked up rather than written one by one: a fifth of the time.
    """
    bits = np.ascontiguousarray(array).view(np.uint8)
    return _SMALL[bits].tobytes().translate(None, b"\0")[:-1].decode("ascii")


def _shortest(array: NDArray[Any]) -> NDArray[Any]:
    """Return doubles of few digits that are still exactly these float32.

    A float32 as a double has seventeen digits of which eight mean something: half of a scan's text
    and of the time to write it.
    """
    wide = array.astype(np.float64)
    for digits in (4, 7, 9):
        short = wide.round(digits)
        if (short.astype(np.float32) == array).all():
            return short
    return wide
