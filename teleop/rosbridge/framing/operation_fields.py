"""Reading the fields of operations, in the many ways in which clients write them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from teleop.rosbridge.errors import OperationError

Operation: TypeAlias = dict[str, Any]
"""A JSON object with an ``op``."""

_NAME: Final = re.compile(r"[A-Za-z0-9_/~.\-]{1,256}")
"""Names of topics and services: ROS's, and the few more characters that others let pass."""

_LONGEST_ID: Final = 256
_LARGEST: Final = 2**31 - 1
"""What C# writes for "no bound"."""


def identity(operation: Operation) -> str | int | None:
    """Return the ``id``, or None if there is none.

    Raises:
        OperationError: If it is neither a short string nor a whole number.
    """
    value = operation.get("id")
    if value is None:
        return None
    if type(value) not in (str, int) or len(str(value)) > _LONGEST_ID:
        raise OperationError("an id is a short string or a whole number")
    checked: str | int = value
    return checked


def named(name: str, what: str) -> str:
    """Return a name of a topic, service or action, or raise OperationError."""
    if not _NAME.fullmatch(name) or not name.strip("/"):
        raise OperationError(f"{name[:80]!r} is no name of a {what}")
    return name


def text(operation: Operation, key: str) -> str:
    """Return a string that must be there."""
    value = operation.get(key)
    if not isinstance(value, str):
        article = "an" if key[0] in "aeiou" else "a"
        raise OperationError(f"it needs {article} {key}, which is a string")
    return value


def name(operation: Operation, key: str) -> str:
    """Return a name that must be there; ``key`` says of what."""
    return named(text(operation, key), key)


def count(operation: Operation, key: str) -> int:
    """Return a whole number, 0 if there is none; some clients write it as a float, or as null."""
    value = operation.get(key)
    if value is None:
        return 0
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise OperationError(f"{key} must be a number")
    return int(min(max(value, 0), 2**31))


def fragment_size(operation: Operation) -> int:
    """Return the largest fragment the client wants [bytes]; 0 for whole messages."""
    size = count(operation, "fragment_size")
    return 0 if size >= _LARGEST else size


def seconds(operation: Operation, key: str) -> float | None:
    """Return a time [s]; None if there is none."""
    value = operation.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise OperationError(f"{key} must be a number of seconds")
    return float(min(max(value, -1), 1e9))


@dataclass(frozen=True, slots=True)
class QoS:
    """What of a ``qos`` makes a difference here: everything arrives, and in order, anyway."""

    depth: int | None = None
    """Messages that may wait, 0 for all; None if it does not say."""

    transient: bool = False
    """Whether a publisher's last message is kept for who comes later."""

    volatile: bool = False
    """Whether a subscriber wants nothing of what was before."""


def quality(operation: Operation) -> QoS:
    """Return what the ``qos`` of an operation asks for, in the terms of ROS 2."""
    qos = operation.get("qos")
    if qos is None:
        return QoS()
    if not isinstance(qos, dict):
        raise OperationError("a qos is an object")
    depth = None if qos.get("depth") is None else count(qos, "depth")
    durability = qos.get("durability")
    return QoS(
        0 if qos.get("history") == "keep_all" else depth,
        durability == "transient_local",
        durability == "volatile",
    )
