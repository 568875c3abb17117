"""Default values of message fields, and the in-memory form of arrays of numbers."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from teleop.rosbridge.messages.message_types import Field, Message, MessageType
from teleop.rosbridge.messages.type_registry import TypeRegistry

DTYPES: Final[dict[str, np.dtype[Any]]] = {
    "int8": np.dtype("i1"),
    "uint8": np.dtype("u1"),
    "char": np.dtype("u1"),
    "byte": np.dtype("u1"),
    "int16": np.dtype("<i2"),
    "uint16": np.dtype("<u2"),
    "int32": np.dtype("<i4"),
    "uint32": np.dtype("<u4"),
    "int64": np.dtype("<i8"),
    "uint64": np.dtype("<u8"),
    "float32": np.dtype("<f4"),
    "float64": np.dtype("<f8"),
}
"""numpy types of arrays of numbers, by the primitive in the definition."""

BLOBS: Final = ("uint8", "char")
"""Primitives whose arrays are ``bytes``, and base64 in JSON, as in rosbridge."""

_DEFAULTS: Final = {("geometry_msgs/msg/Quaternion", "w"): 1.0}
"""Defaults in the definitions of ROS 2, which the type store of rosbags does not keep."""


def default(registry: TypeRegistry, kind: MessageType) -> Message:
    """Return a message whose fields all have their default values."""
    return {field.name: default_value(registry, kind, field) for field in kind.fields}


def default_value(registry: TypeRegistry, kind: MessageType, field: Field) -> Any:
    """Return the value of a field that is not given."""
    if field.repeated:
        if field.kind in BLOBS:
            return bytes(field.size)
        if field.kind in DTYPES:
            return np.zeros(field.size, DTYPES[field.kind])
        return [_default_element(registry, kind, field) for _ in range(field.size)]
    return _default_element(registry, kind, field)


def _default_element(registry: TypeRegistry, kind: MessageType, field: Field) -> Any:
    if field.nested:
        return default(registry, registry[field.kind])
    if field.kind == "string":
        return ""
    if field.kind == "bool":
        return False
    if field.kind.startswith("float"):
        return _DEFAULTS.get((kind.name, field.name), 0.0)
    return 0
