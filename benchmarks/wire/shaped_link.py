"""A TCP connection made slower: a proxy on loopback that passes so many bits a second, and counts them.

As a program, ``python -m benchmarks.wire.shaped_link PORT RATE``, it prints the port that it listens on. What arrives
faster waits in its buffers and in those of the kernel, as in a modem.
"""

from __future__ import annotations

import asyncio
import contextlib
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Final

_PIECE: Final = 16_384
"""Most bytes that are passed at once."""

_PACKET: Final = 1448
"""The same on a link on which a piece would take long: those of a packet of Ethernet."""

_FAST: Final = 10e6
"""Rate from which on pieces are large [bit/s]."""


@dataclass(slots=True)
class ShapedLink:
    """The proxy's address and what has passed it."""

    port: int = 0
    down: int = 0
    """Bytes passed to clients."""
    up: int = 0
    """Bytes passed to the server."""


@dataclass(slots=True)
class _Pace:
    """When the next piece may pass, for all connections of one direction together."""

    bytes_per_second: float
    free_at: float = 0.0

    async def wait(self, size: int) -> None:
        now = time.monotonic()
        begin = max(now, self.free_at)
        self.free_at = begin + size / self.bytes_per_second
        if self.free_at > now:
            await asyncio.sleep(self.free_at - now)


@asynccontextmanager
async def shaped_link(server_port: int, bits_per_second: float) -> AsyncIterator[ShapedLink]:
    """Listen on a free port of loopback and pass connections on to a server, each way at a limited rate.

    Args:
        server_port: of the server on 127.0.0.1.
        bits_per_second: each way, for all connections together; infinite for no limit.
    """
    link = ShapedLink()
    down, up = _Pace(bits_per_second / 8), _Pace(bits_per_second / 8)
    writers: set[asyncio.StreamWriter] = set()

    async def connected(client: asyncio.StreamReader, to_client: asyncio.StreamWriter) -> None:
        try:
            server, to_server = await asyncio.open_connection("127.0.0.1", server_port)
        except OSError:
            to_client.close()
            return
        writers.update((to_client, to_server))

        async def pass_on(
            source: asyncio.StreamReader,
            sink: asyncio.StreamWriter,
            pace: _Pace,
            *,
            downwards: bool,
        ) -> None:
            size = _PIECE if bits_per_second > _FAST else _PACKET
            with contextlib.suppress(ConnectionError):
                while piece := await source.read(size):
                    await pace.wait(len(piece))
                    if downwards:
                        link.down += len(piece)
                    else:
                        link.up += len(piece)
                    sink.write(piece)
                    await sink.drain()
            with contextlib.suppress(ConnectionError, OSError):
                sink.write_eof()

        await asyncio.gather(
            pass_on(server, to_client, down, downwards=True),
            pass_on(client, to_server, up, downwards=False),
        )
        for writer in (to_client, to_server):
            writer.close()
            writers.discard(writer)

    proxy = await asyncio.start_server(connected, "127.0.0.1", 0)
    link.port = proxy.sockets[0].getsockname()[1]
    try:
        yield link
    finally:
        proxy.close()
        for writer in writers:
            writer.transport.abort()


async def _serve(port: int, bits_per_second: float) -> None:
    async with shaped_link(port, bits_per_second) as link:
        sys.stdout.write(f"{link.port}\n")
        sys.stdout.flush()
        await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(_serve(int(sys.argv[1]), float(sys.argv[2])))
