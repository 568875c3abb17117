"""Messages to text and bytes: rosbridge's JSON and CBOR, written by their types.

JSON is pure ASCII, because the clients of Unity read it so, and holds no NaN, because they die of
it. In CBOR, arrays of numbers are RFC 8746 typed arrays, which are copied and not converted.
"""

from __future__ import annotations

import json
import math
import os
import struct
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any, Final, Literal, TypeAlias

import cbor2
import msgspec
import numpy as np
import pybase64
from numpy.typing import NDArray

from teleop.rosbridge.errors import FrameError, MessageError
from teleop.rosbridge.messages.message_completion import BLOBS, DTYPES, default_value
from teleop.rosbridge.messages.message_types import (
    DURATION,
    TIME,
    Field,
    Message,
    MessageType,
    short_name,
)
from teleop.rosbridge.messages.type_registry import TypeRegistry

StampFields: TypeAlias = Literal["both", "ros1", "ros2"]
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

_LONG: Final = 65_536
"""Arrays from so many bytes on are not copied before the whole message is joined."""

_DEEPEST: Final = 100
"""Levels of CBOR; a message of ROS has about ten."""


class Codec:
    """Writes messages of a registry's types."""

    def __init__(self, registry: TypeRegistry, *, stamps: StampFields = "both") -> None:
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
        return b"".join(self.json_pieces(kind, message)).decode("ascii")

    def json_pieces(self, kind: MessageType, message: Message) -> list[bytes]:
        """Return a message as JSON text in pieces: large arrays are whole ones, to be copied once.

        Raises:
            MessageError: If the message does not fit its type, or holds what JSON cannot.
        """
        out: list[str | bytes] = []
        try:
            self._json(kind, message, out)
        except (TypeError, ValueError, OverflowError) as error:
            raise _unfit(kind, error) from error
        return list(_joined(out))

    def cbor(self, kind: MessageType, message: Message) -> Message:
        """Return a message as ``write_cbor`` takes it: typed arrays in the place of arrays.

        Raises:
            MessageError: If the message does not fit its type.
        """
        try:
            return self._plain(kind, message)
        except (TypeError, ValueError, OverflowError) as error:
            raise _unfit(kind, error) from error

    def _json(self, kind: MessageType, message: Message, out: list[str | bytes]) -> None:
        if kind.name in (TIME, DURATION):
            out.append(json.dumps(self._stamp(message), separators=(",", ":")))
            return
        separator = "{"
        for field, value in self._values(kind, message):
            out.append(f'{separator}"{field.name}":')
            separator = ","
            self._json_value(field, value, out)
        out.append("{}" if separator == "{" else "}")

    def _json_value(self, field: Field, value: Any, out: list[str | bytes]) -> None:
        if not field.repeated:
            self._json_element(field, value, out)
        elif field.kind in BLOBS:
            # Base64 needs no escapes: we spare the JSON writer the reading of a megabyte.
            out += ('"', pybase64.b64encode(_blob(value)), '"')
        elif field.kind in DTYPES:
            out.append(_numbers_text(field, _numbers(field, value)))
        else:
            separator = "["
            for part in value:
                out.append(separator)
                separator = ","
                self._json_element(field, part, out)
            out.append("[]" if separator == "[" else "]")

    def _json_element(self, field: Field, value: Any, out: list[str | bytes]) -> None:
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
            return cbor2.CBORTag(TAGS[field.kind], _bytes(_numbers(field, value)))
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
    """Return an operation in CBOR; a ``memoryview`` in it is a byte string that is copied once."""
    views: list[memoryview] = []

    def mark(encoder: cbor2.CBOREncoder, view: memoryview) -> None:
        views.append(view)
        encoder.encode_bytes(_MARK)

    first, *rest = cbor2.dumps(value, encoders={memoryview: mark}).split(_MARKED)
    pieces: list[bytes | memoryview] = [first]
    for view, after in zip(views, rest, strict=True):
        pieces += struct.pack("!BI", _LONG_BYTES, view.nbytes), view, after
    return b"".join(pieces)


_MARK: Final = os.urandom(16)
"""Stands for a long byte string until all is written; nobody who sends messages can know it."""

_MARKED: Final = cbor2.dumps(_MARK)

_LONG_BYTES: Final = 0x5A
"""Begins a byte string whose length has four bytes (RFC 8949, section 3.1)."""


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


def _blob(value: Any) -> bytes | memoryview:
    if isinstance(value, np.ndarray):
        if value.dtype != np.uint8:
            raise TypeError(f"bytes are uint8, got an array of {value.dtype}")
        return _bytes(value)
    return view_if_large(value if isinstance(value, bytes) else bytes(value))


def view_if_large(data: bytes) -> bytes | memoryview:
    """Return bytes as ``write_cbor`` copies them least."""
    return data if len(data) < _LONG else memoryview(data)


def _bytes(array: NDArray[Any]) -> bytes | memoryview:
    """Return the bytes of an array, without a copy if there are many."""
    if array.nbytes < _LONG:
        return array.tobytes()
    return memoryview(np.ascontiguousarray(array).view(np.uint8).data)


def _joined(out: list[str | bytes]) -> Iterator[bytes]:
    for kind, parts in groupby(out, type):
        if kind is bytes:
            yield from parts  # type: ignore[misc]
        else:
            yield "".join(parts).encode("ascii")  # type: ignore[arg-type]


def _numbers(field: Field, value: Any) -> NDArray[Any]:
    array: NDArray[Any] = np.asarray(value, DTYPES[field.kind])
    if array.ndim != 1:
        raise ValueError(f"field {field.name} is a row of numbers, got {array.ndim} dimensions")
    return array


def _numbers_text(field: Field, array: NDArray[Any]) -> bytes:
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"field {field.name} holds NaN or infinity, which JSON does not have")
    if array.dtype == np.float32 and array.size:
        array = _shortest(array)
    return _ENCODER.encode(array.tolist())


_ENCODER: Final = msgspec.json.Encoder()
"""Writes rows of numbers: floats in a sixth of the time that Python takes."""


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
