"""The client against the server, and against servers of other kinds."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

import numpy as np
import pytest
from websockets.asyncio.server import ServerConnection, serve

from teleop.rosbridge.client.client import Client
from teleop.rosbridge.client.reconnecting_connection import ConnectionState
from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.errors import ClientError, MessageError, ServiceCallError, ServiceError
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.server.test_server import in_a_loop, serving, until
from tests.teleop.rosbridge.support import REGISTRY, ConnectionLog, received_on


def listening(url: str, **options: Any) -> Client:
    return Client(url, registry=REGISTRY, **options)


@pytest.mark.parametrize("compression", ["none", "cbor"])
@in_a_loop
async def test_messages_arrive_in_order_and_typed_in_both_encodings(compression: Any) -> None:
    async with serving() as server, listening(server.url) as client:
        topics = server.protocol.topics
        scans, images = list[Message](), list[Message]()
        topics.advertise("/scan", "sensor_msgs/LaserScan")
        for topic, kind, received in (
            ("/scan", "sensor_msgs/LaserScan", scans),
            ("/cloud", "sensor_msgs/CompressedImage", images),
        ):
            last = await client.subscribe(topic, kind, received.append, compression=compression)
        await client.call("/rosapi/get_time")
        topics.publish("/cloud", {"data": b"\x00\xff"}, server.now)
        for i in range(10):
            scan = {"ranges": np.arange(3) + i, "header": {"stamp": {"sec": i}}}
            topics.publish("/scan", scan, server.now)
        await until(lambda: len(scans) == 10)
        stamps = [scan["header"]["stamp"] for scan in scans]
        assert stamps == [{"sec": i, "nanosec": 0} for i in range(10)]
        assert scans[-1]["ranges"].dtype == np.float32
        assert scans[-1]["ranges"].tolist() == [9.0, 10.0, 11.0]
        assert [image["data"] for image in images] == [b"\x00\xff"]
        await client.unsubscribe(last)
        await until(lambda: not topics.wanted("/cloud"))


@in_a_loop
async def test_published_messages_reach_the_host() -> None:
    async with serving() as server, listening(server.url) as client:
        received = received_on(server.protocol, "/joy", "sensor_msgs/Joy")
        await client.advertise("/joy", "sensor_msgs/Joy")
        assert await client.publish("/joy", {"axes": np.array([0.5, -1.0]), "buttons": [1]})
        await until(lambda: bool(received))
        assert received[0]["axes"].tolist() == [0.5, -1.0]
        with pytest.raises(MessageError):
            await client.publish("/joy", {"axis": []})
        with pytest.raises(ClientError, match="advertised before"):
            await client.publish("/other", {})
        await client.unadvertise("/joy")


@in_a_loop
async def test_call_returns_after_callbacks_of_earlier_messages() -> None:
    async with serving() as server:

        def step(client: int, request: Message, now: int) -> Message:
            server.protocol.connections.set_lossless(client)
            for i in range(request["ticks"]):
                server.protocol.topics.publish("/chatter", {"data": str(i)}, server.now)
            return {"success": True, "stamp": {"sec": 1}}

        server.protocol.services.serve("/sim/step", "farsteer_msgs/Step", step)
        async with listening(server.url) as client:
            received: list[Message] = []
            await client.subscribe("/chatter", "std_msgs/String", received.append)
            for calls in range(1, 20):
                answer = await client.call("/sim/step", {"ticks": 7})
                assert answer["success"] is True
                assert len(received) == 7 * calls


@in_a_loop
async def test_failed_calls_raise_the_reason_and_unanswered_ones_time_out() -> None:
    async with serving() as server, listening(server.url) as client:

        async def never(client: int, request: Message, now: int) -> Message:
            await asyncio.sleep(100)
            return {}

        server.protocol.services.serve(
            "/never", "std_srvs/Trigger", server.async_handlers.wrap(never)
        )
        with pytest.raises(ServiceCallError, match="/nope: Service /nope does not exist"):
            await client.call("/nope")
        with pytest.raises(ServiceCallError, match=r"/never: no response within 0\.05 s"):
            await client.call("/never", timeout=0.05)


@in_a_loop
async def test_server_statuses_reach_the_callback() -> None:
    async with serving() as server, listening(server.url) as client:
        received: list[tuple[str, str]] = []
        client.on_status(lambda level, text: received.append((level, text)))
        await client.advertise("/chatter", "std_msgs/String")
        await until(lambda: bool(received))
        assert received == [("error", "advertise: topic /chatter is published by the server only")]


@in_a_loop
async def test_failing_callback_is_logged_and_others_run(caplog: pytest.LogCaptureFixture) -> None:
    async with serving() as server, listening(server.url) as client:
        received: list[Message] = []

        def fall(message: Message) -> None:
            raise ZeroDivisionError

        await client.subscribe("/chatter", "std_msgs/String", fall)
        await client.subscribe("/chatter", "std_msgs/String", received.append)
        await until(lambda: server.protocol.topics.wanted("/chatter"))
        server.protocol.topics.publish("/chatter", {"data": "x"}, server.now)
        await until(lambda: bool(received))
        assert "ZeroDivisionError" in caplog.text


@in_a_loop
async def test_failing_callback_of_statuses_or_the_connection_does_not_make_a_client_deaf(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fall(*_: object) -> None:
        raise ZeroDivisionError

    async with serving() as server:
        client = listening(server.url)
        client.on_status(fall)
        client.on_connection(fall)
        async with client:
            await client.advertise(
                "/chatter", "std_msgs/String"
            )  # of the server: it answers with a status
            with pytest.raises(ServiceCallError, match="/nope does not exist"):
                await client.call("/nope")
        for subject in ("statuses", "the connection"):
            assert f"a callback of {subject} failed" in caplog.text


@in_a_loop
async def test_reconnecting_restores_subscriptions_and_advertisements() -> None:
    states: list[ConnectionState] = []
    received: list[Message] = []
    async with serving() as server:
        port = server.port
        client = listening(server.url)
        client.on_connection(states.append)
        await client.connect()
        await client.subscribe("/chatter", "std_msgs/String", received.append)
        await client.advertise("/joy", "sensor_msgs/Joy")
        calling = asyncio.create_task(client.call("/never"))
        await asyncio.sleep(0)
    with pytest.raises(ServiceCallError):
        await calling
    await until(lambda: not client.connected)
    assert "the server is shutting down" in client.closed_reason
    assert not await client.publish("/joy", {})
    with pytest.raises(ServiceCallError, match="not connected"):
        await client.call("/rosapi/topics")
    again = Server(Protocol(REGISTRY), port=port)
    again.protocol.topics.advertise("/chatter", "std_msgs/String")
    async with again:
        await until(lambda: again.protocol.topics.wanted("/chatter"))
        assert "/joy" in [topic.name for topic in again.protocol.topics.all]
        again.protocol.topics.publish("/chatter", {"data": "again"}, again.now)
        await until(lambda: bool(received))
        await client.close()
    assert received == [{"data": "again"}]
    assert [state.value for state in states] == [
        "connected",
        "disconnected",
        "connected",
        "closed",
    ]


@pytest.mark.slow
@in_a_loop
async def test_client_without_reconnect_stays_disconnected() -> None:
    async with serving() as server:
        port = server.port
        client = listening(server.url, reconnect=False)
        await client.connect()
        other = listening(server.url)
        await other.connect()
    await until(lambda: not client.connected)
    server = Server(Protocol(REGISTRY), port=port)
    log = ConnectionLog(server.protocol)
    async with server:
        await until(lambda: other.connected)
        await asyncio.sleep(1.0)  # several times the pause before the first attempt
        assert not client.connected
        assert len(log.connections) == 1
        await other.close()
    await client.close()


@pytest.mark.slow
@in_a_loop
async def test_unresponsive_server_is_detected_by_pings() -> None:
    async with serving(lockstep=True) as server:
        client = listening(server.url, keepalive=0.05, timeout=1.0, reconnect=False)
        await client.connect()
        for link in server._writers.values():
            link.socket.transport.pause_reading()
        await until(lambda: not client.connected)
        assert "keepalive ping timeout" in client.closed_reason
        for link in server._writers.values():
            link.socket.transport.resume_reading()
        await client.close()


@pytest.mark.parametrize(
    ("url", "text"),
    [
        ("nonsense", "'nonsense' is not a valid URL such as ws://127.0.0.1:9090"),
        ("http://127.0.0.1:9090", "is not a valid URL"),
        ("ws://127.0.0.1:1", "no server listens at ws://127.0.0.1:1: Connection refused"),
    ],
)
@in_a_loop
async def test_wrong_address_is_a_one_line_error(url: str, text: str) -> None:
    with pytest.raises(ClientError) as caught:
        await listening(url).connect()
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("token", ["secret-of-the-lab\n", "geheim-ist-schön"])
def test_token_that_no_header_holds_is_refused_without_being_repeated(token: str) -> None:
    with pytest.raises(ClientError, match=r"^token must be one line of ASCII$"):
        Client("ws://127.0.0.1:9090", token=token)


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (b"200 OK\r\nContent-Length: 0", "is not a rosbridge server: it answers HTTP 200"),
        (b"502 Bad Gateway\r\nContent-Length: 0", "refuses the connection: HTTP 502"),
        (
            b"503 Full\r\nContent-Type: text/plain\r\nContent-Length: 9\r\n\r\ntoo many\n",
            "refuses the connection: too many",
        ),
    ],
)
@in_a_loop
async def test_other_kind_of_server_is_a_one_line_error(answer: bytes, text: str) -> None:
    async def page(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readline()
        writer.write(b"HTTP/1.1 " + answer + b"\r\n\r\n")
        writer.close()

    server = await asyncio.start_server(page, "127.0.0.1", 0)
    async with server:
        url = f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        with pytest.raises(ClientError, match=text):
            await listening(url).connect()


@pytest.mark.parametrize("echo", [True, False])
@in_a_loop
async def test_websocket_server_without_rosbridge_is_a_one_line_error(
    echo: bool,
) -> None:
    async def attend(connection: ServerConnection) -> None:
        async for frame in connection:
            if echo:
                await connection.send(frame)

    logger = logging.getLogger("test")
    async with serve(attend, "127.0.0.1", 0, logger=logger) as server:
        url = f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        client = listening(url, timeout=0.3)
        client.on_status(lambda level, text: None)
        with pytest.raises(ClientError, match="does not speak rosbridge"):
            await client.connect()


@in_a_loop
async def test_client_can_wait_for_a_server_that_starts_later() -> None:
    protocol = Protocol(REGISTRY)
    serve_rosapi(protocol)
    server = Server(protocol, port=0)
    await server.start()
    port = server.port
    await server.close()
    client = listening(f"ws://127.0.0.1:{port}")
    connecting = asyncio.create_task(client.connect(patience=10))
    await asyncio.sleep(0.15)
    later = Server(protocol, port=port)
    async with later:
        await connecting
        assert (await client.call("/rosapi/topics"))["topics"] == []
        with pytest.raises(ClientError, match="already connected"):
            await client.connect()
        await client.close()


@in_a_loop
async def test_provided_services_survive_reconnecting(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def add(request: Message) -> Message:
        if request["a"] == 0:
            raise ServiceError("nothing to add to")
        if request["a"] < 0:
            raise KeyError
        return {"sum": request["a"] + request["b"]}

    async with serving() as server, Client(server.url) as provider, Client(server.url) as caller:

        def there() -> bool:
            return "/add" in {service.name for service in server.protocol.services.all}

        await provider.provide("/add", "example_interfaces/AddTwoInts", add)
        await until(there)
        assert await caller.call("/add", {"a": 2, "b": 3}) == {"sum": 5}
        with pytest.raises(ServiceCallError, match="nothing to add to"):
            await caller.call("/add", {"a": 0})
        with pytest.raises(ServiceCallError, match="internal error"):
            await caller.call("/add", {"a": -1})
        assert "KeyError" in caplog.text
        assert provider._connection._socket is not None
        provider._connection._socket.transport.abort()
        await until(lambda: not there())
        await until(there)
        assert await caller.call("/add", {"a": 2}) == {"sum": 2}
        await provider.withdraw("/add")
        await until(lambda: not there())
        with pytest.raises(ServiceCallError, match="does not exist"):
            await caller.call("/add")
