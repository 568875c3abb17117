"""Definitions of message types as ``rosapi_msgs/TypeDef``."""

from __future__ import annotations

from teleop.rosbridge.messages.message_defaults import default_value
from teleop.rosbridge.messages.message_types import Field, Message, MessageType, short_name
from teleop.rosbridge.messages.type_registry import TypeRegistry


def typedefs(registry: TypeRegistry, root: MessageType) -> list[Message]:
    """Return a ``rosapi_msgs/TypeDef`` of a type and of each nested type, itself first."""
    found: dict[str, MessageType] = {}
    _collect(registry, root, found)
    return [_typedef(registry, kind) for kind in found.values()]


def _typedef(registry: TypeRegistry, kind: MessageType) -> Message:
    return {
        "type": short_name(kind.name),
        "fieldnames": [field.name for field in kind.fields],
        "fieldtypes": [short_name(f.kind) if f.nested else f.kind for f in kind.fields],
        # In rosapi, -1 stands for a single value and 0 for a sequence.
        "fieldarraylen": [field.size if field.repeated else -1 for field in kind.fields],
        "examples": [_example(registry, kind, field) for field in kind.fields],
        "constnames": [name for name, _ in kind.constants],
        "constvalues": [value for _, value in kind.constants],
    }


def _example(registry: TypeRegistry, kind: MessageType, field: Field) -> str:
    if field.repeated:
        return "[]"
    if field.nested:
        return "{}"
    return str(default_value(registry, kind, field))


def _collect(registry: TypeRegistry, kind: MessageType, found: dict[str, MessageType]) -> None:
    if kind.name not in found:
        found[kind.name] = kind
        for field in kind.fields:
            if field.nested:
                _collect(registry, registry[field.kind], found)
