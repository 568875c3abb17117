"""The connected clients: sending frames to them, and enforcing their rate limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
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
from teleop.rosbridge.framing.png_compression import png_operation
from teleop.rosbridge.limits import ClientLimits, TokenBucket
from teleop.rosbridge.messages.json_cbor_codec import write_json
from teleop.rosbridge.protocol.connection import STATUS_LEVELS, Connection
from teleop.rosbridge.protocol.delay_lines import DelayLines
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.refusals import Refusal


class Transport(Interface):
    """Sends the frames of a protocol, and wakes it when its timers are due."""

    def send(self, client: int, output: Output) -> None:
        """Queue a frame for a client."""

    def wake(self) -> None:
        """Process a change of the protocol's ``timers.due`` to an earlier time."""


class Connections:
    """All connected clients, by id."""

    def __init__(self, limits: ClientLimits, observer: Observer) -> None:
        self._limits = limits
        self._observer = observer
        self._transport: Transport | None = None
        self._all: dict[int, Connection] = {}
        self._next = 1
        self._undelivered: list[tuple[int, Output]] = []
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
        """Return a client's number and address, for logs; after it has left, its number."""
        connection = self._all.get(client)
        return f"client {client}" if connection is None else connection.name

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
            name=f"client {client} ({address})" if address else f"client {client}",
            address=address,
            since=now,
            operation_rate=TokenBucket(limits.messages, limits.burst, now),
            byte_rate=TokenBucket(limits.bytes, limits.burst, now),
            reassembly=Reassembly(limits.assembly),
            access=access,
        )
        return connection

    def remove(self, client: int) -> Connection | None:
        """Remove a client and its incomplete messages; return it if it was connected."""
        removed = self._all.pop(client, None)
        if removed is not None:
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
        if self.delays is not None:
            self.delays.send(client, output)
        else:
            self.transmit(client, output)

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
            payload = png_operation(payload)
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
            self.send(client, CloseFrame(code, reason))

    # Limits

    def admit(self, connection: Connection, now: int) -> bool:
        """Return whether a client's next operation is within its rate."""
        if connection.operation_rate.take(1, now):
            connection.excess = 0
            return True
        self._reject_excess(connection, f"{self._limits.messages:g} operations/s")
        return False

    def admit_bytes(self, connection: Connection, size: int, now: int) -> bool:
        """Return whether a client's next frame is within its rate."""
        if connection.byte_rate.take(size, now):
            return True
        self._reject_excess(connection, f"{self._limits.bytes:g} bytes/s")
        return False

    def _reject_excess(self, connection: Connection, rate: str) -> None:
        """Report the first excess operation, and disconnect a client that sends too many."""
        text = f"rate limit of {rate} exceeded"
        connection.excess += 1
        if connection.excess == 1:
            self._observer.refused(connection, Refusal.of({}, text))
            self.send_status(connection.id, "error", f"{text}: operation dropped")
        elif connection.excess > self._limits.messages * self._limits.burst:
            self._observer.refused(connection, Refusal.of({}, f"{text}: disconnected"))
            self.close(connection.id, POLICY_VIOLATION, text)
