"""Handlers and streams on the port of the WebSocket, and on a port of their own."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from http import HTTPStatus

import pytest

from teleop.rosbridge.server import http_connection as opening
from teleop.rosbridge.server.handled_request import text_page
from teleop.rosbridge.server.http_handlers import HttpHandlers, HttpRequest, Route, Stream
from teleop.rosbridge.server.http_pages import Page
from teleop.rosbridge.server.http_server import HttpServer
from teleop.rosbridge.server.request_reader import MAX_BODY
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.server.test_http_pages import fetch
from tests.teleop.rosbridge.server.test_server import (
    client,
    in_a_loop,
    receive,
    say,
    serving,
    until,
)

CHUNK = bytes(50_000)


class Counter:
    """A stream without end that counts what is taken, and its ends."""

    def __init__(self, chunk: bytes = CHUNK, *, most: int = 10**9) -> None:
        self.taken = self.ended = 0
        self._chunk, self._most = chunk, most

    async def handle(self, request: HttpRequest) -> Stream:
        return Stream({"Content-Type": "text/plain"}, self._chunks(), self._end)

    async def _chunks(self) -> AsyncIterator[bytes]:
        while self.taken < self._most:
            self.taken += 1
            yield self._chunk

    def _end(self) -> None:
        self.ended += 1


@asynccontextmanager
async def streaming(*, most: int = 10**9) -> AsyncIterator[tuple[Server, Counter]]:
    """Serve a stream of so many pieces at /stream."""
    async with serving() as server:
        counter = Counter(most=most)
        server.handlers.add("/stream", Route(counter.handle))
        yield server, counter


async def echo(request: HttpRequest) -> Page:
    body = f"{request.method} {request.path} {dict(request.query)} {request.address}"
    return text_page(HTTPStatus.OK, body)


async def opened(
    port: int, path: str, method: str = "GET", buffer: int = 65_536
) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Request a path, with a receive buffer of this size."""
    taker = socket.socket()
    taker.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
    taker.setblocking(False)
    await asyncio.get_running_loop().sock_connect(taker, ("127.0.0.1", port))
    reader, writer = await asyncio.open_connection(sock=taker, limit=4096)
    writer.write(f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    return reader, writer


@in_a_loop
async def test_handlers_are_given_path_query_and_client() -> None:
    async with serving() as server:
        server.handlers.add("/echo", Route(echo))
        server.handlers.add("/echo/", Route(echo))
        answer = await fetch(server, "/echo?a=1&b=x%20y&a=2&c")
        assert answer[2] == b"GET /echo {'a': '1', 'b': 'x y', 'c': ''} 127.0.0.1\n"
        assert (await fetch(server, "/echo/deep/er"))[2].startswith(b"GET /echo/deep/er ")
        status, headers, body = await fetch(server, "/echo", "HEAD")
        assert (status, headers["content-length"] != "0", body) == (200, True, b"")
        assert (await fetch(server, "/echoes"))[0] == 404


@in_a_loop
async def test_a_post_is_handed_over_where_a_handler_takes_it_and_refused_elsewhere() -> None:
    async with serving() as server:
        server.handlers.add("/act", Route(echo, methods=("POST",)))
        server.handlers.add("/echo", Route(echo))
        assert (await fetch(server, "/act", "POST"))[2].startswith(b"POST /act")
        status, headers, body = await fetch(server, "/act")
        assert (status, headers["allow"], body) == (
            405,
            "POST",
            b"GET is not possible here: POST\n",
        )
        assert (await fetch(server, "/echo", "POST"))[0] == 405


async def posted(port: int, *pieces: bytes) -> bytes:
    """Return the whole answer to bytes that are sent one piece at a time."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    for piece in pieces:
        writer.write(piece)
        await asyncio.sleep(0.01)
    answer = await reader.read()
    writer.close()
    return answer


def post(size: object, body: bytes = b"", *, more: str = "") -> bytes:
    """Return a POST to /take, with this length in its header."""
    head = f"POST /take HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {size}\r\n{more}\r\n"
    return head.encode() + body


@in_a_loop
async def test_a_route_that_takes_a_body_gets_it_in_whatever_pieces_it_comes() -> None:
    async def taken(request: HttpRequest) -> Page:
        return Page(HTTPStatus.OK, {}, request.body[::-1])

    async with serving() as server:
        server.handlers.add("/take", Route(taken, methods=("POST",), takes_body=True))
        whole = post(5, b"abcde")
        assert (await posted(server.port, whole)).endswith(b"\r\n\r\nedcba")
        for cut in (2, 30, len(whole) - 7, len(whole) - 2):
            assert (await posted(server.port, whole[:cut], whole[cut:])).endswith(b"\r\n\r\nedcba")
        long = bytes(range(256)) * (MAX_BODY // 256)
        assert (await posted(server.port, post(len(long), long))).endswith(long[::-1])


@in_a_loop
async def test_a_body_that_nobody_takes_or_whose_length_is_in_doubt_is_refused() -> None:
    async def taken(request: HttpRequest) -> Page:
        raise AssertionError(request.body)

    async with serving() as server:
        server.handlers.add("/take", Route(taken, methods=("POST",), takes_body=True))
        for request in (
            post(MAX_BODY + 1, bytes(MAX_BODY + 1)),
            post("-1", b"a"),
            post("1, 1", b"a"),
            post(1, b"a", more="Content-Length: 1\r\n"),
            post(1, b"a", more="Transfer-Encoding: chunked\r\n"),
            post(1, b"a").replace(b"POST /take", b"GET /take"),
        ):
            assert (await posted(server.port, request)).startswith(b"HTTP/1.1 400 "), request[:99]
        server.handlers.add("/act", Route(echo, methods=("POST",)))
        refused = await posted(server.port, post(2, b"{}").replace(b"/take", b"/act"))
        assert refused.startswith(b"HTTP/1.1 400 ")
        assert refused.endswith(b"not a valid HTTP/1.1 request without a body\n")


@in_a_loop
async def test_a_failing_handler_is_logged_and_answered(caplog: pytest.LogCaptureFixture) -> None:
    async def fail(request: HttpRequest) -> Page:
        raise RuntimeError("broken")

    async with serving() as server:
        server.handlers.add("/fail", Route(fail))
        assert (await fetch(server, "/fail"))[::2] == (500, b"internal error\n")
    assert [record.getMessage() for record in caplog.records] == ["GET /fail failed"]


@in_a_loop
async def test_a_stream_arrives_whole_and_ends() -> None:
    async with streaming(most=40) as (server, counter):
        status, headers, body = await fetch(server, "/stream")
        assert (status, body == 40 * CHUNK) == (200, True)
        await until(lambda: counter.ended == 1)
        assert "content-length" not in headers


@in_a_loop
async def test_head_of_a_stream_begins_none() -> None:
    async with streaming() as (server, counter):
        assert (await fetch(server, "/stream", "HEAD"))[::2] == (200, b"")
        assert (counter.taken, counter.ended) == (0, 1)


@in_a_loop
async def test_a_client_that_does_not_read_is_sent_no_more_than_buffers_hold() -> None:
    async with serving() as server:
        stalled, other = Counter(), Counter()
        server.handlers.add("/stalled", Route(stalled.handle))
        server.handlers.add("/other", Route(other.handle))
        _, idle = await opened(server.port, "/stalled")
        reader, writer = await opened(server.port, "/other")
        for _ in range(2000):
            await reader.readexactly(4096)
        async with client(server) as connected:
            await say(connected, {"op": "subscribe", "topic": "/chatter"})
            server.protocol.topics.publish("/chatter", {"data": "x"}, server.now)
            assert (await receive(connected))["msg"] == {"data": "x"}
        assert stalled.taken < 10
        assert other.taken > 150
        for one in (idle, writer):
            one.close()
        await until(lambda: (stalled.ended, other.ended) == (1, 1))


@in_a_loop
async def test_a_client_that_takes_nothing_for_long_is_disconnected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(opening, "STREAM_STALL", 0.2)
    async with streaming() as (server, counter):
        _, writer = await opened(server.port, "/stream")
        await until(lambda: counter.ended > 0)
        writer.close()


@in_a_loop
async def test_handlers_and_streams_are_cancelled_when_their_client_leaves() -> None:
    begun, ended = asyncio.Event(), asyncio.Event()

    async def wait() -> None:
        begun.set()
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    async def handle(request: HttpRequest) -> Page:
        await wait()
        raise AssertionError

    async def chunks() -> AsyncIterator[bytes]:
        yield b"first"
        await wait()

    async def stream(request: HttpRequest) -> Stream:
        return Stream({}, chunks())

    async with serving() as server:
        server.handlers.add("/page", Route(handle))
        server.handlers.add("/stream", Route(stream))
        for path in ("/page", "/stream"):
            _, writer = await opened(server.port, path)
            await begun.wait()
            writer.close()
            await ended.wait()
            begun.clear()
            ended.clear()


@in_a_loop
async def test_what_a_client_says_during_a_stream_is_ignored() -> None:
    async with streaming(most=100) as (server, counter):
        reader, writer = await opened(server.port, "/stream")
        await reader.readuntil(b"\r\n\r\n")
        writer.write(b"\xff" * 100_000)
        assert await reader.read() == 100 * CHUNK
        assert counter.taken == 100
        writer.close()


@in_a_loop
async def test_streams_do_not_delay_the_end_of_the_server() -> None:
    async with streaming() as (server, counter):
        _, writer = await opened(server.port, "/stream")
        await until(lambda: counter.taken > 0)
        async with asyncio.timeout(1.5):
            await server.close()
        assert counter.ended == 1
        writer.close()


@in_a_loop
async def test_pages_of_other_origins_get_nothing_where_a_handler_says_so() -> None:
    headers: dict[str, str]
    async with serving() as server:
        server.handlers.add("/own", Route(echo, own_pages_only=True))
        for headers, status in (
            ({}, 200),
            ({"sec_fetch_site": "same-origin"}, 200),
            ({"sec_fetch_site": "none"}, 200),
            ({"sec_fetch_site": "same-site"}, 403),
            ({"sec_fetch_site": "cross-site"}, 403),
            ({"host": "evil.example", "sec_fetch_site": "same-origin"}, 403),
            ({"origin": "http://localhost:1"}, 403),
            ({"host": "localhost:1", "origin": "http://localhost:1"}, 200),
        ):
            answered, fields, _ = await fetch(server, "/own", **headers)
            assert answered == status, headers
            assert "access-control-allow-origin" not in fields


@in_a_loop
async def test_other_handlers_answer_local_pages_of_other_ports() -> None:
    async with serving() as server:
        server.handlers.add("/open", Route(echo))
        status, fields, _ = await fetch(server, "/open", origin="http://localhost:1")
        assert (status, fields["access-control-allow-origin"]) == (200, "http://localhost:1")


@in_a_loop
async def test_a_further_port_serves_handlers_and_no_websocket() -> None:
    async with serving() as server:
        handlers = HttpHandlers()
        handlers.add("/", Route(echo))
        async with HttpServer(server, 0, handlers) as further:
            reader, writer = await opened(further.port, "/")
            assert (await reader.read()).endswith(b"GET / {} 127.0.0.1\n")
            writer.close()
            reader, writer = await asyncio.open_connection("127.0.0.1", further.port)
            writer.write(
                b"GET /x HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\n"
                b"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
            )
            assert (await reader.read()).startswith(b"HTTP/1.1 404 ")
            writer.close()
