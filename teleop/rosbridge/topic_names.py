"""Canonical names of topics, services and actions, and the id of the host among their owners."""

from __future__ import annotations

from typing import Final

HOST: Final = -1
"""Id of the program that runs the server, where a client id is expected."""


def canonical(name: str) -> str:
    """Return the name shared by the spellings ``chatter``, ``/chatter`` and ``/chatter/``."""
    return "/" + name.strip("/")
