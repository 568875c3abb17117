"""The server on real sockets of this machine; all waiting is for something to happen."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from functools import wraps
from typing import Any

import numpy as np
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.errors import ServerError, ServiceError
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.outbox import QueueLimits
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.support import REGISTRY, ConnectionLog, client_ids

PATIENCE = 20.0
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
    # A narrow window, so that what nobody reads does not hide in the kernel.
    window = socket.socket()
    window.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65_536)
    window.setblocking(False)
    await asyncio.get_running_loop().sock_connect(window, ("127.0.0.1", server.port))
    options = {"compression": None, "max_size": None, "close_timeout": 0.2, **options}
    async with connect(server.url, sock=window, **options) as connection:
        yield connection


async def say(connection: ClientConnection, *operations: Message) -> None:
    """Send operations, and wait until the server has done them."""
    for operation in operations:
        await connection.send(json.dumps(operation))
    await connection.send('{"op":"call_service","service":"/done","id":"done"}')
    while (await hear(connection)).get("id") != "done":
        pass


async def hear(connection: ClientConnection) -> Any:
    return json.loads(await connection.recv())


async def until(condition: Callable[[], bool]) -> None:
    while not condition():  # noqa: ASYNC110 - there is no event for what a test waits for
        await asyncio.sleep(0.005)


def stall(connection: ClientConnection) -> None:
    """Have a client read nothing more, as one that hangs."""
    connection.transport.pause_reading()


@in_a_loop
async def test_a_message_reaches_all_subscribers() -> None:
    async with serving() as server, client(server) as a, client(server) as b:
        await say(a, CHATTER)
        await say(b, CHATTER)
        server.protocol.topics.publish("/chatter", {"data": "x"}, server.now)
        assert (await hear(a))["msg"] == (await hear(b))["msg"] == {"data": "x"}
        assert len(server.protocol.connections) == 2


@in_a_loop
async def test_text_leaves_in_text_frames_and_cbor_in_binary_ones() -> None:
    async with serving() as server, client(server) as a, client(server) as b:
        await say(a, CHATTER)
        await say(b, {**CHATTER, "compression": "cbor"})
        server.protocol.topics.publish("/chatter", {"data": "x"}, server.now)
        assert isinstance(await a.recv(), str)
        assert isinstance(await b.recv(), bytes)


@in_a_loop
async def test_binary_frames_in_small_pieces_are_heard_as_ros_sharp_sends_them() -> None:
    async with serving() as server, client(server) as a:
        heard: list[Message] = []
        server.protocol.topics.subscribe(
            "/joy", "sensor_msgs/Joy", lambda client, message, now: heard.append(message)
        )
        frame = json.dumps(
            {"op": "publish", "topic": "/joy", "msg": {"axes": [0.5] * 2000}}
        ).encode()
        await a.send([frame[i : i + 1024] for i in range(0, len(frame), 1024)])
        await until(lambda: bool(heard))
        assert len(heard[0]["axes"]) == 2000


@in_a_loop
async def test_nothing_is_deflated_even_if_the_client_offers_it() -> None:
    async with serving() as server, client(server, compression="deflate") as a:
        assert a.response is not None
        assert "Sec-WebSocket-Extensions" not in a.response.headers


@in_a_loop
async def test_a_frame_that_is_too_large_is_answered_with_1009() -> None:
    async with (
        serving(ClientLimits(frame=1000)) as server,
        client(server) as a,
        client(server) as b,
    ):
        await a.send("x" * 1001)
        with pytest.raises(ConnectionClosed):
            await a.recv()
        assert a.close_code == 1009
        await say(b)


@in_a_loop
async def test_who_floods_is_told_and_closed_with_1008_and_the_others_go_on() -> None:
    limits = ClientLimits(messages=50, burst=1)
    async with serving(limits) as server, client(server) as a, client(server) as b:
        for _ in range(200):
            await a.send(json.dumps(CHATTER))
        assert "rate limit of 50 operations" in (await hear(a))["msg"]
        with pytest.raises(ConnectionClosed):
            await a.recv()
        assert a.close_code == 1008
        await say(b, CHATTER)


@in_a_loop
async def test_a_stalled_reader_costs_the_others_nothing_and_keeps_one_bulk_message() -> None:
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
        frames: list[str | bytes] = []
        while not frames or frames[-1] != '{"op":"publish","topic":"/chatter","msg":{"data":"19"}}':
            frames.append(await stalled.recv())
        clouds = [frame for frame in frames if isinstance(frame, bytes)]
        assert len(clouds) <= 3  # one was on its way, one waited, and one may fit into the kernel
        assert b"format\x62" + b"19" in clouds[-1]


@in_a_loop
async def test_an_answer_overtakes_messages_that_wait() -> None:
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
        while (await hear(a))["op"] != "service_response":
            pass
        assert (await hear(a))["op"] == "publish"


@in_a_loop
async def test_in_lockstep_the_answer_comes_behind_all_messages_of_its_ticks() -> None:
    time = 0
    async with serving(lockstep=True, clock=lambda: time) as server, client(server) as a:
        steps: list[tuple[int, int, DeferredResponse]] = []

        def step(client: int, request: Message, now: int) -> DeferredResponse:
            server.protocol.connections.set_lossless(client)
            later = DeferredResponse()
            steps.append((client, request["ticks"], later))
            return later

        server.protocol.services.serve("/sim/step", "farsteer_msgs/Step", step)
        await say(a, {**CHATTER, "queue_length": 1}, {**IMAGE, "queue_length": 1})
        call = {"op": "call_service", "service": "/sim/step", "args": {"ticks": 50}, "id": "s"}
        await a.send(json.dumps(call))
        await until(lambda: bool(steps))
        caller, ticks, later = steps[0]
        for i in range(ticks):
            time += 20_000_000
            server.protocol.topics.publish("/chatter", {"data": str(i)}, server.now)
            server.protocol.topics.publish("/cloud", {"data": CLOUD[:100_000]}, server.now)
        later.complete({"success": True})
        heard = [await hear(a) for _ in range(101)]
        assert [h["op"] for h in heard] == ["publish"] * 100 + ["service_response"]
        assert [h["msg"]["data"] for h in heard[:-1:2]] == [str(i) for i in range(50)]
        await server.flush(caller)
        assert server.waiting(caller) == 0


@in_a_loop
async def test_a_service_may_be_a_coroutine_and_say_no(caplog: pytest.LogCaptureFixture) -> None:
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
        assert (await hear(a))["values"]["success"] is True
        assert (await hear(a))["values"] == "not today"
        await a.send('{"op":"call_service","service":"/fall"}')
        assert (await hear(a))["result"] is False
        assert "ZeroDivisionError" in caplog.text


@in_a_loop
async def test_a_throttled_message_arrives_without_the_host_doing_anything() -> None:
    async with serving() as server, client(server) as a:
        await say(a, {**CHATTER, "throttle_rate": 50})
        for data in "123":
            server.protocol.topics.publish("/chatter", {"data": data}, server.now)
        assert [(await hear(a))["msg"]["data"] for _ in range(2)] == ["1", "3"]


@in_a_loop
async def test_the_host_hears_who_comes_and_who_goes() -> None:
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
async def test_who_answers_no_ping_is_disconnected() -> None:
    pulse = Keepalive(ping_interval=0.05, ping_timeout=0.1)
    async with serving(keepalive=pulse) as server, client(server) as a:
        log = ConnectionLog(server.protocol)
        await say(a)
        stall(a)
        await until(lambda: bool(log.disconnections))


@in_a_loop
async def test_who_takes_nothing_off_its_socket_is_cut_off() -> None:
    pulse = Keepalive(ping_interval=None, ping_timeout=None, write_timeout=0.2)
    async with serving(keepalive=pulse) as server, client(server) as a:
        log = ConnectionLog(server.protocol)
        await say(a, {**IMAGE, "compression": "cbor"})
        stall(a)
        while not log.disconnections:
            server.protocol.topics.publish("/cloud", {"data": CLOUD}, server.now)
            await asyncio.sleep(0.01)


@in_a_loop
async def test_who_lets_answers_pile_up_is_disconnected() -> None:
    pulse = Keepalive(ping_interval=None, ping_timeout=None, write_timeout=0.2)
    bounds = QueueLimits(control=10_000)
    async with serving(queue_limits=bounds, keepalive=pulse) as server, client(server) as a:
        log = ConnectionLog(server.protocol)
        await say(a)
        stall(a)
        call = json.dumps({"op": "call_service", "service": "/nope" * 1000})
        while not log.disconnections:
            try:
                await a.send(call)
            except ConnectionClosed:
                break
        await until(lambda: bool(log.disconnections))


@in_a_loop
async def test_the_server_ends_though_a_client_hangs() -> None:
    async with serving(lockstep=True) as server, client(server) as a:
        await say(a, {**IMAGE, "compression": "cbor"})
        stall(a)
        for _ in range(10):
            server.protocol.topics.publish("/cloud", {"data": CLOUD}, server.now)
            await asyncio.sleep(0.01)


@in_a_loop
async def test_clients_are_told_when_the_server_ends() -> None:
    async with serving() as server:
        a = await connect(server.url, proxy=None)
    with pytest.raises(ConnectionClosed):
        await a.recv()
    assert (a.close_code, a.close_reason) == (1001, "the server is shutting down")


@in_a_loop
async def test_only_the_loopback_is_listened_at() -> None:
    async with serving() as server:
        assert server._listener.addresses == ["127.0.0.1"]
        assert server.url == f"ws://127.0.0.1:{server.port}"


@in_a_loop
async def test_a_port_in_use_is_one_clear_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as holder:
        port = holder.getsockname()[1]
        with pytest.raises(ServerError, match=rf"port {port} of 127\.0\.0\.1 is in use: .*0: any"):
            await Server(Protocol(REGISTRY), port=port).start()


@in_a_loop
async def test_an_address_that_is_not_ours_is_one_clear_line() -> None:
    with pytest.raises(ServerError, match=r"cannot listen on port 0 of 192\.0\.2\.1"):
        await Server(Protocol(REGISTRY), host="192.0.2.1", port=0).start()


@in_a_loop
async def test_pages_from_elsewhere_are_refused() -> None:
    async with serving(origins=["https://lab.example"]) as server:
        for origin, status in (("https://evil.example", 403), ("null", 403)):
            with pytest.raises(InvalidStatus) as caught:
                await connect(server.url, origin=origin, proxy=None)  # type: ignore[arg-type]
            assert caught.value.response.status_code == status
        async with client(server, origin="https://lab.example") as a:
            await say(a)


@in_a_loop
async def test_more_clients_than_there_may_be_are_refused() -> None:
    async with serving(ClientLimits(clients=1)) as server, client(server) as a:
        await say(a)
        with pytest.raises(InvalidStatus, match="503"):
            await connect(server.url, proxy=None)
        await say(a)


@in_a_loop
async def test_many_clients_come_and_go_at_once() -> None:
    async with serving(ClientLimits(clients=100)) as server:

        async def visit(number: int) -> None:
            async with client(server) as connection:
                await say(connection, CHATTER)

        await asyncio.gather(*(visit(i) for i in range(50)))
        await until(lambda: len(server.protocol.connections) == 0)


@in_a_loop
async def test_what_is_no_websocket_at_all_does_no_harm() -> None:
    async with serving() as server, client(server) as a:
        for rubbish in (b"GET / HTTP/1.1\r\n\r\n", b"\x00\xff" * 1000, b""):
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(rubbish)
            writer.write_eof()
            await reader.read()
            writer.close()
            await writer.wait_closed()
        await say(a)
