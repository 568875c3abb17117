"""Serialisation of ROS 1 and ROS 2 (CDR), and definition texts, for the compression ``cbor-raw``."""

from __future__ import annotations

from struct import error
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.messages.definition_parser import PADDING
from teleop.rosbridge.messages.message_defaults import BLOBS, DTYPES, default_value
from teleop.rosbridge.messages.message_types import HEADER, Field, Message, MessageType
from teleop.rosbridge.messages.type_registry import TypeRegistry

RosVersion: TypeAlias = Literal["ros1", "ros2"]
"""The ROS whose conventions are followed where the two differ."""

_SEQ: Final = {"ros1": {"seq": 0}, "ros2": {}}
"""Header fields of ROS 1 only; the sequence number is always zero."""


class RosSerializer:
    """Serialises messages as ROS 1 or ROS 2 (CDR, little-endian) does."""

    def __init__(self, registry: TypeRegistry, ros_version: RosVersion) -> None:
        self._registry = registry
        self._ros_version: RosVersion = ros_version
        self._stores: dict[str, tuple[int, Typestore]] = {}
        self._texts: dict[str, tuple[int, str]] = {}
        """Definitions by type, with the registry's version; generating one takes up to 1 ms."""

    def bytes(self, kind: MessageType, message: Message) -> bytes:
        """Return the serialised bytes of a completed message.

        Raises:
            MessageError: If the message does not fit its type.
        """
        store = self._store(kind)
        try:
            made = self._object(store, kind, message)
            if self._ros_version == "ros1":
                return bytes(store.serialize_ros1(made, kind.name))
            return bytes(store.serialize_cdr(made, kind.name, little_endian=True))
        except (TypeError, ValueError, OverflowError, KeyError, AttributeError, error) as why:
            raise MessageError(f"cannot serialise a {kind.name}: {why}") from why

    def definition(self, kind: MessageType) -> str:
        """Return the definition of a type and its nested types, in the format of bag files."""
        version, text = self._texts.get(kind.name, (-1, ""))
        if version != self._registry.version:
            ros = 1 if self._ros_version == "ros1" else 2
            whole = self._store(kind).generate_msgdef(kind.name, ros_version=ros)[0]
            text = "".join(line for line in whole.splitlines(True) if PADDING not in line)
            if ros == 2 and kind.constants and not kind.fields:
                # Parsers such as Foxglove's fail on constants alone; this is the field that is sent.
                text += f"uint8 {PADDING}\n"
            self._texts[kind.name] = self._registry.version, text
        return text

    def _store(self, kind: MessageType) -> Typestore:
        """Return a type store of the type and its nested types, rebuilt if the registry changed."""
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
        if self._ros_version == "ros1":
            fields = [(field, _unbound(of)) for field, of in fields if field != PADDING]
            if name == HEADER:
                fields = get_typestore(Stores.ROS1_NOETIC).fielddefs[HEADER][1]
        if self._ros_version == "ros2" and not fields:
            fields = [(PADDING, (Nodetype.BASE, ("uint8", 0)))]
        found[name] = constants, fields
        for field in self._registry[name].fields:
            if field.nested:
                self._collect(field.kind, found)

    def _object(self, store: Typestore, kind: MessageType, message: Message) -> Any:
        """Return a message as the object that the type store serialises."""
        values: dict[str, Any] = {}
        if kind.name == HEADER:
            values.update(_SEQ[self._ros_version])
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
                return [self._object(store, kind, part) for part in value]
            return self._object(store, kind, value)
        if field.kind == "byte" and not field.repeated:
            return (value + 128) % 256 - 128  # signed in the type store, with the same bits
        if not field.repeated or field.kind == "string":
            return value
        if field.kind in BLOBS and isinstance(value, bytes | bytearray | memoryview):
            return np.frombuffer(value, np.uint8)
        return np.asarray(value, np.bool_ if field.kind == "bool" else DTYPES[field.kind])


def _unbound(description: Any) -> Any:
    """Return a field's type without bounds and wide strings, which only ROS 2 has."""
    node, content = description
    if node == Nodetype.BASE:
        return (node, ("string", 0)) if content[0] in ("string", "wstring") else description
    if node == Nodetype.NAME:
        return description
    element, size = content
    return node, (_unbound(element), size if node == Nodetype.ARRAY else 0)
