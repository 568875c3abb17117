"""What all connections share below the messages: limits of frames, requests and open sockets."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from typing import Final

from websockets.frames import DATA_OPCODES, Opcode

from teleop.rosbridge.limits import ClientLimits, TokenBucket
from teleop.rosbridge.protocol.address_memory import AddressMemory
from teleop.rosbridge.server.rare_warnings import RareWarnings

_LOG: Final = logging.getLogger(__name__)

_MAX_SOCKETS: Final = 256
"""Sockets that are neither WebSockets nor downloads nor streams: in a TLS handshake, without a request, or ending."""

_MAX_ADDRESSES: Final = 1024
"""Addresses whose requests are counted; of more, the one not seen for longest is forgotten."""


class FrameBudget:
    """The rates of a connection's WebSocket frames, of control frames apart."""

    def __init__(self, limits: ClientLimits, now: int) -> None:
        """Begin with full buckets at ``now`` [ns]."""
        self._limits = limits
        self.buckets = {
            "frames": TokenBucket(limits.frames, limits.burst, now),
            "control frames": TokenBucket(limits.control, limits.burst, now),
        }

    def excess(self, opcode: Opcode, now: int) -> str | None:
        """Count a frame; return why the connection must end, or None if it may go on."""
        control = opcode not in DATA_OPCODES
        if not self.buckets["frames"].take(1, now):
            return f"more than {self._limits.frames:g} WebSocket frames/s"
        if control and not self.buckets["control frames"].take(1, now):
            return f"more than {self._limits.control:g} pings and pongs/s"
        return None


class Gate:
    """Limits what connections do before and below their messages; times are the loop's [ns]."""

    def __init__(self, limits: ClientLimits) -> None:
        self._limits = limits
        self._memory = AddressMemory()
        self._requests: dict[str, TokenBucket] = {}
        self._sockets: dict[asyncio.Transport, str] = {}
        self._warnings = RareWarnings(_LOG)

    def enter(self, socket: asyncio.Transport, host: str) -> None:
        """Count an accepted socket of an address; with too many, the oldest of who has most is closed."""
        self._sockets[socket] = host
        if len(self._sockets) > _MAX_SOCKETS:
            counts = Counter(self._sockets.values())
            most = max(counts.values())
            oldest = next(one for one, host in self._sockets.items() if counts[host] == most)
            del self._sockets[oldest]
            oldest.abort()

    def leave(self, socket: asyncio.Transport) -> None:
        """Count a socket no longer, as it has ended, or become something that is counted elsewhere."""
        self._sockets.pop(socket, None)

    def warn(self, kind: str, text: str) -> None:
        """Log what a client did, a line a minute for each kind."""
        self._warnings.warn(kind, text, asyncio.get_running_loop().time())

    def admit_request(self, host: str, now: int) -> bool:
        """Return whether an address may make another request."""
        bucket = self._requests.pop(host, None)
        if bucket is None:
            bucket = TokenBucket(self._limits.requests, 2 * self._limits.burst, now)
        self._requests[host] = bucket
        while len(self._requests) > _MAX_ADDRESSES:
            del self._requests[next(iter(self._requests))]
        return bucket.take(1, now)

    def begin(self, host: str, now: int) -> FrameBudget:
        """Return the frame budget of a new WebSocket, less what its address has used up."""
        budget = FrameBudget(self._limits, now)
        # So much is left that an honest client of the same address is served.
        self._memory.restore(host, budget.buckets, now, most=0.9)
        return budget

    def end(self, host: str, budget: FrameBudget, now: int) -> None:
        """Remember what a WebSocket has used up."""
        self._memory.store(host, budget.buckets, now)
