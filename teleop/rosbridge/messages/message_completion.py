"""Completion of partial messages with defaults, and validation against their type.

In a completed message every field is present. Arrays of numbers are numpy arrays of the field's
type, ``uint8[]`` and ``char[]`` are ``bytes``, and stamps have ``sec`` and ``nanosec``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pybase64
from numpy.typing import NDArray

from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.messages.message_defaults import BLOBS, DTYPES, default_value
from teleop.rosbridge.messages.message_types import (
    DURATION,
    HEADER,
    TIME,
    Field,
    Message,
    MessageType,
    short_name,
)
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.ros_time import stamp

_RANGES: Final = {
    kind: (int(np.iinfo(dtype).min), int(np.iinfo(dtype).max))
    for kind, dtype in DTYPES.items()
    if dtype.kind in "iu"
}
_FLOAT32_MAX: Final = float(np.finfo(np.float32).max)

_STAMP_FIELDS: Final = {"sec": "sec", "secs": "sec", "nanosec": "nanosec", "nsecs": "nanosec"}

FREE_DEFAULTS: Final = 1000
"""Nested messages that may be omitted in any case; beyond, two for each field that is given.

Otherwise a megabyte of ``{}`` would expand to a third of a million default poses.
"""


@dataclass(slots=True)
class Work:
    """What completing messages has built."""

    omitted: int = 0
    """Nested messages that were omitted and made from defaults."""

    size: int = 0
    """Memory that the messages occupy, roughly [bytes]."""


_MESSAGE_BYTES: Final = 250
"""Memory of a message, without its arrays and texts [bytes]: a dict with a few numbers."""


def complete(
    registry: TypeRegistry,
    kind: MessageType | str,
    partial: object,
    *,
    now: int | None = None,
    finite: bool = True,
    work: Work | None = None,
) -> Message:
    """Return a message with all fields, from one with some of them.

    Args:
        registry: The types of nested fields.
        kind: The message type, or its name.
        partial: A dict with any of the fields.
        now: Value of the stamp ``"now"`` and of a header without a stamp [ns].
        finite: Whether NaN and infinity, which JSON cannot represent, are rejected.
        work: Counts what is built, also if an error ends it.

    Raises:
        MessageError: If a field is unknown, of the wrong type or out of range.
    """
    kind = registry[kind] if isinstance(kind, str) else kind
    completion = _Completion(registry, short_name(kind.name), now, finite)
    try:
        return completion.message(kind, partial, "")
    finally:
        if work is not None:
            work.omitted += completion.omitted
            work.size += completion.size


class _Completion:
    """Completion of one message; ``path`` is the position in it, with a trailing dot."""

    def __init__(self, registry: TypeRegistry, root: str, now: int | None, finite: bool) -> None:
        self._registry = registry
        self._root = root
        self._now = now
        self._finite = finite
        self._given = 0
        """Number of fields that were given so far."""

        self._defaulted = 0
        """Number of nested messages that were omitted so far, without those inside them."""

        self.omitted = 0
        """Number of nested messages that were made from defaults so far."""

        self.size = 0
        """Memory of what was built so far, roughly [bytes]."""

    def message(self, kind: MessageType, value: object, path: str) -> Message:
        if kind.name in (TIME, DURATION):
            value = self._stamp(kind, value, path)
        if type(value) is not dict and not isinstance(value, Mapping):  # the first is faster
            raise self._mismatch(short_name(kind.name), path[:-1], value)
        given: Mapping[str, Any] = value
        if kind.name == HEADER:
            given = {name: part for name, part in given.items() if name != "seq"}
            if self._now is not None:  # as rosbridge does; an omitted header keeps a zero stamp
                given.setdefault("stamp", "now")
        done: Message = {}
        used = 0
        for field in kind.fields:
            name = field.name
            if name not in given:
                if field.nested and not field.repeated:
                    self._defaulted += 1
                    made = self._registry.nested_messages(field.kind)
                    self.omitted += made
                    self.size += made * _MESSAGE_BYTES
                done[name] = default_value(self._registry, kind, field)
                continue
            used += 1
            part = given[name]
            # The fast path of most fields.
            plain = type(part) is float and field.kind == "float64" and not field.repeated
            if plain and math.isfinite(part):
                done[name] = part
            else:
                done[name] = self._value(field, part, path + name)
        if used < len(given):
            stray = next(name for name in given if name not in done)
            raise MessageError(
                f"Message type {self._root} does not have a field {path}{str(stray)[:80]}"
            )
        self._given += len(given)
        self.size += _MESSAGE_BYTES
        if self._defaulted > FREE_DEFAULTS + 2 * self._given:
            raise MessageError(
                f"{self._root} message has too many omitted fields for its size: "
                f"{self._defaulted} by {path[:-1]}"
            )
        return done

    def _stamp(self, kind: MessageType, value: object, path: str) -> object:
        """Return a stamp with the field names of ROS 2."""
        if value == "now" and kind.name == TIME:
            if self._now is None:
                raise MessageError(f"{self._root} field {path[:-1]}: 'now' is not available")
            return stamp(self._now)
        if not isinstance(value, Mapping):
            return value
        # If both spellings are given, that of ROS 2 takes precedence.
        ordered = sorted(value.items(), key=lambda item: item[0] in ("sec", "nanosec"))
        return {_STAMP_FIELDS.get(name, name): part for name, part in ordered}

    def _value(self, field: Field, value: object, path: str) -> Any:
        if not field.repeated:
            return self._element(field, value, path)
        if field.kind in BLOBS:
            done: Any = self._blob(field, value, path)
            self.size += len(done)
        elif field.kind in DTYPES:
            done = self._numbers(field, value, path)
            self.size += done.nbytes
        elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
            done = [self._element(field, part, f"{path}[{i}]") for i, part in enumerate(value)]
        else:
            raise self._mismatch(field.text, path, value)
        if field.size and len(done) != field.size:
            raise MessageError(
                f"{self._root} field {path} has {field.size} elements, but got {len(done)}"
            )
        if field.bound and len(done) > field.bound:
            raise MessageError(
                f"{self._root} field {path} has at most {field.bound} elements, but got {len(done)}"
            )
        return done

    def _element(self, field: Field, value: object, path: str) -> Any:
        kind = field.kind
        if field.nested:
            return self.message(self._registry[kind], value, path + ".")
        if kind == "string":
            return self._text(field, value, path)
        if kind == "bool":
            if isinstance(value, bool | np.bool_):
                return bool(value)
            raise self._mismatch(kind, path, value)
        # True is an int in Python, and 1.0 may be a rounded larger integer: both are rejected.
        if isinstance(value, bool):
            raise self._mismatch(kind, path, value)
        if kind in _RANGES:
            if not isinstance(value, int | np.integer):
                raise self._mismatch(kind, path, value)
            low, high = _RANGES[kind]
            if not low <= value <= high:
                raise self._overflow(kind, path)
            return int(value)
        if not isinstance(value, int | float | np.integer | np.floating):
            raise self._mismatch(kind, path, value)
        return self._float(kind, value, path)

    def _float(self, kind: str, value: Any, path: str) -> float:
        try:
            number = float(value)
        except OverflowError:
            raise self._overflow(kind, path) from None
        if not math.isfinite(number):
            if self._finite:
                raise self._overflow(kind, path)
        elif kind == "float32" and abs(number) > _FLOAT32_MAX:
            raise self._overflow(kind, path)
        return number

    def _text(self, field: Field, value: object, path: str) -> str:
        if not isinstance(value, str):
            raise self._mismatch("string", path, value)
        self.size += len(value)
        if not value.isascii() or field.longest:
            try:
                length = len(value.encode())
            except UnicodeEncodeError:
                raise MessageError(
                    f"{self._root} field {path} contains an unpaired surrogate"
                ) from None
            if field.longest and length > field.longest:
                raise MessageError(
                    f"{self._root} field {path} has at most {field.longest} bytes, but got {length}"
                )
        return value

    def _blob(self, field: Field, value: object, path: str) -> bytes:
        if isinstance(value, bytes | bytearray | memoryview):
            return bytes(value)
        if isinstance(value, str):
            try:
                return pybase64.b64decode(value, validate=True)
            except ValueError:
                raise MessageError(f"{self._root} field {path} is not base64") from None
        return self._numbers(field, value, path).tobytes()

    def _numbers(self, field: Field, value: object, path: str) -> NDArray[Any]:
        dtype = DTYPES[field.kind]
        if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "iuf":
            wide = value
            if dtype.kind != "f" and wide.dtype.kind == "f":
                raise self._mismatch(field.text, path, value)
        elif isinstance(value, list | tuple):
            allowed = {int, float} if dtype.kind == "f" else {int}
            if not allowed.issuperset(map(type, value)):
                i, stray = next((i, x) for i, x in enumerate(value) if type(x) not in allowed)
                raise self._mismatch(field.kind, f"{path}[{i}]", stray)
            try:
                wide = np.array(value, np.float64 if dtype.kind == "f" else dtype)
            except OverflowError:
                raise self._overflow(field.text, path) from None
        else:
            raise self._mismatch(field.text, path, value)
        if wide.dtype != dtype:
            with np.errstate(over="ignore"):
                narrow = wide.astype(dtype)
            fits = np.isfinite(narrow) == np.isfinite(wide) if dtype.kind == "f" else narrow == wide
            if not np.all(fits):
                raise self._overflow(field.text, path)
            wide = narrow
        if self._finite and dtype.kind == "f" and not np.isfinite(wide).all():
            raise self._overflow(field.text, path)
        return wide

    def _mismatch(self, wanted: str, path: str, value: object) -> MessageError:
        where = f" for field {path}" if path else ""
        return MessageError(
            f"{self._root} message requires a {wanted}{where}, but got a {type(value)}"
        )

    def _overflow(self, wanted: str, path: str) -> MessageError:
        return MessageError(
            f"{self._root} message requires a {wanted} for field {path}, but got one out of range"
        )
