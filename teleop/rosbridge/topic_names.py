"""Names that mean the same."""

from __future__ import annotations

from typing import Final

HOST: Final = -1
"""Who publishes or provides when it is not a client: the program that runs the server."""


def canonical(name: str) -> str:
    """Return the name that ``chatter``, ``/chatter`` and ``/chatter/`` share."""
    return "/" + name.strip("/")
