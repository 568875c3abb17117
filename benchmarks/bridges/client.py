"""One client for all servers: what it sees of a stream, a stick, a crowd and of large frames."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import sys
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from benchmarks.bridges.servers import ECHOED

SECONDS: Final = 2.5
"""Of each stream, in each round."""

TRIPS: Final = 150
"""Of a stick, in each round."""

TIMES: Final = 10
"""That a large frame is sent, in each round, by one client and beside another."""

CALL: Final = '{"op":"call_service","service":"/rosapi/get_time"}'

_INTEGER: Final = rb"([\x00-\x17]|\x18.|\x19..|\x1a....)"
_STAMP: Final = re.compile(rb"\x63sec%b\x67nanosec%b" % (_INTEGER, _INTEGER), re.DOTALL)
"""In CBOR."""

Figures: TypeAlias = dict[str, float]


@dataclass
class Peer:
    """A server's process, as a client and the kernel see it."""

    kind: str
    url: str
    pid: int

    @property
    def cpu(self) -> float:
        """Its time on processors so far [s]."""
        return time.clock_gettime((~self.pid << 3) | 2)  # CPUCLOCK_SCHED of linux/posix-timers.h

    @property
    def memory(self) -> float:
        """What it holds of the machine's memory [MB]."""
        pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        return pages * 4096 / 1e6

    @asynccontextmanager
    async def client(self, window: int | None = None) -> AsyncIterator[ClientConnection]:
        """Yield a connection, whose socket takes in at most ``window`` bytes that are not read."""
        raw = socket.socket()
        if window is not None:
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, window)
        raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        raw.setblocking(False)
        port = int(self.url.rpartition(":")[2])
        await asyncio.get_running_loop().sock_connect(raw, ("127.0.0.1", port))
        protocols = [Subprotocol("foxglove.sdk.v1")] if self.kind == "foxglove" else None
        options: dict[str, Any] = {"compression": None, "max_size": None, "close_timeout": 0.2}
        async with connect(self.url, sock=raw, subprotocols=protocols, **options) as connection:
            yield connection

    async def subscribe(self, connection: ClientConnection, topic: str, coding: str) -> None:
        """Ask for a topic in the server's language."""
        if self.kind != "foxglove":
            operation = {"op": "subscribe", "topic": topic, "compression": coding}
            await connection.send(json.dumps(operation))
            return
        channels: dict[str, int] = {}
        while topic not in channels:
            frame = await connection.recv()
            said = json.loads(frame) if isinstance(frame, str) else {}
            channels |= {c["topic"]: c["id"] for c in said.get("channels", ())}
        wanted = [{"id": 1, "channelId": channels[topic]}]
        await connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def age(self, frame: bytes) -> float | None:
        """Return how old a message is [s]; None if it does not belong to a stream."""
        now = time.monotonic_ns()
        if self.kind == "foxglove":
            return (
                (now - int.from_bytes(frame[5:13], "little")) / 1e9 if frame[:1] == b"\1" else None
            )
        if text := re.search(rb'"sec":(\d+),"nanosec":(\d+)', frame[:300]):
            return (now - int(text[1]) * 10**9 - int(text[2])) / 1e9
        if binary := _STAMP.search(frame[:300]):
            sec, nanosec = (int.from_bytes(part[1:] or part) for part in binary.groups())
            return (now - sec * 10**9 - nanosec) / 1e9
        return None

    async def costs(self) -> list[float]:
        """Return the statistics of our server: messages encoded, time spent on it, bytes queued."""
        async with self.client() as asking:
            await asking.send('{"op":"call_service","service":"/costs"}')
            return list(json.loads(json.loads(await asking.recv())["values"]["message"]))


@asynccontextmanager
async def running(kind: str) -> AsyncIterator[Peer]:
    """Start a server."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "benchmarks.bridges.servers", kind),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        url = (await process.stdout.readline()).decode().strip()
        yield Peer(kind, url, process.pid)
    finally:
        process.stdin.close()
        await process.wait()


async def stream(
    peer: Peer, topic: str, coding: str, clients: int = 1, stalled: bool = False
) -> tuple[list[float], Figures]:
    """Return the ages of messages when their last byte was there [s], and what they cost."""
    ages: list[float] = []
    begun = 0.0

    async def receive(connection: ClientConnection) -> None:
        while True:
            frame = await connection.recv(decode=False)
            if time.monotonic() > begun + 0.5 and (age := peer.age(frame)) is not None:
                ages.append(age)

    async with AsyncExitStack() as stack:
        if stalled:
            hanging = await stack.enter_async_context(peer.client(65_536))
            await peer.subscribe(hanging, topic, coding)
            hanging.transport.pause_reading()
        connections = [await stack.enter_async_context(peer.client()) for _ in range(clients)]
        for connection in connections:
            await peer.subscribe(connection, topic, coding)
        await asyncio.sleep(0.2)
        costs = await peer.costs() if peer.kind == "ours" else [0.0] * 4
        begun, before, memory = time.monotonic(), peer.cpu, peer.memory
        hearers = [asyncio.create_task(receive(connection)) for connection in connections]
        await asyncio.sleep(SECONDS + 0.5)
        used, passed = peer.cpu - before, time.monotonic() - begun
        figures = {"cpu": 100 * used / passed, "held": peer.memory - memory}
        if peer.kind == "ours":
            after = await peer.costs()
            number = max(after[0] - costs[0], 1)
            figures |= {"number": number, "encode": 1e3 * (after[1] - costs[1]) / number}
            figures |= {"send": 1e3 * used / number - figures["encode"]}
            figures |= {"queue": after[2] / 1e6, "unsent": after[3] / 1e6}
        for hearer in hearers:
            hearer.cancel()
        await asyncio.gather(*hearers, return_exceptions=True)
        for connection in connections:
            connection.transport.abort()
        if stalled:
            hanging.transport.abort()
    return ages, figures | {"rate": len(ages) / SECONDS / clients}


async def stick(peer: Peer, load: bool) -> tuple[list[float], Figures]:
    """Return times from a Joy to its echo [s], with a cloud in JSON on the same socket or without."""
    trips: list[float] = []
    async with peer.client() as driver:
        await driver.send('{"op":"subscribe","topic":"/joy","type":"sensor_msgs/Joy"}')
        if load:
            await peer.subscribe(driver, "/cloud", "none")
        joy = '{"op":"publish","topic":"/joy","msg":{"axes":[0.0,1.0],"buttons":[0,0,0,0,1]}}'
        for _ in range(TRIPS):
            begun = time.perf_counter()
            await driver.send(joy)
            while b'"/joy"' not in (await driver.recv(decode=False))[:60]:
                pass
            trips.append(time.perf_counter() - begun)
            await asyncio.sleep(0.013)
    return trips, {}


async def crowd(peer: Peer) -> tuple[list[float], Figures]:
    """Return how long a hundred clients take to connect at once, be answered, and leave [s]."""

    async def one() -> None:
        async with peer.client() as caller:
            if peer.kind != "foxglove":  # which speaks first
                await caller.send(CALL)
            await caller.recv()

    begun = time.perf_counter()
    await asyncio.gather(*(one() for _ in range(100)))
    return [time.perf_counter() - begun], {}


async def behind(peer: Peer, frame: str | bytes) -> tuple[list[float], Figures]:
    """Return how long a frame's sender waits for its next answer [s], and what others wait for [ms].

    The former takes in the time to send the frame, the server's CPU time that to receive it.
    """
    delays = []
    async with peer.client() as rude:
        if peer.kind == "ours":
            await peer.costs()
        before = peer.cpu
        for _ in range(TIMES):
            begun = time.perf_counter()
            await rude.send(frame)
            await rude.send(CALL)
            while b"service_response" not in (await rude.recv(decode=False))[:40]:
                pass
            delays.append(time.perf_counter() - begun)
        figures = {"used": 1e3 * (peer.cpu - before) / TIMES}
        if peer.kind == "ours":
            figures["judged"] = 1e3 * (await peer.costs())[4]
    return delays, figures


async def advertise(peer: Peer) -> ClientConnection:
    """Return a connection that has advertised what large messages go to; it stays open."""
    connection = await connect(peer.url, compression=None, max_size=None, proxy=None)
    for topic, kind in ECHOED.items():
        await connection.send(json.dumps({"op": "advertise", "topic": topic, "type": kind}))
    return connection
