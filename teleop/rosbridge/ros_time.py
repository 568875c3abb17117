"""Integer nanoseconds, and their form in ROS messages (``builtin_interfaces/Time``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

MILLISECOND: Final = 1_000_000
"""Nanoseconds in a millisecond."""

SECOND: Final = 1_000_000_000
"""Nanoseconds in a second."""


def stamp(now: int) -> dict[str, int]:
    """Return the ``builtin_interfaces/Time`` of a time [ns]."""
    sec, nanosec = divmod(now, SECOND)
    return {"sec": sec, "nanosec": nanosec}


def nanoseconds(stamp: Mapping[str, int]) -> int:
    """Return the time [ns] of a ``builtin_interfaces/Time`` or ``Duration``."""
    return stamp["sec"] * SECOND + stamp["nanosec"]
