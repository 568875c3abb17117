"""Test support: a protocol with clients, and messages of all types."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.framing.outgoing_frames import CloseFrame, OutgoingFrame
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.cbor import read_cbor
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_defaults import BLOBS, DTYPES
from teleop.rosbridge.messages.message_types import Field, Message, MessageType
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import MILLISECOND as MILLISECOND, SECOND as SECOND

ROOT = Path(__file__).resolve().parents[3]
REGISTRY = TypeRegistry([ROOT / "assets" / "farsteer_msgs"])
CHATTER = {"topic": "/chatter", "type": "std_msgs/String"}


def subscribe(topic: str = "/chatter", kind: str = "std_msgs/String", **more: Any) -> Message:
    return {"op": "subscribe", "topic": topic, "type": kind, **more}


def publish(data: Any, topic: str = "/chatter") -> Message:
    return {"op": "publish", "topic": topic, "msg": {"data": data}}


class ConnectionLog(Observer):
    """Records connections, disconnections and authentications."""

    def __init__(self, protocol: Protocol) -> None:
        self.connections: list[Connection] = []
        self.disconnections: list[Connection] = []
        self.authentications: list[tuple[int, Access | None]] = []
        protocol.observers.add(self)

    def connected(self, connection: Connection, now: int) -> None:
        self.connections.append(connection)

    def disconnected(self, connection: Connection, now: int) -> None:
        self.disconnections.append(connection)

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        self.authentications.append((connection.id, access))


def client_ids(protocol: Protocol) -> list[int]:
    """Return the ids of the connected clients."""
    return [connection.id for connection in protocol.connections]


def received_on(protocol: Protocol, topic: str, kind: str) -> list[Message]:
    """Return the messages that the host receives on a topic, to which each is added as it comes."""
    received: list[Message] = []
    protocol.topics.subscribe(topic, kind, lambda client, message, now: received.append(message))
    return received


class Wire:
    """A protocol with clients, without sockets."""

    def __init__(
        self, clients: int = 1, limits: ClientLimits | None = None, **options: Any
    ) -> None:
        self.protocol = Protocol(REGISTRY, limits=limits, **options)
        self.now = SECOND
        self.clients = [self.protocol.connect(self.now) for _ in range(clients)]
        self._received: dict[int, list[Any]] = {}

    def send(self, operation: object, client: int = 0) -> None:
        """Send an operation as the client with this index."""
        self.raw(json.dumps(operation), client)

    def raw(self, frame: str | bytes, client: int = 0) -> None:
        """Send a frame as a client."""
        self.protocol.receive(self.clients[client], frame, self.now)

    def wait(self, milliseconds: float) -> None:
        """Advance the time."""
        self.now += int(milliseconds * MILLISECOND)
        self.protocol.timers.tick(self.now)

    def outputs(self, client: int = 0) -> list[Any]:
        """Return the frames sent to a client since the last call."""
        for other, output in self.protocol.connections.drain():
            self._received.setdefault(other, []).append(output)
        return self._received.pop(self.clients[client], [])

    def received(self, client: int = 0) -> list[Any]:
        """Return the operations sent to a client since the last call."""
        return [decoded(output) for output in self.outputs(client)]

    def ask(self, operation: object, client: int = 0) -> list[Any]:
        """Send an operation as a client; return what it receives."""
        self.received(client)
        self.send(operation, client)
        return self.received(client)


def decoded(output: OutgoingFrame | CloseFrame) -> Any:
    """Return an output as its receiver decodes it."""
    if isinstance(output, CloseFrame):
        return output
    return read_cbor(output.payload) if output.binary else json.loads(output.text)


def error(text: str, identity: object = None) -> dict[str, object]:
    """Return the status operation of an error."""
    status: dict[str, object] = {"op": "status", "level": "error", "msg": text}
    return status if identity is None else {**status, "id": identity}


def client_type_registry() -> TypeRegistry:
    """Return the standard types and, for each primitive, a type with a field of each form.

    The standard types contain no bounded string array, for example; ``forms/...`` contain them all.
    """
    registry = TypeRegistry([ROOT / "assets" / "farsteer_msgs"])
    for primitive in PRIMITIVES:
        registry.add(f"forms/{primitive.title()}", _field_of_each_form(primitive))
    registry.add("forms/Inner", "int16 number\nstring<=4 text\nbuiltin_interfaces/Time time")
    registry.add("forms/Outer", _field_of_each_form("forms/Inner"))
    registry.add("forms/Outermost", _field_of_each_form("forms/Outer"))
    registry.add("forms/Empty", "")
    return registry


PRIMITIVES = (
    *("bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16"),
    *("int32", "uint32", "int64", "uint64", "string"),
)


def _field_of_each_form(type: str) -> str:
    return f"{type} one\n{type}[] sequence\n{type}[3] array\n{type}[<=2] bounded"


FORMS = client_type_registry()
FORM_NAMES = sorted(name for name in FORMS if name.startswith("forms/"))


@st.composite
def typed_messages(draw: st.DrawFn, *, finite: bool = True) -> tuple[MessageType, Any]:
    """Types of ``FORMS`` and messages of them; half of the types are those of all forms."""
    name = draw(st.one_of(st.sampled_from(FORM_NAMES), st.sampled_from(sorted(FORMS))))
    return FORMS[name], draw(messages(FORMS[name], finite=finite))


@cache
def messages(kind: MessageType | str, *, finite: bool = True) -> st.SearchStrategy[Any]:
    """Messages of a type, in the forms in which clients send them."""
    kind = FORMS[kind] if isinstance(kind, str) else kind
    fields = {field.name: _values(field, finite) for field in kind.fields}
    return st.fixed_dictionaries({}, optional=fields)


def whole(kind: MessageType | str, partial: object) -> Any:
    """Return a message with all fields."""
    return complete(FORMS, kind, partial, finite=False)


def _values(field: Field, finite: bool) -> st.SearchStrategy[Any]:
    if not field.repeated:
        return _elements(field, finite)
    low, high = (field.size, field.size) if field.size else (0, field.bound or 4)
    if field.kind in BLOBS:
        return st.binary(min_size=low, max_size=high)
    return st.lists(_elements(field, finite), min_size=low, max_size=high)


def _elements(field: Field, finite: bool) -> st.SearchStrategy[Any]:
    if field.nested:
        return messages(field.kind, finite=finite)
    if field.kind == "string":
        text = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
        return text.filter(lambda t: not field.longest or len(t.encode()) <= field.longest)
    if field.kind == "bool":
        return st.booleans()
    dtype = DTYPES[field.kind]
    if dtype.kind == "f":
        single = dtype.itemsize == 4
        return st.floats(
            width=32 if single else 64, allow_nan=not finite, allow_infinity=not finite
        )
    bits = dtype.itemsize * 8
    if dtype.kind == "u":
        return st.integers(0, 2**bits - 1)
    return st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def extreme(kind: MessageType) -> Any:
    """Return a message of a type with extreme values in all fields."""
    return {field.name: _extreme_value(field) for field in kind.fields}


def _extreme_value(field: Field) -> Any:
    if not field.repeated:
        return _extreme_elements(field)[0]
    size = field.size or field.bound or 2
    elements = _extreme_elements(field)
    values = [elements[i % len(elements)] for i in range(size)]
    return bytes(values) if field.kind in BLOBS else values


def _extreme_elements(field: Field) -> list[Any]:
    if field.nested:
        return [extreme(FORMS[field.kind])]
    if field.kind == "string":
        return ['"\\', "é𝄞"[: field.longest // 4 or 2]]
    if field.kind == "bool":
        return [True, False]
    dtype = DTYPES[field.kind]
    if dtype.kind == "f":
        limits = np.finfo(dtype)
        return [float(limits.max), -float(limits.tiny), 0.1 if field.kind == "float64" else 0.5]
    return [int(np.iinfo(dtype).min), int(np.iinfo(dtype).max), 1]
