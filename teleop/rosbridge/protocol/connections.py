"""The clients: what each may do, what it wants to hear, and how anything reaches it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Final

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.framing.fragments import Reassembly
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.framing.outgoing_frames import (
    CloseFrame,
    FrameKind,
    OutgoingFrame,
    Output,
    Sink,
)
from teleop.rosbridge.framing.png_compression import png_operation
from teleop.rosbridge.limits import ClientLimits, TokenBucket
from teleop.rosbridge.messages.json_cbor_codec import write_json
from teleop.rosbridge.protocol.refusals import Refusal, Refused

LEVELS: Final = {"none": 0, "error": 1, "warning": 2, "info": 3}

POLICY_VIOLATION: Final = 1008
"""Code of a close frame (RFC 6455, section 7.4.1)."""


@dataclass(frozen=True, slots=True)
class ReplyFormat:
    """How a client wants an answer to be png_operation."""

    png: bool = False
    fragment: int = 0
    """Largest piece [bytes]; 0 for the whole in one."""


PLAIN: Final = ReplyFormat()


@dataclass(slots=True)
class Connection:
    """One client."""

    id: int
    name: str
    """For people: its number and address."""

    address: str
    since: int
    """When it came [ns]."""

    messages: TokenBucket
    bytes: TokenBucket
    assembly: Reassembly
    access: Access | None
    """What it may do; None until it has said who it is."""

    level: int = LEVELS["error"]
    lossless: bool = False
    refused: int = 0
    """Operations over the limit since the last one within it."""

    closing: bool = False
    fragmented: int = field(default=0)
    """Messages that went out in fragments, which have numbers for ids."""


class Connections:
    """All clients, by id."""

    def __init__(self, limits: ClientLimits, sink: Sink | None) -> None:
        self.sink = sink
        self.refused: Refused = lambda client, refusal: None
        """Called when a client asks for too much, and by those who refuse it other things."""

        self._limits = limits
        self._all: dict[int, Connection] = {}
        self._next = 1
        self._out: list[tuple[int, Output]] = []

    def __iter__(self) -> Iterator[Connection]:
        return iter(list(self._all.values()))

    def __contains__(self, client: object) -> bool:
        return client in self._all

    def __len__(self) -> int:
        return len(self._all)

    def get(self, client: int) -> Connection | None:
        """Return a client, if it is there."""
        return self._all.get(client)

    def add(self, now: int, address: str, access: Access | None) -> Connection:
        """Take in a new client."""
        client, self._next = self._next, self._next + 1
        limits = self._limits
        self._all[client] = connection = Connection(
            client,
            f"client {client} ({address})" if address else f"client {client}",
            address,
            now,
            TokenBucket(limits.messages, limits.burst, now),
            TokenBucket(limits.bytes, limits.burst, now),
            Reassembly(limits.assembly),
            access,
        )
        return connection

    def remove(self, client: int) -> Connection | None:
        """Forget a client, and at once what it has sent of messages that are not whole."""
        gone = self._all.pop(client, None)
        if gone is not None:
            gone.assembly.clear()
        return gone

    # What goes out

    def drain(self) -> list[tuple[int, Output]]:
        """Return what has gone out while there was no sink."""
        out, self._out = self._out, []
        return out

    def emit(self, client: int, output: Output) -> None:
        """Let something go out to a client, if it is still there."""
        state = self._all.get(client)
        if state is None:  # it left while its answer was on the way
            return
        if isinstance(output, OutgoingFrame):
            if state.lossless:
                output = replace(output, lossless=True)
            if output.fragment and len(output.payload) > output.fragment:
                state.fragmented += 1
                output = replace(output, fragment_id=f"fragment:{state.fragmented}")
        if self.sink is not None:
            self.sink(client, output)
        else:
            self._out.append((client, output))

    def say(self, client: int, text: str, wrapping: ReplyFormat = PLAIN) -> None:
        """Send an operation's JSON text, png_operation as wished."""
        payload = text.encode("ascii")
        if wrapping.png:
            payload = png_operation(payload)
        self.emit(client, OutgoingFrame(FrameKind.CONTROL, payload, fragment=wrapping.fragment))

    def tell(self, client: Connection, level: str, text: str, identity: object = None) -> None:
        """Send a ``status``, if the client wants to hear things of this level."""
        if LEVELS[level] <= client.level:
            status: Operation = {"op": "status", "level": level, "msg": text}
            if identity is not None:
                status["id"] = identity
            self.say(client.id, write_json(status))

    # ClientLimits

    def admit(self, client: Connection, now: int) -> bool:
        """Return whether a client may do one more operation now."""
        if client.messages.take(1, now):
            client.refused = 0
            return True
        self.refuse(client, f"more than {self._limits.messages:g} operations a second")
        return False

    def refuse(self, client: Connection, text: str) -> None:
        """Tell a client that it is not heard; close it if it does not take the hint."""
        client.refused += 1
        if client.refused == 1:  # one is enough: the client is flooded or floods already
            self.refused(client.id, Refusal.of({}, text))
            self.tell(client, "error", f"{text}: not heard")
        elif client.refused > self._limits.messages * self._limits.burst:
            self.refused(client.id, Refusal.of({}, f"{text}: disconnected"))
            self.close(client, POLICY_VIOLATION, text)

    def close(self, client: Connection, code: int, reason: str) -> None:
        """Have a client disconnected, and hear it no more."""
        if not client.closing:
            client.closing = True
            self.emit(client.id, CloseFrame(code, reason))
