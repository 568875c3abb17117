"""Crowds of hostile connections, from one address and from many: what others of them notice, and what they leave."""

from __future__ import annotations

import asyncio
import logging
import ssl
from pathlib import Path

import pytest

from teleop.rosbridge import (
    ClientLimits,
    Keepalive,
    Protocol,
    Server,
    tls_context,
)
from teleop.rosbridge.server import http_connection, listener, websocket_connection
from teleop.rosbridge.server.rare_warnings import RareWarnings
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.rosbridge.server.test_gate import crowd
from tests.teleop.rosbridge.server.test_hostile_clients import masked, opened
from tests.teleop.rosbridge.server.test_server import client, in_a_loop, serving, until
from tests.teleop.rosbridge.support import SECOND, received_on

Wire = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def dialled(server: Server, address: str) -> Wire:
    """Connect from an address of this machine, and say nothing."""
    return await asyncio.open_connection("127.0.0.1", server.port, local_addr=(address, 0))


def leave(wires: list[Wire]) -> None:
    for _, writer in wires:
        writer.transport.abort()


# Places of clients that are still to give a token


def closing(protocol: Protocol) -> list[str]:
    return [one.address for one in protocol.connections if one.closing]


def test_an_address_has_two_places_before_its_token_and_a_third_takes_that_of_its_oldest() -> None:
    protocol = crowd([], clients=32)
    for port in range(3):
        assert protocol.places.refusal(None, "10.0.0.6") is None
        protocol.connect(SECOND, f"10.0.0.6:{port}", None)
    assert closing(protocol) == ["10.0.0.6:0"]


def test_with_all_places_taken_the_oldest_of_the_address_with_most_leaves() -> None:
    protocol = crowd([], clients=32)
    for address in ("10.0.0.1:1", *(f"10.0.0.{n}:{port}" for n in (2, 3, 4) for port in (1, 2))):
        protocol.connect(SECOND, address, None)
    protocol.connect(SECOND, "10.0.0.5:1", None)
    assert protocol.places.refusal(None, "10.0.0.6") is None
    assert closing(protocol) == ["10.0.0.2:1"]
    protocol.connect(SECOND, "10.0.0.6:1", None)
    assert protocol.places.refusal(None, "10.0.0.5") is None
    assert closing(protocol) == ["10.0.0.2:1", "10.0.0.3:1"]


# What clients leave behind


CALL = '{"op":"publish","topic":"/t","msg":{"data":"x"}}'


@pytest.mark.parametrize("goodbye", [b"", masked(b"\x03\xe8", 0x88)], ids=["gone", "closed"])
@in_a_loop
async def test_of_what_a_client_has_sent_that_leaves_little_is_carried_out(goodbye: bytes) -> None:
    async with serving() as server:
        received = received_on(server.protocol, "/t", "std_msgs/String")
        for _ in range(4):
            _, writer = await opened(server)
            writer.write(masked(CALL.encode()) * 390 + goodbye)
            writer.close()
        await until(lambda: bool(received) and not server.protocol.connections)
        assert len(received) <= 4 * 24


@in_a_loop
async def test_the_last_messages_of_a_program_that_ends_are_carried_out() -> None:
    async with serving() as server:
        received = received_on(server.protocol, "/t", "std_msgs/String")
        async with client(server) as polite:
            for _ in range(10):
                await polite.send(CALL)
        await until(lambda: len(received) == 10)
        _, writer = await opened(server)
        writer.write(masked(CALL.encode()) * 10)
        writer.close()
        await until(lambda: len(received) == 20)


@in_a_loop
async def test_a_client_that_is_cut_off_has_no_place_and_is_soon_disconnected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    never = Keepalive(ping_interval=None, ping_timeout=None)
    async with serving(ClientLimits(), keepalive=never) as server:
        for timeout in (1000.0, 0.1):
            monkeypatch.setattr(websocket_connection, "_CUT_TIMEOUT", timeout)
            _, writer = await opened(server)  # which reads nothing
            await until(lambda: len(server._writers) == 1)
            (its,) = (each.socket.transport for each in server._writers.values())
            writer.write(masked(b"", 0x89) * 1000)
            await until(lambda: len(server.protocol.connections) == 0)
            while timeout < 1.0 and not writer.transport.is_closing():
                writer.write(masked(b"", 0x89) * 1000)
                await asyncio.sleep(0.02)
            its.abort()
            writer.transport.abort()


# Sockets


@pytest.mark.parametrize("encrypted", [False, True])
@in_a_loop
async def test_silent_sockets_of_one_address_cost_another_none(
    encrypted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (listener, http_connection):  # nobody has to go for being slow
        monkeypatch.setattr(module, "HEADER_TIMEOUT", 1000.0)
    crt, key = certificate(tmp_path)
    trust = ssl.create_default_context(cafile=str(crt)) if encrypted else None
    async with serving(tls=tls_context(crt, key) if encrypted else None) as server:
        waiting = await dialled(server, "127.0.0.1")
        crowd = [await dialled(server, "127.0.0.2") for _ in range(300)]
        assert await crowd[0][0].read() == b""
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port, ssl=trust)
        writer.write(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert b" 200 " in await reader.readline()
        writer.transport.abort()
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(waiting[0].read(), 0.1)
        leave([waiting, *crowd])


@in_a_loop
async def test_takers_of_a_file_at_many_addresses_leave_one_place_for_another() -> None:
    async with serving(ClientLimits(requests=1000)) as server:
        server.pages.add_file("/map.ply", bytes(20_000_000))
        ask = b"GET /map.ply HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
        takers = []
        for number in range(32):
            taker = await dialled(server, f"127.0.0.{2 + number // 4}")
            taker[1].write(ask)
            takers.append(taker)
        await until(lambda: len(server._handshake._downloads) == 32)
        reader, writer = await dialled(server, "127.0.0.1")
        writer.write(ask)
        assert b" 200 " in await reader.readline()
        leave([(reader, writer), *takers])


# Lines in the log


@pytest.mark.slow
@in_a_loop
async def test_floods_are_logged_in_a_line_a_minute(caplog: pytest.LogCaptureFixture) -> None:
    async with serving(ClientLimits()) as server:
        for _ in range(6):
            _, writer = await opened(server)
            writer.write(masked(b"", 0x89) * 3000)
            await asyncio.sleep(0.02)
            writer.transport.abort()
        await until(lambda: not server.protocol.connections)
    assert [record.getMessage() for record in caplog.records] == [
        "127.0.0.1: more than 50 pings and pongs/s: disconnected (1 times)"
    ]


def test_warnings_of_a_kind_are_counted_for_a_minute(caplog: pytest.LogCaptureFixture) -> None:
    rare = RareWarnings(logging.getLogger("rare"))
    for second in range(130):
        rare.warn("ping", f"ping at {second}", float(second))
        rare.warn("pong", f"pong at {second}", float(second))
    for kind in range(100):
        rare.warn(str(kind), "of many kinds", 130.0)
    said = [record.getMessage() for record in caplog.records]
    assert [line for line in said if "ping" in line] == [
        "ping at 0 (1 times)",
        "ping at 60 (60 times)",
        "ping at 120 (60 times)",
    ]
    assert len(said) <= 6 + 16
