"""HTTP pages on the port of the WebSocket."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import http.client
import json
import socket
import struct

import pytest

from teleop.rosbridge.server import http_connection as opening
from teleop.rosbridge.server.http_pages import HttpPages
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.server.test_server import client, in_a_loop, serving, until

MAP = bytes(range(256)) * 8192
"""Two megabytes, more than a socket buffers."""


async def fetch(
    server: Server, path: str, method: str = "GET", **headers: str
) -> tuple[int, dict[str, str], bytes]:
    def ask() -> tuple[int, dict[str, str], bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
        names = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, path, headers=names)
        response = connection.getresponse()
        body = response.read()
        connection.close()
        return response.status, {k.lower(): v for k, v in response.getheaders()}, body

    return await asyncio.to_thread(ask)


@in_a_loop
async def test_version_and_health_are_json() -> None:
    async with serving() as server, client(server):
        status, headers, body = await fetch(server, "/version")
        assert (status, headers["content-type"]) == (200, "application/json")
        version = json.loads(body)
        assert version["protocol"] == {"major": 2, "minor": 1, "patch": 0}
        assert version["server"]
        status, _, body = await fetch(server, "/healthz")
        assert (status, json.loads(body)) == (200, {"status": "ok", "clients": 1})


@in_a_loop
async def test_files_are_validated_by_their_etag() -> None:
    async with serving() as server:
        digest = server.pages.add_file("/map.ply", MAP)
        assert digest == hashlib.sha256(MAP).hexdigest()
        status, headers, body = await fetch(server, "/map.ply?token=x")
        assert (status, body == MAP) == (200, True)
        assert headers["etag"] == f'"{digest}"'
        for known in (f'"{digest}"', f'"other", W/"{digest}"', "*"):
            status, headers, body = await fetch(server, "/map.ply", if_none_match=known)
            assert (status, headers["etag"], body) == (304, f'"{digest}"', b"")
        status, _, body = await fetch(server, "/map.ply", if_none_match='"other"')
        assert (status, body == MAP) == (200, True)


@pytest.mark.parametrize(
    ("path", "method", "status"),
    [("/nope", "GET", 404), ("/", "GET", 426), ("/map.ply", "DELETE", 405), ("/../x", "GET", 404)],
)
@in_a_loop
async def test_unknown_pages_and_methods_are_rejected(path: str, method: str, status: int) -> None:
    async with serving() as server:
        server.pages.add_file("/map.ply", MAP)
        assert (await fetch(server, path, method))[0] == status


@in_a_loop
async def test_local_origins_may_read_pages_and_foreign_may_not() -> None:
    async with serving() as server:
        server.pages.add_file("/map.ply", MAP)
        origin = "http://localhost:8000"
        status, headers, _ = await fetch(server, "/map.ply", origin=origin)
        assert (status, headers["access-control-allow-origin"]) == (200, origin)
        assert headers["access-control-expose-headers"] == "ETag"
        status, headers, _ = await fetch(server, "/map.ply", origin="http://evil.example")
        assert (status, "access-control-allow-origin" in headers) == (403, False)


@in_a_loop
async def test_slow_downloads_complete_without_blocking_others() -> None:
    async with serving() as server:
        server.pages.add_file("/map.ply", MAP)
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port, limit=4096)
        writer.write(b"GET /map.ply HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        await asyncio.sleep(0.1)
        assert (await fetch(server, "/healthz"))[0] == 200
        answer = await reader.read()
        assert answer.partition(b"\r\n\r\n")[2] == MAP
        writer.close()


@in_a_loop
async def test_client_that_leaves_during_a_download_is_not_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with serving() as server:
        server.pages.add_file("/map.ply", MAP)
        for _ in range(10):
            taker = socket.create_connection(("127.0.0.1", server.port))
            taker.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            taker.sendall(b"GET /map.ply HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            taker.close()  # with a reset, as nothing of the answer is read
            await asyncio.sleep(0.05)
        assert (await fetch(server, "/map.ply"))[2] == MAP
    assert [record.getMessage() for record in caplog.records] == []


@pytest.mark.slow
@in_a_loop
async def test_connections_without_request_are_aborted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opening, "HEADER_TIMEOUT", 0.1)
    async with serving() as server:
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
        writer.write(b"GET / HTTP/1.1\r\nHost: ")
        with pytest.raises((ConnectionError, asyncio.IncompleteReadError)):
            assert await reader.readexactly(1)
        writer.close()
        monkeypatch.setattr(opening, "HEADER_TIMEOUT", 0.8)
        async with client(server) as other:  # a client that was in time stays
            await asyncio.sleep(0.9)
            await other.ping()


@in_a_loop
async def test_simultaneous_downloads_are_limited() -> None:
    async with serving() as server:
        server.pages.add_file("/map.ply", MAP * 8)
        idle = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(4)]
        for taker in idle:
            taker.sendall(b"GET /map.ply HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        await until(lambda: len(server._handshake._downloads) == 4)
        assert (await fetch(server, "/map.ply"))[0] == 503
        for taker in idle:
            taker.close()
        await until(lambda: len(server._handshake._downloads) == 0)
        assert (await fetch(server, "/map.ply"))[0] == 200


TEXT = b"text of a page " * 10_000
"""More than a socket takes at once, and easily compressed."""


@in_a_loop
async def test_clients_that_accept_gzip_are_sent_it_under_a_tag_of_its_own() -> None:
    async with serving() as server:
        digest = server.pages.add_file("/page.txt", TEXT, "text/plain", compress=True)
        for accepted in ("gzip, br", "br;q=1, GZIP ;q=0.5", "x-gzip"):
            status, headers, body = await fetch(server, "/page.txt", accept_encoding=accepted)
            assert (status, gzip.decompress(body)) == (200, TEXT)
            assert headers["content-encoding"] == "gzip"
            assert headers["etag"] == f'"{digest}-gzip"'
            assert headers["vary"] == "Accept-Encoding, Origin"
        for accepted in ("identity", "br", "gzip;q=0", "gzip; q=0.000"):
            status, headers, body = await fetch(server, "/page.txt", accept_encoding=accepted)
            assert (status, body, headers["etag"]) == (200, TEXT, f'"{digest}"')
            assert "content-encoding" not in headers
            assert headers["vary"] == "Accept-Encoding, Origin"
        for tag, status in ((f'"{digest}-gzip"', 304), (f'"{digest}"', 200)):
            answer = await fetch(server, "/page.txt", accept_encoding="gzip", if_none_match=tag)
            assert answer[0] == status


@in_a_loop
async def test_files_that_do_not_shrink_are_sent_as_they_are() -> None:
    async with serving() as server:
        server.pages.add_file("/one", b"x", compress=True)
        _, headers, body = await fetch(server, "/one", accept_encoding="gzip")
        assert (body, "content-encoding" in headers) == (b"x", False)


@in_a_loop
async def test_files_under_their_hash_may_be_kept_for_ever() -> None:
    async with serving() as server:
        server.pages.add_file("/map/1.ply", MAP, immutable=True)
        server.pages.add_file("/open/1.ply", MAP, immutable=True, public=True)
        server.pages.add_file("/map.ply", MAP)
        for path, caching in (
            ("/map/1.ply", "private, max-age=31536000, immutable"),
            ("/open/1.ply", "public, max-age=31536000, immutable"),
            ("/map.ply", "no-cache"),
        ):
            status, headers, body = await fetch(server, path, "HEAD")
            assert (status, int(headers["content-length"]), body) == (200, len(MAP), b"")
            assert headers["cache-control"] == caching


@pytest.mark.parametrize(
    ("host", "seen"),
    [
        ("127.0.0.1:9090", "127.0.0.1:9090"),
        ("[::1]:9090", "[::1]:9090"),
        ("localhost", "localhost"),
        ("localhost; script-src *", ""),
        ("[::1", ""),
        ("[nothing]", ""),
    ],
)
def test_headers_of_a_file_may_name_the_host_but_nothing_else(host: str, seen: str) -> None:
    pages = HttpPages(lambda: 0)
    pages.add_file("/", b"page", headers=lambda name: {"X-Host": name})
    page = pages.respond("GET", "/", {"Host": host})
    assert page is not None
    assert page.headers["X-Host"] == seen


@in_a_loop
async def test_a_page_at_the_root_leaves_the_websocket_there_as_it_is() -> None:
    async with serving() as server:
        server.pages.add_file("/", b"<!doctype html>", "text/html")
        assert (await fetch(server, "/"))[::2] == (200, b"<!doctype html>")
        assert (await fetch(server, "/?token=x"))[0] == 200
        async with client(server) as connected:
            await connected.ping()


@in_a_loop
async def test_local_pages_may_send_a_token_in_a_header_and_foreign_may_not() -> None:
    async with serving() as server:
        server.pages.add_file("/map.ply", MAP)
        asked = {
            "access_control_request_method": "GET",
            "access_control_request_headers": "authorization",
        }
        origin = "http://127.0.0.1:9080"
        status, headers, body = await fetch(server, "/map.ply", "OPTIONS", origin=origin, **asked)
        assert (status, body) == (204, b"")
        assert headers["access-control-allow-origin"] == origin
        assert headers["access-control-allow-headers"] == "Authorization"
        status, headers, _ = await fetch(
            server, "/map.ply", "OPTIONS", origin="http://evil.example", **asked
        )
        assert (status, "access-control-allow-origin" in headers) == (403, False)
        assert (await fetch(server, "/map.ply", "OPTIONS"))[0] == 405
