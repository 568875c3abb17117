"""Encoding of messages as rosbridge's JSON and CBOR, by their types.

JSON is pure ASCII, which Unity clients require, and contains no NaN, on which they fail. In CBOR,
arrays of numbers are RFC 8746 typed arrays, which are copied without conversion.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any, Final

import msgspec
import numpy as np
import pybase64
from numpy.typing import NDArray

from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.messages.cbor import array_bytes, typed_array, view_if_large
from teleop.rosbridge.messages.message_defaults import BLOBS, DTYPES, default_value
from teleop.rosbridge.messages.message_types import (
    DURATION,
    TIME,
    Field,
    Message,
    MessageType,
    short_name,
)
from teleop.rosbridge.messages.polite_threads import after_message
from teleop.rosbridge.messages.type_registry import TypeRegistry

_ARRAY_ENCODER: Final = msgspec.json.Encoder()
"""Writes arrays of floats in a sixth of the time of Python's json module."""


class Codec:
    """Encodes messages of a registry's types."""

    def __init__(self, registry: TypeRegistry) -> None:
        self._registry = registry

    def json(self, kind: MessageType, message: Message) -> str:
        """Return a message as JSON text; omitted fields are written with their defaults.

        Raises:
            MessageError: If the message does not fit its type, or JSON cannot represent it.
        """
        return b"".join(self.json_pieces(kind, message)).decode("ascii")

    def json_pieces(self, kind: MessageType, message: Message) -> list[bytes]:
        """Return a message as pieces of JSON text; each large array is a piece, to be copied once.

        Raises:
            MessageError: If the message does not fit its type, or JSON cannot represent it.
        """
        out: list[str | bytes] = []
        try:
            self._json(kind, message, out)
        except (TypeError, ValueError, OverflowError) as error:
            raise _encoding_error(kind, error) from error
        return list(_joined(out))

    def cbor(self, kind: MessageType, message: Message) -> Message:
        """Return a message as ``write_cbor`` takes it, with typed arrays in place of arrays.

        Raises:
            MessageError: If the message does not fit its type.
        """
        try:
            return self._cbor(kind, message)
        except (TypeError, ValueError, OverflowError) as error:
            raise _encoding_error(kind, error) from error

    def _json(self, kind: MessageType, message: Message, out: list[str | bytes]) -> None:
        if kind.name in (TIME, DURATION):
            parts = (f'"{name}":{number}' for name, number in _stamp(message).items())
            out.append(f"{{{','.join(parts)}}}")
            return
        separator = "{"
        for field, value in self._values(kind, message):
            out.append(f'{separator}"{field.name}":')
            separator = ","
            self._json_value(field, value, out)
        out.append("{}" if separator == "{" else "}")
        after_message()

    def _json_value(self, field: Field, value: Any, out: list[str | bytes]) -> None:
        if not field.repeated:
            self._json_element(field, value, out)
        elif field.kind in BLOBS:
            # Base64 needs no escapes, so the JSON writer need not scan a megabyte.
            out += ('"', pybase64.b64encode(_blob(value)), '"')
        elif field.kind in DTYPES:
            out.append(_json_array(field, _array(field, value)))
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
        plain = _scalar(field, value)
        if isinstance(plain, float) and not math.isfinite(plain):
            raise ValueError(f"field {field.name} is {plain}, which JSON cannot represent")
        # A number's own text is that of JSON; its writer sets itself up anew for each.
        number = type(plain) is float or type(plain) is int
        out.append(repr(plain) if number else json.dumps(plain))

    def _cbor(self, kind: MessageType, message: Message) -> Message:
        if kind.name in (TIME, DURATION):
            return _stamp(message)
        after_message()
        return {
            field.name: self._cbor_value(field, value)
            for field, value in self._values(kind, message)
        }

    def _cbor_value(self, field: Field, value: Any) -> Any:
        if field.repeated and field.kind in BLOBS:
            return _blob(value)
        if field.repeated and field.kind in DTYPES:
            return typed_array(field.kind, _array(field, value))
        parts = value if field.repeated else (value,)
        if field.nested:
            kind = self._registry[field.kind]
            encoded: list[Any] = [self._cbor(kind, part) for part in parts]
        else:
            encoded = [_scalar(field, part) for part in parts]
        return encoded if field.repeated else encoded[0]

    def _values(self, kind: MessageType, message: Message) -> list[tuple[Field, Any]]:
        """Return the fields of a type with their values, checking names and fixed sizes."""
        if not isinstance(message, Mapping):
            what = type(message).__name__
            raise TypeError(f"a {short_name(kind.name)} must be a dict, got {what}")
        values = []
        known = 0
        for field in kind.fields:
            if field.name in message:
                known += 1
                values.append((field, message[field.name]))
            else:
                values.append((field, default_value(self._registry, kind, field)))
        if known < len(message):
            unknown = set(message) - {field.name for field in kind.fields}
            raise ValueError(f"it has no field {', '.join(sorted(map(str, unknown)))}")
        for field, value in values:
            if field.size and len(value) != field.size:
                raise ValueError(f"field {field.name} is a {field.text}, got {len(value)} elements")
        return values


def _stamp(message: Message) -> Message:
    """Return a stamp with the names of its parts in ROS 2 and those in ROS 1."""
    unknown = set(message) - {"sec", "nanosec"}
    if unknown:
        raise ValueError(f"a stamp has sec and nanosec, not {', '.join(sorted(unknown))}")
    seconds, rest = int(message.get("sec", 0)), int(message.get("nanosec", 0))
    return {"sec": seconds, "nanosec": rest, "secs": seconds, "nsecs": rest}


def write_json(value: object) -> str:
    """Return an operation as JSON text: ASCII, compact, and without NaN."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _encoding_error(kind: MessageType, error: Exception) -> MessageError:
    return MessageError(f"cannot encode a {short_name(kind.name)}: {error}")


def _scalar(field: Field, value: Any) -> str | bool | int | float:
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
            raise TypeError(f"bytes must be uint8, got an array of {value.dtype}")
        return array_bytes(value)
    return view_if_large(value if isinstance(value, bytes) else bytes(value))


def _joined(out: list[str | bytes]) -> Iterator[bytes]:
    for kind, parts in groupby(out, type):
        if kind is bytes:
            yield from parts  # type: ignore[misc]
        else:
            yield "".join(parts).encode("ascii")  # type: ignore[arg-type]


def _array(field: Field, value: Any) -> NDArray[Any]:
    array: NDArray[Any] = np.asarray(value, DTYPES[field.kind])
    if array.ndim != 1:
        raise ValueError(f"field {field.name} must have one dimension, got {array.ndim}")
    return array


def _json_array(field: Field, array: NDArray[Any]) -> bytes:
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(
            f"field {field.name} contains NaN or infinity, which JSON cannot represent"
        )
    if array.dtype == np.float32 and array.size:
        array = _shortest_decimals(array)
    return _ARRAY_ENCODER.encode(array.tolist())


def _shortest_decimals(array: NDArray[Any]) -> NDArray[Any]:
    """Return doubles of few digits that round to exactly these float32.

    A float32 converted to double has seventeen digits of which eight are significant; the rest is
    half of a scan's text and of the time to write it.
    """
    wide = array.astype(np.float64)
    for digits in (4, 7, 9):
        short = wide.round(digits)
        if (short.astype(np.float32) == array).all():
            return short
    return wide
