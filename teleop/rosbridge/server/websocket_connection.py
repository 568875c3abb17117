"""A connection that has become a WebSocket: frames by websockets' sans-I/O protocol, pings, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import sys
import termios
from collections.abc import Callable, Iterable
from typing import Any, Final

from websockets.frames import CLOSE, DATA_OPCODES, PONG, CloseCode, Frame
from websockets.protocol import State
from websockets.server import ServerProtocol
from websockets.typing import BytesLike

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.framing.outgoing_frames import POLICY_VIOLATION
from teleop.rosbridge.server.connection_flow import ConnectionFlow
from teleop.rosbridge.server.gate import Gate
from teleop.rosbridge.server.hang_up import HangUp
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.received_messages import ReceivedMessages

_PIECE: Final = 4096
"""Bytes that are parsed before the frames in them are counted: 700 empty frames [bytes]."""

_FRAGMENT: Final = 131_072
"""Size of the fragments (RFC 6455, section 5.4) of a large message [bytes]; it fits the processor's cache."""

_WRITE_BUFFER: Final = 32_768
"""Bytes that asyncio keeps before sending waits."""

_CLOSE_TIMEOUT: Final = 2.0
"""Time for the client's part of the closing handshake [s]; then the connection is aborted."""

_CUT_TIMEOUT: Final = 1.0
"""Time for the reason to reach a client that is cut off [s]; nothing is read from it any more."""

_LAST_MESSAGES: Final = 16
"""Messages of a client that has left that are still taken, for programs that send a few and end."""

_ALIVE: Final = b"alive?"
"""Payload of the pings that look for a client that has gone."""


class WebSocketConnection(ConnectionFlow):
    """A WebSocket of which the opening handshake is done."""

    pong_received: Callable[[bytes, float], object] = staticmethod(lambda payload, arrived: None)
    """Takes the payload of each pong and its arrival, in the loop's time [s]."""

    def __init__(
        self,
        transport: asyncio.Transport,
        protocol: ServerProtocol,
        gate: Gate,
        keepalive: Keepalive,
        access: Access | None,
    ) -> None:
        """Begin with the pings; ``access`` has the permissions of the token in the request."""
        super().__init__()
        self.transport = transport
        self.access = access
        self.recv_messages = ReceivedMessages(transport)
        self._protocol = protocol
        self._gate = gate
        self._budget = gate.begin(self.host, self.now)
        self._keepalive = keepalive
        self._arrived = self.loop.time()
        self._unparsed = 0
        self._hang_up = HangUp(transport)
        self._closing = self._goodbye = self._deaf = False
        self._last: int | None = None
        self._deadline: asyncio.TimerHandle | None = None
        transport.set_write_buffer_limits(_WRITE_BUFFER)
        self._pinging = self._after(keepalive.ping_interval, self._look_for_client)

    # What comes

    def data_received(self, data: bytes) -> None:
        """Take the frames in what was read, few at a time, so that a flood is cut off within it."""
        self._arrived = self.recv_messages.date(len(data))
        for start in range(0, len(data), _PIECE):
            if self._deaf:
                break
            piece = data[start : start + _PIECE]
            self._protocol.receive_data(piece)
            frames = self._protocol.events_received()
            self._unparsed = 0 if frames else self._unparsed + len(piece)
            for frame in frames:
                assert isinstance(frame, Frame)
                self._recv_frame(frame)
            self._flush()
            if self._protocol.state is not State.OPEN and not (self._closing or self._goodbye):
                self._cut_off()  # websockets has failed the connection

    def eof_received(self) -> None:
        """Note that the client has left without a close frame; asyncio closes the transport."""
        self._protocol.receive_eof()
        self._flush()
        self.recv_messages.arrival.set()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop all timers, and wake up what waits for a message."""
        self._protocol.receive_eof()
        for timer in (self._pinging, self._deadline):
            if timer is not None:
                timer.cancel()
        self._gate.leave(self.transport)
        self._gate.end(self.host, self._budget, self.now)
        super().connection_lost(exc)
        self.recv_messages.arrival.set()

    async def receive(self) -> tuple[str | bytes, float]:
        """Return the next message and its earliest possible arrival, in the loop's time [s].

        Raises:
            ConnectionClosed: If there will be none.
        """
        while (message := self._next()) is None:
            if self._deaf or self._last is not None:
                self._release()
                raise self._protocol.close_exc
            await self.recv_messages.arrival.wait()
        return message

    @property
    def unprocessed(self) -> int:
        """Bytes that have arrived and have not been returned by ``receive``, to within 4 kB."""
        return self.recv_messages.size + self._unparsed + _readable(self.transport)

    def _next(self) -> tuple[str | bytes, float] | None:
        """Return the next message to be carried out; None if none is here, or wanted any more."""
        if self._last is None and self._has_left():
            self._last = _LAST_MESSAGES
        if self._deaf or self._last == 0:
            return None
        if self._last is not None:
            self._last -= 1
        return self.recv_messages.take()

    def _has_left(self) -> bool:
        gone = self._goodbye or self.ended or self.transport.is_closing()
        return gone or (self.recv_messages.several and self._hang_up.seen())

    def _recv_frame(self, frame: Frame) -> None:
        """Process a frame, or end a connection that sends too many."""
        if self._deaf:
            return
        if frame.opcode is CLOSE:
            self._goodbye = True
            self.recv_messages.arrival.set()
        elif why := self._budget.excess(frame.opcode, self.now):
            self.warn(why)
            self._fail(POLICY_VIOLATION, why)
        elif frame.opcode is PONG:
            self._found_client()
            self.pong_received(bytes(frame.data), self._arrived)
        elif frame.opcode in DATA_OPCODES:
            try:
                self.recv_messages.put(frame, self._arrived)
            except UnicodeDecodeError as error:
                self._fail(CloseCode.INVALID_DATA, f"{error.reason} at position {error.start}")

    # What goes

    @property
    def open(self) -> bool:
        """Whether messages can be sent."""
        return self._protocol.state is State.OPEN

    def send_at_once(self, messages: Iterable[tuple[BytesLike, bool]]) -> None:
        """Write small messages together, without waiting; the connection must be open.

        Args:
            messages: Each message, and whether it is text.
        """
        for message, text in messages:
            (self._protocol.send_text if text else self._protocol.send_binary)(message)
        self._flush()

    async def send(self, message: BytesLike, *, text: bool) -> None:
        """Send a message, in fragments if it is large, each when the write buffer has room.

        Raises:
            ConnectionClosed: If the connection is closed.
        """
        size = len(message)
        step = size if 0 < size < 2 * _FRAGMENT else _FRAGMENT
        begin = self._protocol.send_text if text else self._protocol.send_binary
        view = memoryview(message) if size > step else message
        for start in range(0, max(size, 1), step):
            if self._protocol.state is not State.OPEN:
                break
            send = self._protocol.send_continuation if start else begin
            send(view[start : start + step], start + step >= size)
            self._flush()
            await self.drain()
        if self._protocol.state is not State.OPEN:
            await self.wait_ended()
            raise self._protocol.close_exc

    def send_ping(self, payload: bytes) -> None:
        """Send a ping without waiting for anything, if the connection is open."""
        if self._protocol.state is State.OPEN:
            self._protocol.send_ping(payload)
            self._flush()

    async def close(self, code: int, reason: str) -> None:
        """Close the connection, and wait until it has ended."""
        if self._protocol.state is State.OPEN:
            self._closing = True
            self._protocol.send_close(code, reason)
            self._flush()
        await self.wait_ended()

    def _flush(self) -> None:
        """Write what websockets wants to send, and see whether the end has begun."""
        chunks = self._protocol.data_to_send()
        ends = bool(chunks) and not chunks[-1]
        if chunks:
            self.write(chunks[0] if len(chunks) == 1 else b"".join(chunks))
        if ends:
            self.end_writing()
        if self._protocol.state is not State.OPEN and self._deadline is None:
            self._deadline = self.loop.call_later(_CLOSE_TIMEOUT, self.transport.abort)

    # Its end

    def warn(self, why: str) -> None:
        """Log why this client is disconnected."""
        self._gate.warn(why, f"{self.host}: {why}: disconnected")

    def _fail(self, code: int, reason: str) -> None:
        """Disconnect the client with a reason."""
        self._protocol.fail(code, reason)
        self._flush()
        self._cut_off()

    def _cut_off(self) -> None:
        """Read no more; whatever the client does, its connection ends soon."""
        self._deaf = True
        self.transport.pause_reading()
        self.recv_messages.arrival.set()
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = self.loop.call_later(_CUT_TIMEOUT, self.transport.abort)

    def _release(self) -> None:
        """End the WebSocket though its connection has not ended, which is a mere socket from now on."""
        self._deaf = True
        self._protocol.receive_eof()
        if not self.ended:
            self._flush()
            self._gate.enter(self.transport, self.host)

    # Whether anybody is there

    def _look_for_client(self) -> None:
        self._pinging = self._after(self._keepalive.ping_timeout, self._miss_client)
        self.send_ping(_ALIVE)

    def _found_client(self) -> None:
        if self._pinging is not None:
            self._pinging.cancel()
        self._pinging = self._after(self._keepalive.ping_interval, self._look_for_client)

    def _miss_client(self) -> None:
        self._fail(CloseCode.INTERNAL_ERROR, "keepalive ping timeout")

    def _after(self, time: float | None, call: Callable[[], object]) -> asyncio.TimerHandle | None:
        return None if time is None else self.loop.call_later(time, call)


def _readable(transport: asyncio.Transport) -> int:
    """Return how many bytes wait in the kernel; 0 where it cannot be asked."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        raw: Any = transport.get_extra_info("socket")
        answer = fcntl.ioctl(raw.fileno(), termios.FIONREAD, b"1234")
        return int.from_bytes(answer, sys.byteorder)
    return 0
