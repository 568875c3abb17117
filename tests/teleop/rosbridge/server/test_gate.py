"""Limits below and before the messages: frames, requests, places, tokens, downloads, open files."""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import os
import struct
from collections.abc import Sequence
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import PING, TEXT

from teleop.rosbridge import (
    DEFAULT_RULES,
    Access,
    Authenticator,
    ClientLimits,
    Credentials,
    Protocol,
    Role,
    Server,
)
from teleop.rosbridge.auth.credentials import Credential, token_digest
from teleop.rosbridge.protocol.token_guesses import TokenGuesses
from teleop.rosbridge.server.accept_errors import AcceptErrors
from teleop.rosbridge.server.gate import FrameBudget, Gate
from teleop.rosbridge.server.websocket_connection import WebSocketConnection
from tests.teleop.rosbridge.server.test_http_pages import fetch
from tests.teleop.rosbridge.server.test_server import client, ended, in_a_loop, say, serving, until
from tests.teleop.rosbridge.support import REGISTRY, SECOND

STEP = SECOND // 1000


# Frames, on a clock that moves


@pytest.mark.parametrize(("rate", "ends"), [(45, False), (60, True), (1000, True)])
def test_pings_and_pongs_are_limited_to_their_rate(rate: int, ends: bool) -> None:
    budget = FrameBudget(ClientLimits(), 0)
    reasons = [budget.excess(PING, n * SECOND // rate) for n in range(rate * 20)]
    assert any(reasons) is ends
    assert not any(reasons[:100])


def test_frames_of_messages_are_limited_apart_from_pings() -> None:
    budget = FrameBudget(ClientLimits(), 0)
    assert not any(budget.excess(TEXT, n * STEP // 2) for n in range(20_000))  # 2000 a second
    reasons = [budget.excess(TEXT, 10 * SECOND) for _ in range(10_000)]
    assert "3000 WebSocket frames/s" in str(next(filter(None, reasons)))
    assert budget.excess(PING, 11 * SECOND) is None


def test_reconnecting_does_not_refill_the_frames() -> None:
    gate = Gate(ClientLimits())
    passed = 0
    for number in range(20):
        budget = gate.begin("10.0.0.6", number * SECOND // 20)
        while budget.excess(PING, number * SECOND // 20) is None:
            passed += 1
        gate.end("10.0.0.6", budget, number * SECOND // 20)
    assert passed <= 100 + 50 + 20 * 10
    fresh = gate.begin("10.0.0.7", SECOND)
    assert [fresh.excess(PING, SECOND) for _ in range(100)] == [None] * 100


@pytest.mark.slow
@in_a_loop
async def test_floods_of_empty_frames_end_with_1008(monkeypatch: pytest.MonkeyPatch) -> None:
    parsed = 0
    count_frame = WebSocketConnection._recv_frame

    def counted(socket: WebSocketConnection, frame: Any) -> None:
        nonlocal parsed
        parsed += 1
        count_frame(socket, frame)

    monkeypatch.setattr(WebSocketConnection, "_recv_frame", counted)
    async with serving(ClientLimits()) as server, client(server) as other:
        for opcode, payload in ((9, b""), (10, b""), (9, bytes(125)), (1, b"")):
            parsed = 0
            async with client(server) as flooder:
                frame = struct.pack("!BB", 0x80 | opcode, 0x80 | len(payload)) + bytes(4) + payload
                flooder.transport.write(frame * (1000 if payload else 40_000))
                await ended(flooder)
            # Pings that are not read may cost the client the close frame.
            assert flooder.close_code in (1008, 1006)
            assert 0 < parsed <= 12_000
            await say(other)


@in_a_loop
async def test_large_messages_that_wait_pause_reading() -> None:
    async with serving() as server, client(server) as a:
        await until(lambda: len(server._writers) == 1)
        held = asyncio.Event()
        socket = server._writers[1].socket
        take = socket.receive

        async def receive() -> Any:
            await held.wait()
            return await take()

        socket.receive = receive  # type: ignore[method-assign]
        await a.send('{"op":"status"}')  # the reader already waits for this one
        sending = asyncio.create_task(flood(a, 20))
        await until(lambda: socket.recv_messages.waiting > 600_000)
        for _ in range(20):
            await asyncio.sleep(0.01)
            assert socket.recv_messages.waiting <= 2_000_000
        held.set()
        await sending
        await until(lambda: server.backlog(1) == 0)


async def flood(connection: ClientConnection, count: int) -> None:
    for _ in range(count):
        await connection.send(json.dumps({"op": "fragment", "data": "x" * 600_000}))


# Requests


def test_requests_of_an_address_are_limited() -> None:
    gate = Gate(ClientLimits())
    admitted = sum(gate.admit_request("10.0.0.6", n * STEP) for n in range(10_000))
    assert admitted <= 10 * 20 + 80
    assert gate.admit_request("10.0.0.7", 10 * SECOND)
    for number in range(2000):
        gate.admit_request(str(number), 0)
    assert len(gate._requests) == 1024


@in_a_loop
async def test_download_that_stands_still_leaves_for_another_and_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("teleop.rosbridge.server.downloads._STANDSTILL", 0.2)
    monkeypatch.setattr("teleop.rosbridge.server.listener.CLOSE_TIMEOUT", 0.1)
    async with asyncio.timeout(5), serving() as server:
        server.pages.add_file("/map.ply", bytes(20_000_000))
        takers = [await downloading(server) for _ in range(4)]
        await until(lambda: len(server._handshake._downloads) == 4)
        await asyncio.sleep(0.3)
        assert (await fetch(server, "/map.ply"))[0] == 200
    for taker in takers:
        taker.transport.abort()


async def downloading(server: Server) -> asyncio.StreamWriter:
    """Ask for a file, and take no more of it than a small buffer."""
    _, writer = await asyncio.open_connection("127.0.0.1", server.port, limit=4096)
    writer.write(b"GET /map.ply HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    return writer


@in_a_loop
async def test_download_without_a_taker_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("teleop.rosbridge.server.http_connection.DOWNLOAD_STALL", 0.2)
    async with serving() as server:
        server.pages.add_file("/map.ply", bytes(20_000_000))
        writer = await downloading(server)
        await until(lambda: len(server._handshake._downloads) == 1)
        await until(lambda: not server._handshake._downloads)
        writer.transport.abort()


# Places


def credential(name: str, role: Role) -> Credential:
    return Credential(
        Access(name, role, DEFAULT_RULES[role]), digest=token_digest(f"{name}'s token")
    )


def guarded(credentials: Credentials, **limits: Any) -> Server:
    gate = Authenticator(credentials, lambda: 0.0)
    protocol = Protocol(REGISTRY, limits=ClientLimits(**limits), authenticator=gate)
    return Server(protocol, port=0)


VIEWER = Access("", Role.VIEW, DEFAULT_RULES[Role.VIEW])
OPERATOR = credential("driver", Role.OPERATE).granted


def crowd(accesses: Sequence[Access | None], clients: int = 16) -> Protocol:
    gate = Authenticator(Credentials(anonymous=None), lambda: 0.0)
    protocol = Protocol(REGISTRY, limits=ClientLimits(clients=clients), authenticator=gate)
    for number, access in enumerate(accesses):
        protocol.connect(SECOND, f"10.0.0.{number}:1", access)
    return protocol


def test_operator_takes_the_place_of_the_newest_viewer_without_a_token() -> None:
    known = credential("wall", Role.VIEW).granted
    protocol = crowd([OPERATOR] * 3 + [VIEWER] * 2 + [known] * 11)
    assert protocol.places.refusal(OPERATOR, "") is None
    assert [one.id for one in protocol.connections if one.closing] == [5]


def test_operators_do_not_displace_each_other() -> None:
    protocol = crowd([OPERATOR] * 16)
    assert protocol.places.refusal(OPERATOR, "") == "too many clients"
    assert not any(one.closing for one in protocol.connections)


def test_clients_that_are_to_authenticate_are_counted_apart() -> None:
    protocol = crowd([OPERATOR] * 16 + [None] * 7)
    assert protocol.places.refusal(None, "") is None
    protocol.connect(SECOND, "", None)
    assert protocol.places.refusal(None, "") == "too many without a token"


@in_a_loop
async def test_operator_gets_in_beside_as_many_viewers_as_there_may_be() -> None:
    credentials = Credentials(keys=(credential("driver", Role.OPERATE),), anonymous=VIEWER)
    async with guarded(credentials, clients=8, requests=1000) as server:
        viewers = [await connect(server.url) for _ in range(7)]
        with pytest.raises(InvalidStatus, match="503"):
            await connect(server.url)
        headers = {"Authorization": "Bearer driver's token"}
        operators = [await connect(server.url, additional_headers=headers) for _ in range(2)]
        await say(operators[1])
        with pytest.raises(ConnectionClosed):
            await viewers[6].recv()
        assert viewers[6].close_code == 1013
        assert "operator" in str(viewers[6].close_reason)
        # One that authenticates by an operation takes a place as well.
        late = await connect(server.url) if len(server.protocol.connections) < 8 else None
        assert late is None
        for each in (*viewers, *operators):
            await each.close()


# Tokens


def test_guessing_of_an_address_is_limited_but_not_the_tokens_it_has_used() -> None:
    guesses = TokenGuesses()
    guesses.accepted("10.0.0.6", "right", 0)
    looked_at = 0
    for number in range(6000):  # 100 a second for a minute
        now = number * 10 * STEP
        if not guesses.locked("10.0.0.6", f"wrong{number}", now):
            looked_at += 1
            guesses.wrong("10.0.0.6", f"wrong{number}", now)
        assert not guesses.locked("10.0.0.6", "right", now)
    assert looked_at <= 10 + 6
    assert guesses.locked("10.0.0.6", "another right one", now)
    assert not guesses.locked("10.0.0.6", "another right one", 75 * SECOND)
    assert not guesses.locked("10.0.0.7", "right", 60 * SECOND)
    for number in range(2000):
        guesses.wrong(str(number), "wrong", 0)
    assert len(guesses._addresses) == 1024


def test_a_program_that_repeats_one_wrong_token_does_not_lock_out_its_address() -> None:
    guesses = TokenGuesses()
    guesses.accepted("10.0.0.6", "revoked", 0)
    for number in range(200):
        for token in ("of yesterday", "revoked"):
            assert not guesses.locked("10.0.0.6", token, number * 5 * SECOND)
            guesses.wrong("10.0.0.6", token, number * 5 * SECOND)
    now = 1000 * SECOND
    assert not guesses.locked("10.0.0.6", "a new one", now)
    for _ in range(10):  # codes of rosauth, of which each is another
        guesses.wrong("10.0.0.6", "", now)
    assert guesses.locked("10.0.0.6", "", now)


@in_a_loop
async def test_wrong_tokens_are_soon_not_looked_at() -> None:
    credentials = Credentials(keys=(credential("driver", Role.OPERATE),))
    async with guarded(credentials, requests=1000) as server:
        good = {"Authorization": "Bearer driver's token"}
        async with connect(server.url, additional_headers=good):
            pass
        statuses = []
        for number in range(14):
            with pytest.raises(InvalidStatus) as caught:
                await connect(server.url, additional_headers={"Authorization": f"Bearer {number}"})
            statuses.append(caught.value.response.status_code)
        assert statuses == [401] * 10 + [429] * 4
        async with connect(server.url) as a:
            await a.send('{"op":"auth","token":"another"}')
            with pytest.raises(ConnectionClosed):
                await a.recv()
            assert "too many wrong tokens" in str(a.close_reason)
        async with connect(server.url, additional_headers=good) as again:
            await say(again)


@in_a_loop
async def test_floods_of_requests_do_not_keep_out_who_has_been_let_in_before() -> None:
    credentials = Credentials(keys=(credential("driver", Role.OPERATE),), anonymous=VIEWER)
    async with guarded(credentials, requests=1) as server:
        good = {"Authorization": "Bearer driver's token"}
        async with connect(server.url, additional_headers=good):
            pass
        assert [(await fetch(server, "/version"))[0] for _ in range(6)][-1] == 429
        async with connect(server.url, additional_headers=good) as again:
            await say(again)


# Files


@in_a_loop
async def test_errors_of_accepting_are_one_line_a_minute(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop = asyncio.get_running_loop()
    others: list[dict[str, Any]] = []
    loop.set_exception_handler(lambda loop, context: others.append(context))
    errors = AcceptErrors(loop)
    times = [100.0, 101.0, 150.0, 161.0]
    error = OSError(errno.EMFILE, os.strerror(errno.EMFILE))
    context = {"message": "socket.accept() out of system resource", "exception": error}
    with caplog.at_level(logging.WARNING):
        for now in times:
            with monkeypatch.context() as patch:
                patch.setattr(loop, "time", lambda now=now: now)
                loop.call_exception_handler(context)
    assert [record.getMessage() for record in caplog.records] == [
        "cannot accept connections: Too many open files (1 times)",
        "cannot accept connections: Too many open files (3 times)",
    ]
    other = {"message": "something else"}
    loop.call_exception_handler(other)
    errors.remove()
    loop.call_exception_handler(context)
    assert others == [other, context]
