"""Records of rejected operations, for logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Self

_MAX_LENGTH: Final = 256
"""Characters of a name that are kept, which bounds the size of a record."""

_NAME_FIELDS: Final = ("topic", "service", "action")


@dataclass(frozen=True, slots=True)
class Refusal:
    """An operation that was rejected, or a frame that could not be read."""

    op: str
    """The operation; empty for an unreadable frame or one that exceeds a rate."""

    name: str
    """Topic, service or action; empty if the operation has none."""

    why: str
    """The reason."""

    @classmethod
    def of(cls, operation: Mapping[str, Any], why: str) -> Self:
        """Return the record of an operation with any content."""
        names = (operation[key] for key in _NAME_FIELDS if isinstance(operation.get(key), str))
        op = operation.get("op")
        return cls(
            op[:_MAX_LENGTH] if isinstance(op, str) else "",
            next(names, "")[:_MAX_LENGTH],
            why[: 2 * _MAX_LENGTH],
        )
