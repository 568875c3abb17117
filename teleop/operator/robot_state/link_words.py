"""What happened to the connection, in words for an operator."""

from __future__ import annotations

import re
from typing import Final

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
        if re.search(rf"\b{part}\b", reason):  # a port such as 10080 is no close code
            return words
    return reason or "the connection broke off"
