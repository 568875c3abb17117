"""What happened to the connection, and how long ago, in words for an operator."""

from __future__ import annotations

from typing import Final

from localization.types import SECOND

_WORDS: Final = (
    ("keepalive ping timeout", "the robot stopped answering"),
    ("ping timeout", "the robot stopped answering"),
    ("closed by this client", "ended here"),
    ("1012", "the robot's server is being restarted"),
    ("1001", "the robot's server was shut down"),
    ("shutting down", "the robot's server was shut down"),
    ("going away", "the robot's server was shut down"),
    ("1013", "the robot's server has too much to do"),
    ("1008", "the robot's server refused this station"),
    ("no close frame", "the connection broke off"),
    ("code None", "the connection broke off"),
    ("code 1000", "the robot's server ended the connection"),
    ("code 1006", "the connection broke off"),
)
"""What a library or a close code says, and what it means; the first that fits counts."""


def plain_reason(reason: str) -> str:
    """Return why a connection was lost, in words; reasons that are words already stay."""
    for part, words in _WORDS:
        if part in reason:
            return words
    return reason or "the connection broke off"


def age_words(age: int) -> str:
    """Return a time [ns] as a person says it: ``0.6 s``, ``12 s``, ``3 min``, ``2 h``."""
    seconds = age / SECOND
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.0f} h"
