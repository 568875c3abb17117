"""Messages in ROS's own bytes, and definitions in its own text, for the compression ``cbor-raw``."""

from __future__ import annotations

from struct import error
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.messages.definition_parser import PADDING
from teleop.rosbridge.messages.message_completion import BLOBS, DTYPES, default_value
from teleop.rosbridge.messages.message_types import HEADER, Field, Message, MessageType
from teleop.rosbridge.messages.type_registry import TypeRegistry

RosVersion: TypeAlias = Literal["ros1", "ros2"]
"""Which ROS is spoken where the two differ."""

_SEQ: Final = {"ros1": {"seq": 0}, "ros2": {}}
"""What a header has in ROS 1 only; no client has ever counted on its number."""


class RosSerializer:
    """Writes messages in the bytes of ROS 1, or of ROS 2 (CDR, little-endian)."""

    def __init__(self, registry: TypeRegistry, flavour: RosVersion) -> None:
        self._registry = registry
        self._flavour: RosVersion = flavour
        self._stores: dict[str, tuple[int, Typestore]] = {}
        self._texts: dict[str, tuple[int, str]] = {}
        """Definitions by type, each with the registry's version: one takes up to a millisecond."""

    def bytes(self, kind: MessageType, message: Message) -> bytes:
        """Return a completed message's bytes.

        Raises:
            MessageError: If the message does not fit its type.
        """
        store = self._store(kind)
        try:
            made = self._made(store, kind, message)
            if self._flavour == "ros1":
                return bytes(store.serialize_ros1(made, kind.name))
            return bytes(store.serialize_cdr(made, kind.name, little_endian=True))
        except (TypeError, ValueError, OverflowError, KeyError, AttributeError, error) as why:
            raise MessageError(f"cannot serialise a {kind.name}: {why}") from why

    def definition(self, kind: MessageType) -> str:
        """Return the definition of a type and of all it is made of, as rosbags and bag files do."""
        version, text = self._texts.get(kind.name, (-1, ""))
        if version != self._registry.version:
            ros = 1 if self._flavour == "ros1" else 2
            whole = self._store(kind).generate_msgdef(kind.name, ros_version=ros)[0]
            text = "".join(line for line in whole.splitlines(True) if PADDING not in line)
            if ros == 2 and kind.constants and not kind.fields:
                # Readers of constants alone fail, such as Foxglove's; and this is what is sent.
                text += f"uint8 {PADDING}\n"
            self._texts[kind.name] = self._registry.version, text
        return text

    def _store(self, kind: MessageType) -> Typestore:
        """Return a store of the type and its parts; a type may be replaced, a store's may not."""
        version, store = self._stores.get(kind.name, (-1, None))
        if store is None or version != self._registry.version:
            store = get_typestore(Stores.EMPTY)
            found: dict[str, Any] = {}
            self._collect(kind.name, found)
            store.register({name: d for name, d in found.items() if name not in store.fielddefs})
            self._stores[kind.name] = self._registry.version, store
        return store

    def _collect(self, name: str, found: dict[str, Any]) -> None:
        if name in found:
            return
        constants, fields = self._registry.definition(name)
        if self._flavour == "ros1":
            fields = [(field, _unbound(of)) for field, of in fields if field != PADDING]
            if name == HEADER:
                fields = get_typestore(Stores.ROS1_NOETIC).fielddefs[HEADER][1]
        if self._flavour == "ros2" and not fields:
            fields = [(PADDING, (Nodetype.BASE, ("uint8", 0)))]
        found[name] = constants, fields
        for field in self._registry[name].fields:
            if field.nested:
                self._collect(field.kind, found)

    def _made(self, store: Typestore, kind: MessageType, message: Message) -> Any:
        """Return a message as the object that the store writes."""
        values: dict[str, Any] = {}
        if kind.name == HEADER:
            values.update(_SEQ[self._flavour])
        for field in kind.fields:
            value = message.get(field.name)
            if value is None:
                value = default_value(self._registry, kind, field)
            values[field.name] = self._value(store, field, value)
        made: Any = store.types[kind.name]
        if any(name == PADDING for name, _ in store.fielddefs[kind.name][1]):
            values[PADDING] = 0
        return made(**values)

    def _value(self, store: Typestore, field: Field, value: Any) -> Any:
        if field.nested:
            kind = self._registry[field.kind]
            if field.repeated:
                return [self._made(store, kind, part) for part in value]
            return self._made(store, kind, value)
        if field.kind == "byte" and not field.repeated:
            return (value + 128) % 256 - 128  # the store's is signed, in the same bits
        if not field.repeated or field.kind == "string":
            return value
        if field.kind in BLOBS and isinstance(value, bytes | bytearray | memoryview):
            return np.frombuffer(value, np.uint8)
        return np.asarray(value, np.bool_ if field.kind == "bool" else DTYPES[field.kind])


def _unbound(description: Any) -> Any:
    """Return a field's type without what only ROS 2 has: bounds, and strings of wide characters."""
    node, content = description
    if node == Nodetype.BASE:
        return (node, ("string", 0)) if content[0] in ("string", "wstring") else description
    if node == Nodetype.NAME:
        return description
    element, size = content
    return node, (_unbound(element), size if node == Nodetype.ARRAY else 0)
