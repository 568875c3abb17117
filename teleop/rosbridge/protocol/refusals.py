"""What clients ask for and are not given, for whoever keeps a record of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Self, TypeAlias

_LONGEST: Final = 256
"""Characters of a name that are kept; whatever a client sends, a record of it is short."""

_NAMES: Final = ("topic", "service", "action")


@dataclass(frozen=True, slots=True)
class Refusal:
    """One operation that was not done, or a frame that was not read."""

    op: str
    """The operation; empty if the frame was no operation, or one too many."""

    name: str
    """Topic, service or action; empty if it has none."""

    why: str

    @classmethod
    def of(cls, operation: Mapping[str, Any], why: str) -> Self:
        """Return the refusal of an operation, whatever stands in it."""
        named = (operation[key] for key in _NAMES if isinstance(operation.get(key), str))
        op = operation.get("op")
        return cls(
            op[:_LONGEST] if isinstance(op, str) else "",
            next(named, "")[:_LONGEST],
            why[: 2 * _LONGEST],
        )


Refused: TypeAlias = Callable[[int, Refusal], None]
"""Is told of a client, and of what it was refused."""
