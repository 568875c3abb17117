"""A link between the camera and the gateway, so that pictures do not pass through control.

Control makes the pair of sockets, hands one end to each, and keeps both: whichever process is started
again goes on with the same pair. Values are cut into packets that say what they belong to, so that one of which the
rest is missing, because its sender died, spoils no other.
"""

from __future__ import annotations

import os
import pickle
import select
import socket
import struct
from collections.abc import Hashable
from typing import Any, Final

from teleop.robot.real_time.channel import ChannelClosedError

_HEAD: Final = struct.Struct("<III")
"""Number of the value, offset of the packet in it, and its length [bytes]."""

_PACKET: Final = 60_000
"""Bytes of a packet: three fit into a socket's buffer of usual size."""

_LARGEST: Final = 1 << 28
"""Largest value [bytes]."""

_AT_ONCE: Final = 20
"""Packets that one call of ``receive`` takes: a megabyte."""


def socket_pair() -> tuple[socket.socket, socket.socket]:
    """Return both ends of a link, for control to keep and hand on."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


class PictureLink:
    """One end. Sending never waits; of values with one key that wait, only the newest is sent."""

    def __init__(self, descriptor: int) -> None:
        """Take over the end with this descriptor, which control has opened."""
        os.set_inheritable(descriptor, False)
        self._socket = socket.socket(fileno=descriptor)
        self._socket.setblocking(False)
        self._waiting: dict[Hashable, bytes] = {}
        self._begun: tuple[Hashable, bytes] | None = None
        """Key and payload of the value that is being sent."""
        self._offset = 0
        self._number = int.from_bytes(os.urandom(4))  # another one than a predecessor's
        self._received, self._expected = bytearray(), -1

    def fileno(self) -> int:
        """Return the file descriptor, for ``select`` and event loops."""
        return self._socket.fileno()

    @property
    def waiting(self) -> bool:
        """Whether something waits to be sent."""
        return self._begun is not None or bool(self._waiting)

    def close(self) -> None:
        """Close this end."""
        self._socket.close()

    def send(self, key: Hashable, value: object) -> None:
        """Send a value instead of any with the same key that has not begun to be sent.

        Raises:
            ChannelClosedError: If control has gone.
        """
        self._waiting.pop(key, None)
        self._waiting[key] = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
        self.flush()

    def flush(self, patience: float = 0.0) -> None:
        """Send what the other side takes.

        Args:
            patience: Time to wait for the other side, each time that it does not take a packet at once [s].

        Raises:
            ChannelClosedError: If control has gone.
        """
        while self.waiting:
            if self._begun is None:
                key = next(iter(self._waiting))
                self._begun, self._offset = (key, self._waiting.pop(key)), 0
                self._number = (self._number + 1) & 0xFFFFFFFF
            payload = self._begun[1]
            head = _HEAD.pack(self._number, self._offset, len(payload))
            part = memoryview(payload)[self._offset : self._offset + _PACKET]
            try:
                self._socket.sendmsg([head, part])
            except BlockingIOError:
                if not patience or not select.select([], [self], [], patience)[1]:
                    return
                continue
            except OSError as error:
                raise ChannelClosedError from error
            self._offset += len(part)
            if self._offset >= len(payload):
                self._begun = None

    def receive(self) -> list[Any]:
        """Return the values that have come completely, without waiting; both processes are the robot's own.

        Raises:
            ChannelClosedError: If control has gone.
        """
        values = []
        for _ in range(_AT_ONCE):
            try:
                packet = self._socket.recv(_HEAD.size + _PACKET)
            except BlockingIOError:
                break
            except OSError as error:
                raise ChannelClosedError from error
            if not packet:
                raise ChannelClosedError
            number, offset, length = _HEAD.unpack_from(packet)
            if offset == 0:
                self._received, self._expected = bytearray(), number
            if number != self._expected or offset != len(self._received) or length > _LARGEST:
                self._expected = -1  # the rest of a value whose beginning another process got
                continue
            self._received += memoryview(packet)[_HEAD.size :]
            if len(self._received) == length:
                values.append(pickle.loads(self._received))
                self._received, self._expected = bytearray(), -1
        return values
