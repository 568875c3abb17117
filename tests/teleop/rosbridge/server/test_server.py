"""The server on local sockets; the tests wait for events, not for times."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from functools import wraps
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.errors import ServerError, ServiceError
from teleop.rosbridge.framing.outbox import QueueLimits
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.server import Server
from teleop.rosbridge.server.websocket_connection import WebSocketConnection
from tests.teleop.rosbridge.support import REGISTRY, ConnectionLog, client_ids

PATIENCE = 60.0
"""For what must come at all [s]; a loaded machine is no failure."""

CLOUD = np.zeros(1_000_000, np.uint8)
CHATTER = {"op": "subscribe", "topic": "/chatter", "type": "std_msgs/String"}
IMAGE = {"op": "subscribe", "topic": "/cloud", "type": "sensor_msgs/CompressedImage"}


def in_a_loop(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    @wraps(test)
    def run(*args: Any, **kwargs: Any) -> None:
        async def bounded() -> None:
            async with asyncio.timeout(PATIENCE):
                await test(*args, **kwargs)

        asyncio.run(bounded())

    return run


@asynccontextmanager
async def serving(limits: ClientLimits | None = None, **options: Any) -> AsyncIterator[Server]:
    protocol = Protocol(REGISTRY, limits=limits or ClientLimits.unhurried())
    server = Server(protocol, port=0, **options)
    serve_rosapi(protocol)
    server.protocol.topics.advertise("/chatter", "std_msgs/String")
    server.protocol.topics.advertise("/cloud", "sensor_msgs/CompressedImage")
    async with server:
        yield server


@asynccontextmanager
async def client(server: Server, **options: Any) -> AsyncIterator[ClientConnection]:
    # A small window, so that unread data does not remain in the kernel.
    window = socket.socket()
    window.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65_536)
    window.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # frames leave as they are sent
    window.setblocking(False)
    await asyncio.get_running_loop().sock_connect(window, ("127.0.0.1", server.port))
    options = {"compression": None, "max_size": None, "close_timeout": 0.2, **options}
    async with connect(server.url, sock=window, **options) as connection:
        yield connection


async def say(connection: ClientConnection, *operations: Message) -> None:
    """Send operations, and wait until the server has processed them."""
    for operation in operations:
        await connection.send(json.dumps(operation))
    await connection.send('{"op":"call_service","service":"/done","id":"done"}')
    while (await receive(connection)).get("id") != "done":
        pass


async def receive(connection: ClientConnection) -> Any:
    return json.loads(await connection.recv())


async def ended(connection: ClientConnection) -> None:
    """Take what comes until the server hangs up."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            await connection.recv()


async def until(condition: Callable[[], bool]) -> None:
    while not condition():  # noqa: ASYNC110 - the condition has no event
        await asyncio.sleep(0.005)


def stall(connection: ClientConnection) -> None:
    """Stop reading, as a client that hangs."""
    connection.transport.pause_reading()


@in_a_loop
async def test_compression_is_not_negotiated() -> None:
    async with serving() as server, client(server, compression="deflate") as a:
        assert a.response is not None
        assert "Sec-WebSocket-Extensions" not in a.response.headers


@in_a_loop
async def test_stalled_readers_do_not_affect_others() -> None:
    async with serving() as server, client(server) as stalled, client(server) as good:
        await say(stalled, {**IMAGE, "compression": "cbor"}, CHATTER)
        await say(good, {**IMAGE, "compression": "cbor"})
        (first, second) = sorted(client_ids(server.protocol))
        stall(stalled)
        for i in range(20):
            server.protocol.topics.publish("/cloud", {"data": CLOUD, "format": str(i)}, server.now)
            server.protocol.topics.publish("/chatter", {"data": str(i)}, server.now)
            await good.recv()
        assert server.waiting(first) < 2 * len(CLOUD)
        assert server.waiting(second) == 0
        stalled.transport.resume_reading()
        clouds: list[bytes] = []
        last = ""
        while not clouds or b"format\x62" + b"19" not in clouds[-1]:
            frame = await stalled.recv()
            if isinstance(frame, bytes):
                clouds.append(frame)
            else:
                last = frame
        assert len(clouds) <= 3  # one in transit, one queued, and one may fit into the kernel
        assert last == '{"op":"publish","topic":"/chatter","msg":{"data":"19"}}'  # before the cloud


@in_a_loop
async def test_responses_overtake_queued_messages() -> None:
    async with serving() as server, client(server) as a:
        called: list[str] = []

        def trigger(client: int, request: Message, now: int) -> Message:
            called.append("t")
            return {"success": True}

        server.protocol.services.serve("/trigger", "std_srvs/Trigger", trigger)
        await say(a, CHATTER)
        stall(a)
        for _ in range(100):
            server.protocol.topics.publish("/chatter", {"data": "x" * 60_000}, server.now)
        await a.send('{"op":"call_service","service":"/trigger","id":"t"}')
        await until(lambda: "t" in called)
        a.transport.resume_reading()
        while (await receive(a))["op"] != "service_response":
            pass
        assert (await receive(a))["op"] == "publish"


@in_a_loop
async def test_small_messages_of_a_moment_leave_in_one_write() -> None:
    async with serving() as server, client(server) as a:
        await say(a, CHATTER)
        with patch.object(
            WebSocketConnection, "write", autospec=True, side_effect=WebSocketConnection.write
        ) as spy:
            for i in range(10):
                server.protocol.topics.publish("/chatter", {"data": str(i)}, server.now)
            texts = [(await receive(a))["msg"]["data"] for _ in range(10)]
        assert texts == [str(i) for i in range(10)]
        assert spy.call_count == 1


@in_a_loop
async def test_services_may_be_coroutines_and_fail(caplog: pytest.LogCaptureFixture) -> None:
    async with serving() as server, client(server) as a:

        async def handle(client: int, request: Message, now: int) -> Message:
            await asyncio.sleep(0)
            if request["data"]:
                raise ServiceError("not today")
            return {"success": True}

        async def fall(client: int, request: Message, now: int) -> Message:
            raise ZeroDivisionError

        server.protocol.services.serve(
            "/set", "std_srvs/SetBool", server.async_handlers.wrap(handle)
        )
        server.protocol.services.serve(
            "/fall", "std_srvs/Trigger", server.async_handlers.wrap(fall)
        )
        for service, data in (("/set", False), ("/set", True)):
            call = {"op": "call_service", "service": service, "args": {"data": data}}
            await a.send(json.dumps(call))
        assert (await receive(a))["values"]["success"] is True
        assert (await receive(a))["values"] == "not today"
        await a.send('{"op":"call_service","service":"/fall"}')
        assert (await receive(a))["result"] is False
        assert "ZeroDivisionError" in caplog.text


@in_a_loop
async def test_throttled_messages_are_sent_by_the_timer() -> None:
    async with serving() as server, client(server) as a:
        await say(a, {**CHATTER, "throttle_rate": 50})
        for data in "123":
            server.protocol.topics.publish("/chatter", {"data": data}, server.now)
        assert [(await receive(a))["msg"]["data"] for _ in range(2)] == ["1", "3"]


@in_a_loop
async def test_observers_see_connections_and_disconnections() -> None:
    async with serving() as server:
        log = ConnectionLog(server.protocol)
        async with client(server) as a:
            await say(a)
            (connection,) = log.connections
            assert server.protocol.connections.name(connection.id) == connection.name
            assert log.disconnections == []
            a.transport.abort()  # without close frame
            await until(lambda: bool(log.disconnections))
        assert log.disconnections == [connection]
        assert "127.0.0.1:" in connection.name
        assert len(server.protocol.connections) == 0


@in_a_loop
async def test_clients_that_read_nothing_are_disconnected() -> None:
    pulse = Keepalive(ping_interval=None, ping_timeout=None, write_timeout=0.2)
    async with serving(keepalive=pulse) as server, client(server) as a:
        log = ConnectionLog(server.protocol)
        await say(a, {**IMAGE, "compression": "cbor"})
        stall(a)
        while not log.disconnections:
            server.protocol.topics.publish("/cloud", {"data": CLOUD}, server.now)
            await asyncio.sleep(0.01)
        assert log.disconnections[0].closed_for == "does not read from its socket"


@pytest.mark.slow
@in_a_loop
async def test_disconnections_below_the_messages_have_a_reason_and_goodbyes_have_none() -> None:
    async with serving(ClientLimits(control=10, burst=1)) as server:
        log = ConnectionLog(server.protocol)
        async with client(server) as a, client(server):
            for _ in range(100):
                await a.ping()
            await until(lambda: len(log.disconnections) == 1)
        await until(lambda: len(log.disconnections) == 2)
        reasons = [connection.closed_for for connection in log.disconnections]
        assert reasons == ["more than 10 pings and pongs/s", ""]


@pytest.mark.slow
@in_a_loop
async def test_clients_with_too_many_queued_responses_are_disconnected() -> None:
    async with serving(queue_limits=QueueLimits(control=10_000)) as server, client(server) as a:
        await say(a)
        stall(a)
        call = json.dumps({"op": "call_service", "service": "/nope" * 1000})
        for _ in range(200):  # more than buffers hold
            await a.send(call)
        a.transport.resume_reading()
        await ended(a)
        assert (a.close_code, a.close_reason) == (1013, "send queue exceeds 10000 bytes")


@in_a_loop
async def test_server_closes_despite_a_hanging_client() -> None:
    async with serving(lockstep=True) as server, client(server) as a:
        await say(a, {**IMAGE, "compression": "cbor"})
        stall(a)
        for _ in range(10):
            server.protocol.topics.publish("/cloud", {"data": CLOUD}, server.now)
            await asyncio.sleep(0.01)


@in_a_loop
async def test_clients_receive_the_reason_when_the_server_closes() -> None:
    async with serving() as server:
        a = await connect(server.url, proxy=None)
    with pytest.raises(ConnectionClosed):
        await a.recv()
    assert (a.close_code, a.close_reason) == (1001, "the server is shutting down")


@in_a_loop
async def test_server_listens_on_loopback_only() -> None:
    async with serving() as server:
        assert server.addresses == ["127.0.0.1"]
        assert server.url == f"ws://127.0.0.1:{server.port}"


@in_a_loop
async def test_an_address_that_cannot_be_listened_on_is_a_one_line_error() -> None:
    async with serving() as holder:
        for host, port, why in (
            ("127.0.0.1", holder.port, rf"port {holder.port} of 127\.0\.0\.1 is in use: .*0: any"),
            ("192.0.2.1", 0, r"cannot listen on port 0 of 192\.0\.2\.1"),
        ):
            with pytest.raises(ServerError, match=why):
                await Server(Protocol(REGISTRY), host, port).start()


@in_a_loop
async def test_foreign_origins_are_rejected() -> None:
    async with serving(origins=["https://lab.example"]) as server:
        for origin, status in (("https://evil.example", 403), ("null", 403)):
            with pytest.raises(InvalidStatus) as caught:
                await connect(server.url, origin=origin, proxy=None)  # type: ignore[arg-type]
            assert caught.value.response.status_code == status
        async with client(server, origin="https://lab.example") as a:
            await say(a)
