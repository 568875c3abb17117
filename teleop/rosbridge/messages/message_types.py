"""Descriptions of message, service and action types.

A message itself is a plain dict, as in ROS's JSON. ``type_registry`` has the known types,
``message_completion`` validates messages, ``json_cbor_codec`` and ``ros_serialization`` encode them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

Message: TypeAlias = dict[str, Any]
"""Maps field names to numbers, strings, arrays, lists and nested messages."""

TIME: Final = "builtin_interfaces/msg/Time"
DURATION: Final = "builtin_interfaces/msg/Duration"
HEADER: Final = "std_msgs/msg/Header"


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message type."""

    name: str
    """Name in the definition."""

    kind: str
    """Primitive type as in ``.msg`` text (``float64``), or canonical name of a message type."""

    repeated: bool = False
    """Whether it is an array or a sequence."""

    size: int = 0
    """Number of elements of a fixed array; 0 for a sequence."""

    bound: int = 0
    """Largest number of elements of a sequence; 0 for unbounded."""

    longest: int = 0
    """Largest size of a string [bytes]; 0 for unbounded."""

    @property
    def nested(self) -> bool:
        """Whether its elements are messages."""
        return "/" in self.kind

    @property
    def text(self) -> str:
        """The type as in ``.msg`` text, for error messages."""
        kind = short_name(self.kind) if self.nested else self.kind
        return f"{kind}[{self.size or ''}]" if self.repeated else kind


@dataclass(frozen=True, slots=True)
class MessageType:
    """Fields and constants of a message type."""

    name: str
    """Canonical name, ``pkg/msg/Type``."""

    fields: tuple[Field, ...]
    """Fields in the order of the definition."""

    constants: tuple[tuple[str, str], ...] = ()
    """Names and values of the constants, as text."""

    @property
    def names(self) -> frozenset[str]:
        """Names of the fields."""
        return frozenset(field.name for field in self.fields)


@dataclass(frozen=True, slots=True)
class ServiceType:
    """Request and response of a service type."""

    name: str
    """Canonical name, ``pkg/srv/Type``."""

    request: MessageType
    response: MessageType


@dataclass(frozen=True, slots=True)
class ActionType:
    """Goal, result and feedback of an action type."""

    name: str
    """Canonical name, ``pkg/action/Type``."""

    goal: MessageType
    result: MessageType
    feedback: MessageType


def short_name(name: str) -> str:
    """Return ``pkg/Type`` for ``pkg/msg/Type``: the name in ROS 1, and in error messages."""
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}"
