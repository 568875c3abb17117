"""Validation of large frames by the type of their payload, before any message is built.

A megabyte of JSON can expand to half a million Python objects. A large frame is therefore first
decoded by msgspec into a schema of its topic, service or action, which stops at the first misfit.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import GenericAlias
from typing import Any, Final, Literal, TypeAlias

import msgspec

from teleop.rosbridge.errors import FrameError
from teleop.rosbridge.framing.json_frames import count_objects, gc_paused
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.messages.message_completion import FREE_DEFAULTS
from teleop.rosbridge.messages.message_defaults import BLOBS
from teleop.rosbridge.messages.message_types import (
    DURATION,
    HEADER,
    TIME,
    Field,
    Message,
    MessageType,
)
from teleop.rosbridge.messages.type_registry import TypeRegistry

LARGE_FRAME: Final = 16_384
"""Length from which on a frame is validated first; parsing a shorter one takes less time."""

_HEAD: Final = 1024
"""Characters at either end of a large frame that contain all its fields but the payload."""

_SHORTEST_MESSAGE: Final = 8
"""Characters of the shortest nested message in a list that sets a field: ``{"x":1},``."""

_NUMBER_ID: Final = re.compile(r'"id"\s{0,9}:\s{0,9}(-?\d{1,18})\b')
"""The id of an operation, if it is a number."""

_STRING_FIELD: Final = re.compile(r'"(\w+)"\s{0,9}:\s{0,9}("(?:[^"\\]|\\.)*")')
"""A key of an object and its string value."""

_Scalar: TypeAlias = str | float | bool | None


class _QoSSchema(msgspec.Struct, gc=False, forbid_unknown_fields=True):
    history: _Scalar = None
    depth: _Scalar = None
    reliability: _Scalar = None
    durability: _Scalar = None
    deadline: _Scalar | dict[Literal["sec", "secs", "nanosec", "nsecs"], float] = None
    lifespan: _Scalar | dict[Literal["sec", "secs", "nanosec", "nsecs"], float] = None
    liveliness: _Scalar = None


_SCALAR_FIELDS: Final = (
    *("id", "type", "action_type", "latch", "queue_size", "queue_length", "throttle_rate"),
    *("fragment_size", "compression", "timeout", "feedback", "result", "status", "num", "total"),
)
"""Fields of operations that contain a single value."""


@dataclass(frozen=True, slots=True)
class PayloadField:
    """The field of an operation that may be large, and how its type is found."""

    name: str
    """Field that names the resource, such as ``topic``."""

    part: str
    """Field that may be large, such as ``msg``."""

    find: Callable[[str], MessageType | None]
    """Returns the type of the payload by the resource's name; None if there is no such resource."""

    or_text: bool = False
    """Whether an error text may take the place of the payload."""


@dataclass(frozen=True, slots=True)
class FrameTarget:
    """What a large frame is for, by the fields at its ends; nothing has been read of the rest."""

    op: str
    name: str
    """Name of the topic, service or action; empty for a fragment."""

    field: str
    """Field of the operation that contains the name; empty for a fragment."""

    id: str | int | None
    """Id of the operation, if it is at an end of the frame."""

    @property
    def operation(self) -> Operation:
        """The operation without its payload."""
        named = {self.field: self.name} if self.field else {}
        return {"op": self.op, **named, **({} if self.id is None else {"id": self.id})}


class LargeFrameReader:
    """Validates and parses large frames."""

    def __init__(self, registry: TypeRegistry, payloads: Mapping[str, PayloadField]) -> None:
        """Take the operations that may be large; a ``fragment`` always may be."""
        self._registry = registry
        self._payloads = payloads
        self._schemas: dict[str, Any] = {}
        self._unbounded: set[str] = set()
        """Types whose messages may contain any number of nested messages."""

        self._decoders: dict[tuple[str, str], msgspec.json.Decoder[Any]] = {}

    def read(self, frame: str | bytes) -> Message:
        """Return the only operation in a large frame.

        Raises:
            FrameError: If the operation may not be large, or its payload does not fit its type.
        """
        strings = _string_fields(frame)
        op, name = self._op(strings), None
        try:
            if op == "fragment":
                decoder = self._decoder(op, None)
            else:
                payload = self._payloads[op]
                name, kind = _resource(strings, payload, op)
                decoder = self._decoder(op, kind)
                objects = count_objects(frame)
                most = FREE_DEFAULTS + len(frame) // _SHORTEST_MESSAGE
                if kind.name in self._unbounded and objects > most:
                    raise FrameError(f"{op}: {payload.part} has too many omitted fields")
            decoded = decoder.decode(frame)
            # A duplicate key could validate by one type and be processed by another.
            if name is not None and getattr(decoded, payload.name) != name:
                raise FrameError(f"{op}: duplicate field {payload.name}")
            with gc_paused(len(frame)):
                return dict(msgspec.json.decode(frame))
        except RecursionError:
            raise FrameError("the JSON is nested too deeply") from None
        except msgspec.ValidationError as error:
            raise FrameError(f"{op}: {str(error)[:200]}") from None
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise FrameError(f"not JSON: {str(error)[:200]}") from None

    def target(self, frame: str | bytes) -> FrameTarget:
        """Return what a large frame is for; ``read`` rejects it if that is not what it contains.

        Raises:
            FrameError: If the operation may not be large, or there is no such resource.
        """
        strings = _string_fields(frame)
        op, ids = self._op(strings), [text for key, text in strings if key == "id"]
        identity = ids[0] if ids else _number_id(frame)
        if op == "fragment":
            return FrameTarget(op, "", "", identity)
        payload = self._payloads[op]
        name, _ = _resource(strings, payload, op)
        return FrameTarget(op, name, payload.name, identity)

    def _op(self, strings: list[tuple[str, str]]) -> str:
        for key, text in strings:
            if key == "op" and (text in self._payloads or text == "fragment"):
                return text
        allowed = ", ".join(sorted((*self._payloads, "fragment")))
        raise FrameError(
            f"a frame of {LARGE_FRAME} bytes or more must have in its first or last {_HEAD} "
            f"an op of {allowed}"
        )

    def _decoder(self, op: str, kind: MessageType | None) -> msgspec.json.Decoder[Any]:
        key = op, "" if kind is None else kind.name
        if key not in self._decoders:
            fields: list[Any] = [("op", Literal[op])]
            if kind is None:
                fields.append(("data", _Scalar, None))
            else:
                payload = self._payloads[op]
                part = self._schema(kind)
                if payload.part == "args":  # arguments may be positional
                    part = part | list[_Scalar | list[float]]
                part = part | None | str if payload.or_text else part | None
                fields += [(payload.name, str), (payload.part, part, None)]
            fields += [(name, _Scalar, None) for name in _SCALAR_FIELDS]
            fields.append(("qos", _QoSSchema | None, None))
            envelope = msgspec.defstruct("Envelope", fields, forbid_unknown_fields=True)
            self._decoders[key] = msgspec.json.Decoder(envelope)
        return self._decoders[key]

    def _schema(self, kind: MessageType) -> Any:
        """Return a struct that accepts at least all messages of a type."""
        if kind.name not in self._schemas:
            types = {field.name: self._field_schema(field) for field in kind.fields}
            if kind.name == HEADER:
                types["seq"] = float
            elif kind.name in (TIME, DURATION):
                types = dict.fromkeys(("sec", "secs", "nanosec", "nsecs"), float)
            # A field may have the name of a Python keyword, hence the renaming.
            names = {f"f{i}": name for i, name in enumerate(types)}
            struct = msgspec.defstruct(
                "Schema",
                [(f, types[name], None) for f, name in names.items()],
                rename=names,
                forbid_unknown_fields=True,
                gc=False,
            )
            if any(f.nested and (f.repeated or f.kind in self._unbounded) for f in kind.fields):
                self._unbounded.add(kind.name)
            # A stamp may be the word "now".
            self._schemas[kind.name] = struct | str if kind.name == TIME else struct
        return self._schemas[kind.name]

    def _field_schema(self, field: Field) -> Any:
        if field.nested:
            element = self._schema(self._registry[field.kind])
        else:
            element = {"string": str, "bool": bool}.get(field.kind, float)
        if not field.repeated:
            return element
        # Arrays of bytes may be base64.
        array: Any = GenericAlias(list, (element,))
        return array | str if field.kind in BLOBS else array


def _ends(frame: str | bytes) -> list[str]:
    ends = frame[:_HEAD], frame[-_HEAD:]
    return [end if isinstance(end, str) else end.decode(errors="replace") for end in ends]


def _number_id(frame: str | bytes) -> int | None:
    found = (_NUMBER_ID.search(text) for text in _ends(frame))
    return next((int(match[1]) for match in found if match), None)


def _string_fields(frame: str | bytes) -> list[tuple[str, str]]:
    """Return keys and values of the string fields at both ends of a frame."""
    fields = []
    for key, quoted in (match for text in _ends(frame) for match in _STRING_FIELD.findall(text)):
        try:
            fields.append((key, str(msgspec.json.decode(quoted))))
        except msgspec.DecodeError:
            continue
    return fields


def _resource(
    strings: list[tuple[str, str]], payload: PayloadField, op: str
) -> tuple[str, MessageType]:
    names = [text for key, text in strings if key == payload.name]
    for name in names:
        if (kind := payload.find(name)) is not None:
            return name, kind
    if not names:
        what = f"a large frame must have its {payload.name} in its first or last {_HEAD} bytes"
        raise FrameError(f"{op}: {what}")
    raise FrameError(f"{op}: unknown {payload.name} {names[0][:80]}")
