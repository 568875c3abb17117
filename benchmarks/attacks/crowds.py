"""Attackers that come from ever other addresses of this machine, 127.0.0.2 and on, and those that crowd at the door."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Final
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

_NUMBERS: Final = itertools.count(2)


def other_address() -> str:
    """Return an address of this machine that was not used before, of sixteen million."""
    number = next(_NUMBERS)
    return f"127.{number >> 16 & 255}.{number >> 8 & 255}.{number & 255}"


async def dialled(
    url: str, address: str, *, tls: bool = False
) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Open a socket from an address."""
    place = urlsplit(url)
    context = ssl._create_unverified_context() if tls else None
    return await asyncio.open_connection(
        place.hostname, place.port, local_addr=(address, 0), ssl=context, limit=1024
    )


@asynccontextmanager
async def client_of(url: str, address: str) -> AsyncIterator[ClientConnection]:
    """A WebSocket from an address."""
    options: dict[str, Any] = {"compression": None, "close_timeout": 0.1, "ping_interval": None}
    async with connect(url, proxy=None, local_addr=(address, 0), **options) as connection:
        yield connection


async def header_bombs(url: str) -> None:
    """Send a request with headers of 960 kB."""
    reader, writer = await dialled(url, other_address())
    lines = b"".join(b"X-%d: %s\r\n" % (n, b"x" * 8000) for n in range(120))
    writer.write(f"GET /healthz HTTP/1.1\r\nHost: {urlsplit(url).netloc}\r\n".encode())
    writer.write(lines + b"\r\n")
    with contextlib.suppress(OSError, TimeoutError):
        async with asyncio.timeout(5):
            await reader.read()
    writer.transport.abort()


async def places_of_one_address(url: str) -> None:
    """Hold eight WebSockets of one address without a token, for five seconds."""
    held = []
    for _ in range(8):
        with contextlib.suppress(WebSocketException, OSError):
            held.append(await connect(url, proxy=None, local_addr=("127.0.0.9", 0)))
    await asyncio.sleep(5)
    for one in held:
        one.transport.abort()


async def vanishing_operations(url: str) -> None:
    """Send 390 operations and leave."""
    async with client_of(url, other_address()) as connection:
        call = {"op": "call_service", "service": "/rosapi/topics_and_raw_types"}
        for _ in range(390):
            await connection.send(json.dumps(call))
        connection.transport.close()


async def tcp_churn(url: str) -> None:
    """Open 1500 sockets and say nothing, which a server with TLS takes for slow handshakes."""
    opened = []
    for _ in range(1500):
        with contextlib.suppress(OSError):
            opened.append((await dialled(url, "127.0.0.9"))[1])
    await asyncio.sleep(2)
    for writer in opened:
        writer.transport.abort()


async def map_takers(url: str) -> None:
    """Take the map four times from one address, a little of it each second."""
    address, takers = other_address(), []
    for _ in range(4):
        reader, writer = await dialled(url, address)
        writer.write(f"GET /map.ply HTTP/1.1\r\nHost: {urlsplit(url).netloc}\r\n\r\n".encode())
        takers.append((reader, writer))
    for _ in range(8):
        await asyncio.sleep(1)
        for reader, _ in takers:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(reader.read(65_536), 0.1)
    for _, writer in takers:
        writer.transport.abort()


async def ping_crowd(url: str) -> None:
    """Ping without end from ever other addresses, and read nothing."""
    async with client_of(url, other_address()) as connection:
        connection.transport.pause_reading()
        frames = (b"\x89\x80" + bytes(4)) * 5000
        begun = asyncio.get_running_loop().time()
        while not connection.transport.is_closing():
            connection.transport.write(frames)
            await asyncio.sleep(0.01)
            if asyncio.get_running_loop().time() - begun > 1:
                break
        connection.transport.abort()
