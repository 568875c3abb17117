"""The connected clients: sending frames to them, and enforcing their rate limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from typing import Protocol as Interface

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.framing.fragments import Reassembly
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.framing.outgoing_frames import (
    PLAIN,
    POLICY_VIOLATION,
    CloseFrame,
    FrameKind,
    OutgoingFrame,
    Output,
    ReplyFormat,
)
from teleop.rosbridge.framing.png_compression import PngPacker
from teleop.rosbridge.limits import ClientLimits, TokenBucket
from teleop.rosbridge.messages.json_cbor_codec import write_json
from teleop.rosbridge.protocol.address_memory import AddressMemory
from teleop.rosbridge.protocol.connection import STATUS_LEVELS, Connection
from teleop.rosbridge.protocol.delay_lines import DelayLines
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.timers import Timers

_FORGIVEN = 0.1
"""Share of each rate by which a client may exceed it for ever without being disconnected."""


class Transport(Interface):
    """Sends the frames of a protocol, and wakes it when its timers are due."""

    def send(self, client: int, output: Output) -> None:
        """Queue a frame for a client."""

    def wake(self) -> None:
        """Process a change of the protocol's ``timers.due`` to an earlier time."""


class Connections:
    """All connected clients, by id."""

    def __init__(self, limits: ClientLimits, observer: Observer, timers: Timers) -> None:
        self._limits = limits
        self._observer = observer
        self._timers = timers
        self._transport: Transport | None = None
        self._all: dict[int, Connection] = {}
        self._next = 1
        self._undelivered: list[tuple[int, Output]] = []
        self.addresses = AddressMemory()
        """What the addresses of clients have used up, across their connections."""

        self.png = PngPacker()
        """Packs what clients want in PNG."""

        self.delays: DelayLines | None = None
        """The emulated link that frames pass; None without emulation."""

    def __iter__(self) -> Iterator[Connection]:
        return iter(list(self._all.values()))

    def __len__(self) -> int:
        return len(self._all)

    def get(self, client: int) -> Connection | None:
        """Return a client's connection; None if it has disconnected."""
        return self._all.get(client)

    def name(self, client: int) -> str:
        """Return a client's name; after it has left, its number."""
        connection = self._all.get(client)
        return f"client {client}" if connection is None else connection.name

    def rename(self, client: int, wanted: str) -> str:
        """Give a client a name, with a number behind it if another client has the same; return it."""
        connection = self._all[client]
        taken = {other.name.casefold() for other in self if other is not connection}
        names = (wanted if n == 1 else f"{wanted} {n}" for n in count(1))
        old, connection.name = connection.name, next(n for n in names if n.casefold() not in taken)
        self._observer.renamed(connection, old)
        return connection.name

    def access(self, client: int) -> Access | None:
        """Return a client's permissions; None if it has not authenticated or has left."""
        connection = self._all.get(client)
        return None if connection is None else connection.access

    def set_lossless(self, client: int) -> None:
        """Send a client every frame from now on, in their order."""
        if connection := self._all.get(client):
            connection.lossless = True

    def add(self, now: int, address: str, access: Access | None) -> Connection:
        """Add a client; ``now`` is in [ns]."""
        client, self._next = self._next, self._next + 1
        limits = self._limits
        self._all[client] = connection = Connection(
            id=client,
            name="",
            address=address,
            since=now,
            operation_rate=TokenBucket(limits.messages, limits.burst, now),
            byte_rate=TokenBucket(limits.bytes, limits.burst, now),
            part_rate=TokenBucket(limits.parts, limits.burst, now),
            tolerance=TokenBucket(_FORGIVEN, limits.burst / _FORGIVEN, now),
            reassembly=Reassembly(limits.assembly),
            access=access,
        )
        connection.name = connection.number_and_address
        # An honest client of the same address can subscribe to all it needs, and may slip.
        self.addresses.restore(connection.origin, connection.rates, now, most=0.9)
        return connection

    def remove(self, client: int, now: int) -> Connection | None:
        """Remove a client and its incomplete messages; return it if it was connected."""
        removed = self._all.pop(client, None)
        if removed is not None:
            self.addresses.store(removed.origin, removed.rates, now)
            removed.reassembly.clear()
        return removed

    # Sending

    def attach(self, transport: Transport) -> None:
        """Send through a transport instead of collecting frames for ``drain``.

        Raises:
            ValueError: If there is a transport already.
        """
        if self._transport is not None:
            raise ValueError("the protocol has a transport already")
        self._transport = transport

    def detach(self) -> None:
        """Remove the transport."""
        self._transport = None

    def wake(self) -> None:
        """Notify the transport that a timer is due earlier."""
        if self._transport is not None:
            self._transport.wake()

    def drain(self) -> list[tuple[int, Output]]:
        """Return the frames sent since the last call, if there is no transport."""
        frames, self._undelivered = self._undelivered, []
        return frames

    def send(self, client: int, output: Output) -> None:
        """Send a frame to a client, if it is connected."""
        connection = self._all.get(client)
        if connection is None:
            return
        if isinstance(output, OutgoingFrame):
            if connection.lossless:
                output = replace(output, lossless=True)
            if output.fragment and len(output.payload) > output.fragment:
                connection.fragmented += 1
                output = replace(output, fragment_id=f"fragment:{connection.fragmented}")
        self._observer.sent(connection, output)
        if self.delays is None or (
            isinstance(output, OutgoingFrame) and self.delays.delay.bypasses(output.payload)
        ):
            self.transmit(client, output)
        else:
            self.delays.send(client, output)

    def transmit(self, client: int, output: Output) -> None:
        """Pass a frame to the transport, once it is through an emulated link if there is one."""
        if self._transport is not None:
            self._transport.send(client, output)
        else:
            self._undelivered.append((client, output))

    def send_json(self, client: int, text: str, reply_format: ReplyFormat = PLAIN) -> None:
        """Send the JSON text of an operation."""
        payload = text.encode("ascii")
        if reply_format.png:
            payload = self.png.pack(payload, self._timers.now)
        frame = OutgoingFrame(FrameKind.CONTROL, payload, fragment=reply_format.fragment)
        self.send(client, frame)

    def send_status(self, client: int, level: str, text: str, identity: object = None) -> None:
        """Send a ``status``, if the client receives this level."""
        connection = self._all.get(client)
        if connection is not None and STATUS_LEVELS[level] <= connection.level:
            status: Operation = {"op": "status", "level": level, "msg": text}
            if identity is not None:
                status["id"] = identity
            self.send_json(client, write_json(status))

    def close(self, client: int, code: int, reason: str) -> None:
        """Disconnect a client; its further frames are ignored."""
        connection = self._all.get(client)
        if connection is not None and not connection.closing:
            connection.closing = True
            connection.closed_for = reason
            self.send(client, CloseFrame(code, reason))

    # Limits

    def admit(self, connection: Connection, now: int) -> bool:
        """Return whether a client's next operation is within its rate."""
        rate = connection.operation_rate
        return rate.take(1, now) or self._exceeded(connection, rate, 1, "operations", now)

    def admit_bytes(self, connection: Connection, size: int, now: int) -> bool:
        """Return whether a client's next frame is within its rate."""
        rate = connection.byte_rate
        return rate.take(size, now) or self._exceeded(connection, rate, size, "bytes", now)

    def admit_parts(self, connection: Connection, parts: int, now: int) -> bool:
        """Return whether a client may send nested messages; they are charged once they are read.

        What cannot be read is not built, and so only counts by its bytes.
        """
        rate = connection.part_rate
        return rate.take(0, now) or self._exceeded(connection, rate, parts, "nested messages", now)

    def could_admit(self, connection: Connection, now: int) -> bool:
        """Return whether a client has not used up its bytes and nested messages."""
        buckets = (connection.byte_rate, connection.part_rate, connection.operation_rate)
        return all(bucket.missing(now) < bucket.capacity for bucket in buckets)

    def charge(self, client: int, *, parts: int = 0, size: int = 0) -> None:
        """Count the work that a client has caused: nested messages built, or bytes of responses."""
        if connection := self._all.get(client):
            connection.part_rate.spend(parts, self._timers.now)
            connection.byte_rate.spend(size, self._timers.now)

    def _exceeded(
        self, connection: Connection, rate: TokenBucket, amount: int, what: str, now: int
    ) -> bool:
        """Reject an amount that exceeds a rate; return false."""
        text = f"rate limit of {rate.rate:g} {what}/s exceeded"
        self._reject(connection, text, amount / rate.rate, now)
        return False

    def refuse_waiting(self, connection: Connection, size: int, now: int) -> None:
        """Reject a frame of ``size`` bytes, since what arrived before it fills the client's place."""
        seconds = size / self._limits.bytes
        self._reject(connection, "too many bytes wait behind your large frames", seconds, now)

    def _reject(self, connection: Connection, text: str, seconds: float, now: int) -> None:
        """Report an excess once a second, and disconnect a client that has exceeded for too long.

        Args:
            connection: The client.
            text: What it exceeds.
            seconds: The excess, as the time in which the rate would allow it [s].
            now: Current time [ns].
        """
        reported = connection.excess_reported
        if not connection.tolerance.take(seconds, now):
            self._observer.refused(connection, Refusal.of({}, f"{text}: disconnected"))
            self.close(connection.id, POLICY_VIOLATION, text)
        elif reported is None or now - reported >= SECOND:
            connection.excess_reported = now
            self._observer.refused(connection, Refusal.of({}, text))
            self.send_status(connection.id, "error", f"{text}: operation dropped")
