"""Who may take one of the limited places of clients, and who leaves one for an operator."""

from __future__ import annotations

from collections import Counter

from teleop.rosbridge.auth.permissions import Access, Role
from teleop.rosbridge.framing.outgoing_frames import TRY_AGAIN_LATER
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.connections import Connections

_MAX_UNAUTHENTICATED = 8
"""Clients that have not authenticated; they are counted apart, so that they block nobody."""

_MAX_UNAUTHENTICATED_OF_ADDRESS = 2
"""Those of one address; a further one takes the place of its oldest."""


class Places:
    """The places of clients, some of them reserved for operators and admins with a token."""

    def __init__(self, limits: ClientLimits, connections: Connections, *, tokens: bool) -> None:
        """Reserve places, if there are tokens by which those who may take them are known.

        Args:
            limits: Numbers of places.
            connections: The connected clients.
            tokens: Whether clients have tokens.
        """
        self._connections = connections
        self._all = limits.clients
        reserved = min(limits.reserved, limits.clients // 8) if tokens else 0
        self._unreserved = limits.clients - reserved

    def refusal(self, access: Access | None, host: str) -> str | None:
        """Return why a client gets no place, or None if it gets one; a viewer may lose its own.

        Args:
            access: Permissions of the client; None if it is still to authenticate.
            host: Its address without the port.
        """
        present = [one for one in self._connections if not one.closing]
        if access is None:
            waiting = [one for one in present if one.access is None]
            return None if self._admit(waiting, host) else "too many without a token"
        taken = [one for one in present if one.access is not None]
        if _commands(access):
            return None if len(taken) < self._all or self._evict(taken) else "too many clients"
        others = [one for one in taken if not _commands(one.access)]
        if len(taken) >= self._all or len(others) >= self._unreserved:
            return "too many clients"
        return None

    def _admit(self, waiting: list[Connection], host: str) -> bool:
        """Return whether one more may authenticate; the oldest of the address that has most may lose its place."""
        own = [one for one in waiting if one.host == host]
        if len(own) >= _MAX_UNAUTHENTICATED_OF_ADDRESS:
            return self._dismiss(own)
        if len(waiting) < _MAX_UNAUTHENTICATED:
            return True
        counts = Counter(one.host for one in waiting)
        most = max(counts.values())
        if len(own) + 1 > most:
            return False
        return self._dismiss([one for one in waiting if counts[one.host] == most])

    def _dismiss(self, waiting: list[Connection]) -> bool:
        oldest = min(waiting, key=lambda one: one.id)
        self._connections.close(oldest.id, TRY_AGAIN_LATER, "another client needs the place")
        return True

    def _evict(self, taken: list[Connection]) -> bool:
        """Disconnect the newest client without a token, or else viewer; return whether there is one."""
        others = [one for one in taken if not _commands(one.access)]
        if not others:
            return False
        newest = max(others, key=lambda one: (not one.access or not one.access.key, one.id))
        self._connections.close(newest.id, TRY_AGAIN_LATER, "an operator needs the place")
        return True


def _commands(access: Access | None) -> bool:
    """Return whether an access is that of a token that may command the robot."""
    return access is not None and bool(access.key) and access.role is not Role.VIEW
