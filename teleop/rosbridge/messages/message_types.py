"""What messages, services and actions are made of.

A message itself is a plain dict in the shape of ROS's JSON. Which types there are is in
``registry.py``, what fills and checks a message in ``messages.py``, what writes one in ``codec.py``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

Message: TypeAlias = dict[str, Any]
"""Field names to numbers, strings, arrays, lists and further messages."""

TIME: Final = "builtin_interfaces/msg/Time"
DURATION: Final = "builtin_interfaces/msg/Duration"
HEADER: Final = "std_msgs/msg/Header"


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message type."""

    name: str
    """As in the definition."""

    kind: str
    """A primitive as in ``.msg`` text (``float64``), or the canonical name of a message type."""

    repeated: bool = False
    """Whether it is an array or a sequence."""

    size: int = 0
    """Elements of a fixed array; 0 for a sequence."""

    bound: int = 0
    """Most elements of a sequence; 0 for no bound."""

    longest: int = 0
    """Most bytes of a string; 0 for no bound."""

    @property
    def nested(self) -> bool:
        """Whether it is made of messages."""
        return "/" in self.kind

    @property
    def text(self) -> str:
        """The type as in ``.msg`` text, as messages to people use it."""
        kind = short_name(self.kind) if self.nested else self.kind
        return f"{kind}[{self.size or ''}]" if self.repeated else kind


@dataclass(frozen=True, slots=True)
class MessageType:
    """What a message is made of."""

    name: str
    """Canonical: ``pkg/msg/Type``."""

    fields: tuple[Field, ...]
    """In the order of the definition."""

    constants: tuple[tuple[str, str], ...] = ()
    """Names and values, as text."""

    @property
    def names(self) -> frozenset[str]:
        """Names of the fields."""
        return frozenset(field.name for field in self.fields)


@dataclass(frozen=True, slots=True)
class ServiceType:
    """What a service takes and gives."""

    name: str
    """Canonical: ``pkg/srv/Type``."""

    request: MessageType
    response: MessageType


@dataclass(frozen=True, slots=True)
class ActionType:
    """What an action is asked for, gives in the end, and tells meanwhile."""

    name: str
    """Canonical: ``pkg/action/Type``."""

    goal: MessageType
    result: MessageType
    feedback: MessageType


def short_name(name: str) -> str:
    """Return ``pkg/Type`` of ``pkg/msg/Type``: the name ROS 1 has, and people read."""
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}"
