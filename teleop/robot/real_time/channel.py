"""A bounded pipe between two processes of the robot that never makes its sender wait.

Payloads are bytes of any size, each with its length before it. What the kernel does not take at once waits in
the sender, up to a bound; beyond it the oldest payload is dropped and counted.
"""

from __future__ import annotations

import os
import select
import socket
import struct
from collections import deque
from typing import Final

from teleop.clock import wall_seconds

_LENGTH: Final = struct.Struct("<I")

_READ: Final = 1 << 18
"""Bytes that one call of ``receive`` takes from the kernel."""

_LARGEST: Final = 1 << 30
"""Largest payload [bytes]; a larger length shows that the stream is broken."""


class ChannelClosedError(Exception):
    """The other side has gone."""


class Channel:
    """One end of the pipe."""

    def __init__(self, end: socket.socket, bound: int) -> None:
        """Take over one end of a pair of stream sockets.

        Args:
            end: The socket.
            bound: Bytes that may wait to be sent.
        """
        end.setblocking(False)
        self._socket, self._bound = end, bound
        self._waiting: deque[bytes] = deque()
        self._size = 0
        self._begun = 0
        """Bytes of the oldest waiting payload that have been sent."""
        self._received = bytearray()
        self.dropped = 0
        """Number of payloads that were dropped because the other side did not take them."""

    def fileno(self) -> int:
        """Return the file descriptor, for ``select`` and event loops."""
        return self._socket.fileno()

    @property
    def waiting(self) -> int:
        """Bytes that wait to be sent."""
        return self._size

    def close(self) -> None:
        """Close this end."""
        self._socket.close()

    def send(self, payload: bytes) -> None:
        """Send a payload, or keep it until the other side reads.

        Raises:
            ChannelClosedError: If the other side has gone.
        """
        frame = _LENGTH.pack(len(payload)) + payload
        self._waiting.append(frame)
        self._size += len(frame)
        while self._size > self._bound and len(self._waiting) > 1 + bool(self._begun):
            self._drop()
        self.flush()

    def flush(self) -> bool:
        """Send what the other side takes; return whether nothing waits.

        Raises:
            ChannelClosedError: If the other side has gone.
        """
        while self._waiting:
            oldest = self._waiting[0]
            try:
                sent = self._socket.send(memoryview(oldest)[self._begun :])
            except BlockingIOError:
                return False
            except OSError as error:
                raise ChannelClosedError from error
            self._begun += sent
            if self._begun == len(oldest):
                self._waiting.popleft()
                self._size -= len(oldest)
                self._begun = 0
        return True

    def receive(self) -> list[bytes]:
        """Return the payloads that have come completely, without waiting.

        Raises:
            ChannelClosedError: If the other side has gone, or sends nonsense.
        """
        try:
            if not (data := self._socket.recv(_READ)):
                raise ChannelClosedError
            self._received += data
        except BlockingIOError:
            pass
        except OSError as error:
            raise ChannelClosedError from error
        return self._split()

    def wait(self, timeout: float | None = None) -> list[bytes]:
        """Wait for at least one payload; return an empty list if none came completely within ``timeout`` [s].

        Raises:
            ChannelClosedError: If the other side has gone.
        """
        end = None if timeout is None else wall_seconds() + timeout
        while not (payloads := self.receive()):
            self.flush()
            left = None if end is None else end - wall_seconds()
            if left is not None and left <= 0.0:
                return []
            select.select([self], [self] if self._waiting else [], [], left)
        return payloads

    def _split(self) -> list[bytes]:
        payloads, begin, received = [], 0, self._received
        while len(received) - begin >= _LENGTH.size:
            (length,) = _LENGTH.unpack_from(received, begin)
            if length > _LARGEST:
                raise ChannelClosedError
            end = begin + _LENGTH.size + length
            if len(received) < end:
                break
            payloads.append(bytes(received[begin + _LENGTH.size : end]))
            begin = end
        del received[:begin]
        return payloads

    def _drop(self) -> None:
        """Drop the oldest payload of which nothing has been sent."""
        kept = self._waiting.popleft() if self._begun else None
        self._size -= len(self._waiting.popleft())
        self.dropped += 1
        if kept is not None:
            self._waiting.appendleft(kept)


def inherited_channel(descriptor: int, bound: int) -> Channel:
    """Return the channel that a parent process has opened for this one."""
    os.set_inheritable(descriptor, False)
    return Channel(socket.socket(fileno=descriptor), bound)
