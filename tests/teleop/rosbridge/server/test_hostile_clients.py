"""While one client is hostile, another receives every message of a stream."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import socket
import ssl
import struct
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from random import Random
from typing import Any

import pytest

from teleop.rosbridge import Keepalive, Server, tls_context
from teleop.rosbridge.server import http_connection as opening
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.rosbridge.server.test_server import (
    CHATTER,
    client,
    in_a_loop,
    say,
    serving,
    until,
)

CALL = '{"op":"call_service","service":"/rosapi/get_time","id":"c"}'


@asynccontextmanager
async def beside_a_stream(**options: Any) -> AsyncIterator[Server]:
    """A server that publishes at full speed, and a client that must receive every message."""
    async with serving(**options) as server, client(server) as bystander:
        await say(bystander, CHATTER)
        sent = 0
        stop = asyncio.Event()

        async def publish() -> None:
            nonlocal sent
            while not stop.is_set():
                server.protocol.topics.publish("/chatter", {"data": str(sent)}, server.now)
                sent += 1
                await asyncio.sleep(0.002)

        arrived: list[str] = []

        async def receive() -> None:
            async for frame in bystander:
                arrived.append(json.loads(frame)["msg"]["data"])

        publisher, hearer = asyncio.create_task(publish()), asyncio.create_task(receive())
        yield server
        before = sent
        await until(lambda: sent >= before + 5)  # the loop still runs
        stop.set()
        await publisher
        await until(lambda: len(arrived) >= sent or hearer.done())
        hearer.cancel()
        assert arrived == [str(number) for number in range(sent)]


async def opened(server: Server) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Open a WebSocket without library, to send invalid frames."""
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    key = base64.b64encode(os.urandom(16)).decode()
    writer.write(
        f"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
    return reader, writer


def masked(payload: bytes, first: int = 0x81) -> bytes:
    """Return a client's frame, masked by zeros."""
    size = len(payload)
    if size < 126:
        head = struct.pack("!BB", first, 0x80 | size)
    else:
        head = struct.pack("!BBQ", first, 0x80 | 127, size)
    return head + bytes(4) + payload


async def close_code(reader: asyncio.StreamReader) -> int:
    """Return the code with which the server closes the connection, ignoring earlier frames."""
    while True:
        first, size = await reader.readexactly(2)
        size = struct.unpack("!H", await reader.readexactly(2))[0] if size == 126 else size
        payload = await reader.readexactly(size)
        if first == 0x88:
            return int(struct.unpack("!H", payload[:2])[0])


VIOLATIONS = {
    "too long": (masked(b"x" * 1_000_001), 1009),
    "too long by its head": (struct.pack("!BBQ", 0x81, 0xFF, 2**62), 1009),
    "no UTF-8": (masked(b"\xff\xfe"), 1007),
    "a surrogate": (masked(b"\xed\xa0\x80"), 1007),
    "an unknown opcode": (masked(b"x", 0x83), 1002),
    "deflated": (masked(b"x", 0xC1), 1002),
    "not masked": (b"\x81\x01x", 1002),
    "a large ping": (masked(b"x" * 300, 0x89), 1002),
    "without a beginning": (masked(b"x", 0x80), 1002),
    "too long in pieces": (masked(b"x" * 900_000, 0x01) + masked(b"x" * 900_000, 0x00), 1009),
}


@pytest.mark.slow
@in_a_loop
async def test_websocket_violations_close_with_their_code() -> None:
    async with beside_a_stream() as server:
        for what, (sent, code) in VIOLATIONS.items():
            reader, writer = await opened(server)
            writer.write(sent)
            assert await close_code(reader) == code, what
            writer.close()


async def slow_loris(server: Server) -> None:
    """Send the bytes of a frame one by one, without the last."""
    _, writer = await opened(server)
    writer.write(struct.pack("!BBQ", 0x81, 0xFF, 900_000))
    for _ in range(50):
        writer.write(b"x")
        await asyncio.sleep(0.001)
    writer.close()


async def half_open(server: Server) -> None:
    """Connect many times and send nothing or half a request, or abort the connection."""
    writers = []
    for said in (b"", b"GET / HT", b"\x16\x03\x01") * 20:
        _, writer = await asyncio.open_connection("127.0.0.1", server.port)
        writer.write(said)
        writers.append(writer)
    await asyncio.sleep(0.01)
    for writer in writers:
        writer.close()
    _, writer = await opened(server)
    linger = struct.pack("ii", 1, 0)
    writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
    writer.transport.abort()


async def deep_and_wide(server: Server) -> None:
    async with client(server) as attacker:
        for frame in ("[" * 900_000, '{"a":' * 150_000, "[" + "[]," * 300_000 + "[]]"):
            await attacker.send(frame)
            assert json.loads(await attacker.recv())["op"] == "status"


async def floods(server: Server) -> None:
    async with client(server) as attacker:
        for _ in range(300):
            await attacker.send('{"op":"x"}' * 50)
            await attacker.ping()


async def mutates(server: Server) -> None:
    """Send valid frames with some bits flipped."""
    random = Random(0)
    call = masked(CALL.encode())
    say = masked(json.dumps({"op": "publish", "topic": "/t", "msg": {"data": "x" * 200}}).encode())
    for _ in range(60):
        _, writer = await opened(server)
        frames = bytearray(b"".join(random.choices([call, say, masked(b"", 0x89)], k=8)))
        for _ in range(random.randint(1, 12)):
            frames[random.randrange(len(frames))] ^= 1 << random.randrange(8)
        writer.write(frames)
        await asyncio.sleep(0.001)
        writer.close()


@pytest.mark.slow
@pytest.mark.parametrize("attack", [slow_loris, half_open, deep_and_wide, floods, mutates])
@in_a_loop
async def test_hostile_clients_cost_others_no_message(
    attack: Callable[[Server], Awaitable[None]],
) -> None:
    async with beside_a_stream() as server:
        await attack(server)


REQUESTS = [
    (b"GET /" + b"x" * 9000 + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n", 414),
    (b"GET / HTTP/1.1\r\nHost: " + b"x" * 9000 + b"\r\n", 431),
    (b"GET / HTTP/1.1\r\n" + b"X-A: b\r\n" * 200, 431),
    (b"GET / HTTP/1.1\r\n" + b"X" * 500_000, 431),
    (b"GET / HTTP/1.1\r\n" + (b"X-A: " + b"x" * 1000 + b"\r\n") * 17, 431),
    (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n" + b"X-A: b\r\n" * 64, 431),
    (b"GET /healthz HTTP/1.1\r\n" + b"Host: 127.0.0.1\r\n" * 2, 400),
    (b"GET /healthz HTTP/1.1\r\nHost: a\r\n" + b"Origin: http://a\r\n" * 2, 400),
    (b"GET /healthz HTTP/1.1\r\nHost: a\r\n" + b"If-None-Match: x\r\n" * 2, 400),
    (b"GET /healthz HTTP/1.1\r\nHost: evil.example:9090\r\n", 403),
    (b"GET /healthz HTTP/1.1\r\nHost: localhost:9090\r\n", 200),
    (b"GET /healthz HTTP/1.1\r\nHost: localhost:9090\r\nCookie: theme=\x01\r\n", 400),
    *(
        (b"GET /healthz HTTP/1.1\r\nHost: localhost:9090\r\nCookie: user=" + cookie + b"\r\n", 200)
        for cookie in ("Łukasz".encode(), b"M\xfcller")
    ),
]


@in_a_loop
async def test_requests_that_are_too_long_odd_or_in_doubt_are_answered_with_their_code() -> None:
    async with beside_a_stream() as server:
        for lines, status in REQUESTS:
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(lines + b"\r\n")
            assert f" {status} ".encode() in await reader.readline(), lines[:60]
            writer.close()


@pytest.mark.slow
@in_a_loop
async def test_unresponsive_connection_within_a_frame_is_closed() -> None:
    async with beside_a_stream(keepalive=Keepalive(0.05, 1.0, 1.0)) as server:
        reader, writer = await opened(server)
        writer.write(struct.pack("!BBQ", 0x81, 0xFF, 900_000) + b"x" * 100)
        await reader.read()  # until the end of the stream
        writer.close()


@in_a_loop
async def test_connections_without_tls_handshake_are_aborted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("teleop.rosbridge.server.listener.HEADER_TIMEOUT", 0.1)
    assert opening.HEADER_TIMEOUT > 0.1
    crt, key = certificate(tmp_path)
    async with serving(tls=tls_context(crt, key)) as server:
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
        assert await reader.read() == b""
        writer.close()
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
        writer.write(b"GET / HTTP/1.1\r\n\r\n")
        assert b"HTTP" not in await reader.read()
        writer.close()
        monkeypatch.setattr("teleop.rosbridge.server.listener.HEADER_TIMEOUT", 60.0)
        trust = ssl.create_default_context(cafile=str(crt))
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port, ssl=trust)
        writer.write(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert b" 200 " in await reader.readline()
        writer.close()
