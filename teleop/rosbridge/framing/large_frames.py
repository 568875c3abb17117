"""Large frames, judged by the types of what they carry: what does not fit is never built.

JSON of a megabyte can mean half a million Python objects. So a large frame is first held against the
type of its topic, service or action; msgspec does that as it reads and stops at what does not fit.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import GenericAlias
from typing import Any, Final, Literal, TypeAlias

import msgspec

from teleop.rosbridge.errors import FrameError
from teleop.rosbridge.framing.json_frames import gc_paused
from teleop.rosbridge.messages.message_completion import BLOBS, FREE
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
"""Length of a frame from which on it is judged before it is read; below, reading takes less time."""

_ENDS: Final = 1024
"""Characters at either end in which a large frame says what it is; all but one field are small."""

_LEAST: Final = 8
"""Characters of the shortest message in a row of them, with a field in it: ``{"x":1},``."""

_WORD: Final = re.compile(r'"(\w+)"\s{0,9}:\s{0,9}("(?:[^"\\]|\\.)*")')
"""A key of an object, and a string."""

_Scalar: TypeAlias = str | float | bool | None


class _Quality(msgspec.Struct, gc=False, forbid_unknown_fields=True):
    history: _Scalar = None
    depth: _Scalar = None
    reliability: _Scalar = None
    durability: _Scalar = None
    deadline: _Scalar | dict[Literal["sec", "secs", "nanosec", "nsecs"], float] = None
    lifespan: _Scalar | dict[Literal["sec", "secs", "nanosec", "nsecs"], float] = None
    liveliness: _Scalar = None


_REST: Final = (
    *("id", "type", "action_type", "latch", "queue_size", "queue_length", "throttle_rate"),
    *("fragment_size", "compression", "timeout", "feedback", "result", "status", "num", "total"),
)
"""Fields of operations that hold one value."""


@dataclass(frozen=True, slots=True)
class PayloadField:
    """Where in an operation there may be much."""

    name: str
    """The field that says what it is about: ``topic``."""

    part: str
    """The field that may be large: ``msg``."""

    kind: Callable[[str], MessageType | None]
    """Returns the type of that by what the first one says; None if there is no such thing."""

    or_text: bool = False
    """Whether there may be a text in its place: that of an error."""


class LargeFrameReader:
    """Reads large frames."""

    def __init__(self, registry: TypeRegistry, places: Mapping[str, PayloadField]) -> None:
        """Take the operations that may be large; a ``fragment`` always may."""
        self._registry = registry
        self._places = places
        self._structs: dict[str, Any] = {}
        self._open: set[str] = set()
        """Types whose messages may hold any number of others."""

        self._decoders: dict[tuple[str, str], msgspec.json.Decoder[Any]] = {}

    def read(self, frame: str | bytes) -> Message:
        """Return the operation in a large frame, of which there is one.

        Raises:
            FrameError: If it is none that may be large, or what it carries does not fit its type.
        """
        words = _words(frame)
        op = next((text for key, text in words if key == "op" and self._may(text)), None)
        if op is None:
            allowed = ", ".join(sorted((*self._places, "fragment")))
            raise FrameError(
                f"a frame of {LARGE_FRAME} bytes or more says within its first or last {_ENDS} that its "
                f"op is one of {allowed}"
            )
        name = None
        try:
            if op == "fragment":
                decoder = self._decoder(op, None)
            else:
                place = self._places[op]
                name, kind = _about(words, place, op)
                decoder = self._decoder(op, kind)
                parts = frame.count("{") if isinstance(frame, str) else frame.count(b"{")
                if kind.name in self._open and parts > FREE + len(frame) // _LEAST:
                    raise FrameError(f"{op}: {place.part} leaves out more than it says")
            said = decoder.decode(frame)
            # What is read twice must have said the same twice.
            if name is not None and getattr(said, self._places[op].name) != name:
                raise FrameError(f"{op}: it says twice what it is about")
            with gc_paused(len(frame)):
                return dict(msgspec.json.decode(frame))
        except RecursionError:
            raise FrameError("the JSON is nested too deeply") from None
        except msgspec.ValidationError as error:
            raise FrameError(f"{op}: {str(error)[:200]}") from None
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise FrameError(f"not JSON: {str(error)[:200]}") from None

    def _may(self, op: str) -> bool:
        return op in self._places or op == "fragment"

    def _decoder(self, op: str, kind: MessageType | None) -> msgspec.json.Decoder[Any]:
        key = op, "" if kind is None else kind.name
        if key not in self._decoders:
            fields: list[Any] = [("op", Literal[op])]
            if kind is None:
                fields.append(("data", _Scalar, None))
            else:
                place = self._places[op]
                part = self._struct(kind)
                if place.part == "args":  # which may come without names
                    part = part | list[_Scalar | list[float]]
                part = part | None | str if place.or_text else part | None
                fields += [(place.name, str), (place.part, part, None)]
            fields += [(name, _Scalar, None) for name in _REST]
            fields.append(("qos", _Quality | None, None))
            envelope = msgspec.defstruct("Envelope", fields, forbid_unknown_fields=True)
            self._decoders[key] = msgspec.json.Decoder(envelope)
        return self._decoders[key]

    def _struct(self, kind: MessageType) -> Any:
        """Return a struct that takes at least all messages of a type."""
        if kind.name not in self._structs:
            names = {field.name: self._value(field) for field in kind.fields}
            if kind.name == HEADER:
                names["seq"] = float
            elif kind.name in (TIME, DURATION):
                names = dict.fromkeys(("sec", "secs", "nanosec", "nsecs"), float)
            # Fields may be called what Python has other uses for.
            known = {f"f{i}": name for i, name in enumerate(names)}
            struct = msgspec.defstruct(
                "Shape",
                [(f, names[name], None) for f, name in known.items()],
                rename=known,
                forbid_unknown_fields=True,
                gc=False,
            )
            if any(f.nested and (f.repeated or f.kind in self._open) for f in kind.fields):
                self._open.add(kind.name)
            # A stamp may be the word "now".
            self._structs[kind.name] = struct | str if kind.name == TIME else struct
        return self._structs[kind.name]

    def _value(self, field: Field) -> Any:
        if field.nested:
            element = self._struct(self._registry[field.kind])
        else:
            element = {"string": str, "bool": bool}.get(field.kind, float)
        if not field.repeated:
            return element
        # Bytes may be base64.
        row: Any = GenericAlias(list, (element,))
        return row | str if field.kind in BLOBS else row


def _words(frame: str | bytes) -> list[tuple[str, str]]:
    """Return the keys at a frame's ends whose values are strings, and these."""
    ends = frame[:_ENDS], frame[-_ENDS:]
    texts = [end if isinstance(end, str) else end.decode(errors="replace") for end in ends]
    words = []
    for key, quoted in (found for text in texts for found in _WORD.findall(text)):
        try:
            words.append((key, str(msgspec.json.decode(quoted))))
        except msgspec.DecodeError:
            continue
    return words


def _about(words: list[tuple[str, str]], place: PayloadField, op: str) -> tuple[str, MessageType]:
    names = [text for key, text in words if key == place.name]
    for name in names:
        if (kind := place.kind(name)) is not None:
            return name, kind
    if not names:
        what = f"a large frame says its {place.name} within its first or last {_ENDS} bytes"
        raise FrameError(f"{op}: {what}")
    raise FrameError(f"{op}: there is no {place.name} {names[0][:80]} here")
