"""The part of a connection that HTTP and WebSockets share: its transport, its write buffer, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import socket as sockets
from collections.abc import Awaitable
from typing import Any, TypeVar

from websockets.typing import BytesLike

from teleop.rosbridge.ros_time import SECOND

_T = TypeVar("_T")


class ConnectionFlow(asyncio.Protocol):
    """Waits for the write buffer of a transport, and for its end."""

    transport: asyncio.Transport

    def __init__(self) -> None:
        self.loop = asyncio.get_running_loop()
        self._ended: asyncio.Future[None] = self.loop.create_future()
        self._writable = asyncio.Event()
        self._writable.set()

    @property
    def now(self) -> int:
        """Time of the loop [ns]."""
        return int(self.loop.time() * SECOND)

    @property
    def host(self) -> str:
        """Address of the client, without the port; empty if it has none."""
        peer = self.transport.get_extra_info("peername")
        return str(peer[0]) if peer else ""

    @property
    def ended(self) -> bool:
        """Whether the connection has ended."""
        return self._ended.done()

    def pause_writing(self) -> None:
        """Note that the write buffer is full."""
        self._writable.clear()

    def resume_writing(self) -> None:
        """Note that the write buffer has room."""
        self._writable.set()

    def connection_lost(self, exc: Exception | None) -> None:
        """Release all that waits for the connection."""
        self._writable.set()
        if not self._ended.done():
            self._ended.set_result(None)

    async def drain(self) -> None:
        """Wait until the write buffer has room, or the connection has ended."""
        if self.transport.is_closing():
            await asyncio.sleep(0)  # its end is only scheduled yet
        await self._writable.wait()

    async def wait_ended(self) -> None:
        """Wait until the connection has ended."""
        await asyncio.shield(self._ended)

    def write(self, data: BytesLike) -> None:
        """Write, unless the connection is ending: asyncio logs each write after that."""
        if not self.transport.is_closing():
            self.transport.write(data)

    def end_writing(self) -> None:
        """End the stream of bytes to the client after what is in the buffer."""
        if self.transport.is_closing():
            return
        if self.transport.can_write_eof():
            try:
                self.transport.write_eof()
            except OSError:  # the client has reset the connection, which asyncio has not seen yet
                self.transport.abort()
        else:  # TLS
            self.transport.close()

    def limit_unsent(self, size: int) -> None:
        """Keep the kernel from buffering more bytes that it cannot send yet, where they become old.

        A small send buffer would do the same, but slows down fast connections to a third.
        """
        if hasattr(sockets, "TCP_NOTSENT_LOWAT"):  # Linux and macOS
            raw = self.transport.get_extra_info("socket")
            raw.setsockopt(sockets.IPPROTO_TCP, sockets.TCP_NOTSENT_LOWAT, size)

    async def while_connected(self, work: Awaitable[_T]) -> _T:
        """Return the result of work that is cancelled if the client leaves.

        Raises:
            ConnectionResetError: If it left.
        """
        task: asyncio.Future[_T] = asyncio.ensure_future(work)
        left: asyncio.Future[Any] = self._ended
        try:
            await asyncio.wait({task, left}, return_when=asyncio.FIRST_COMPLETED)
            if not task.done():
                raise ConnectionResetError("the client has left")
            return task.result()
        finally:
            if not task.done():
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError, Exception):
                    await task
