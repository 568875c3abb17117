"""Checked access to the fields of operations, in the variants that clients send."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from teleop.rosbridge.errors import OperationError

Operation: TypeAlias = dict[str, Any]
"""A JSON object with an ``op``."""

_NAME: Final = re.compile(r"[A-Za-z0-9_/~.\-]{1,256}")
"""Names of topics and services: those of ROS, and a few more characters that others accept."""

_MAX_ID_LENGTH: Final = 256
MIN_FRAGMENT: Final = 512
"""Smallest fragment that a client is sent on request [bytes]; smaller ones cost more than they hold."""

_INT32_MAX: Final = 2**31 - 1
"""Value that C# clients send for "no limit"."""


def identity(operation: Operation) -> str | int | None:
    """Return the ``id``, or None without one.

    Raises:
        OperationError: If it is neither a short string nor an integer.
    """
    value = operation.get("id")
    if value is None:
        return None
    if type(value) not in (str, int) or len(str(value)) > _MAX_ID_LENGTH:
        raise OperationError("id must be a short string or an integer")
    checked: str | int = value
    return checked


def check_name(name: str, what: str) -> str:
    """Return a valid name of a topic, service or action, or raise OperationError."""
    if not _NAME.fullmatch(name) or not name.strip("/"):
        raise OperationError(f"{name[:80]!r} is not a valid {what} name")
    return name


def text(operation: Operation, key: str) -> str:
    """Return a required string."""
    value = operation.get(key)
    if not isinstance(value, str):
        raise OperationError(f"{key} must be given as a string")
    return value


def name(operation: Operation, key: str) -> str:
    """Return a required name; ``key`` is also its kind, such as ``topic``."""
    return check_name(text(operation, key), key)


def count(operation: Operation, key: str) -> int:
    """Return a non-negative integer, 0 without one; some clients send a float or null."""
    value = operation.get(key)
    if value is None:
        return 0
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise OperationError(f"{key} must be a number")
    return int(min(max(value, 0), 2**31))


def fragment_size(operation: Operation) -> int:
    """Return the requested fragment size, raised to the least [bytes]; 0 for whole messages."""
    size = count(operation, "fragment_size")
    return 0 if size == 0 or size >= _INT32_MAX else max(size, MIN_FRAGMENT)


def seconds(operation: Operation, key: str) -> float | None:
    """Return a duration [s]; None without one."""
    value = operation.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise OperationError(f"{key} must be a number of seconds")
    return float(min(max(value, -1), 1e9))


@dataclass(frozen=True, slots=True)
class QoS:
    """The policies of a ``qos`` that have an effect here: delivery is always reliable and ordered."""

    depth: int | None = None
    """Queue length in messages, 0 for unlimited; None if it is not given."""

    keep_all: bool = False
    """Whether a subscriber wants every message, however late."""

    transient: bool = False
    """Whether the last message of a publisher is kept for later subscribers."""

    volatile: bool = False
    """Whether a subscriber declines messages published before it subscribed."""


def qos(operation: Operation) -> QoS:
    """Return the ``qos`` of an operation, which uses the terms of ROS 2."""
    value = operation.get("qos")
    if value is None:
        return QoS()
    if not isinstance(value, dict):
        raise OperationError("qos must be an object")
    depth = None if value.get("depth") is None else count(value, "depth")
    durability = value.get("durability")
    keep_all = value.get("history") == "keep_all"
    return QoS(
        0 if keep_all else depth,
        keep_all,
        durability == "transient_local",
        durability == "volatile",
    )
