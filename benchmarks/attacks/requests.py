"""Requests and clients that a server must refuse, or admit in spite of others."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus, WebSocketException

_GUESSES: Final = 200
"""Wrong tokens that are tried."""


async def print_refusals(url: str, token: str, log: Path) -> None:
    """Print what the server answers to each request, with what it should."""
    print(f"  {'request':44s} {'expected':>20s}   answered")
    checks: tuple[tuple[str, str, Callable[[], Awaitable[str]]], ...] = (
        ("GET /map.ply by a rebound name", "403", lambda: _status(url, "Host: evil.example\r\n")),
        ("two Origin headers", "400", lambda: _status(url, _host(url) + "Origin: null\r\n" * 2)),
        ("two Host headers", "400", lambda: _status(url, _host(url) * 2)),
        (
            "two If-None-Match headers",
            "400",
            lambda: _status(url, _host(url) + 'If-None-Match: "x"\r\n' * 2),
        ),
        ("another /map.ply beside 4 stalled takers", "200 in 5 s", lambda: _stalled(url)),
        ("operator beside 31 clients without a token", "101", lambda: _crowd(url, token)),
        (f"{_GUESSES} wrong tokens: looked at", "at most 20", lambda: _guesses(url)),
        ("bytes on standard error", "few", lambda: _written(log)),
    )
    for name, expected, check in checks:
        print(f"  {name:44s} {expected:>20s}   {await check()}", flush=True)


async def admitted(url: str) -> str:
    """Return how many of ten connections come in that are yet to give a token, two a second."""
    count = 0
    for _ in range(10):
        await asyncio.sleep(0.5)
        with contextlib.suppress(InvalidStatus, OSError):
            async with connect(url, proxy=None):
                count += 1
    return f"{count} of 10"


def _host(url: str) -> str:
    return f"Host: {urlsplit(url).netloc}\r\n"


async def _status(url: str, headers: str) -> str:
    reader, writer = await asyncio.open_connection(urlsplit(url).hostname, urlsplit(url).port)
    writer.write(f"GET /map.ply HTTP/1.1\r\n{headers}\r\n".encode())
    line = await reader.readline()
    writer.transport.abort()
    return line.split()[1].decode() if line else "closed"


async def _stalled(url: str) -> str:
    takers = []
    for _ in range(4):
        _, writer = await asyncio.open_connection(
            urlsplit(url).hostname, urlsplit(url).port, limit=1024
        )
        writer.write(f"GET /map.ply HTTP/1.1\r\n{_host(url)}\r\n".encode())
        takers.append(writer)
    answer = ""
    for waited in range(6):
        await asyncio.sleep(1)
        answer = f"{await _status(url, _host(url))} after {waited + 1} s"
        if answer.startswith("200"):
            break
    for writer in takers:
        writer.transport.abort()
    return answer


async def _crowd(url: str, token: str) -> str:
    crowd = []
    for _ in range(31):
        with contextlib.suppress(InvalidStatus):
            crowd.append(await connect(url, proxy=None))
    try:
        headers = {"Authorization": f"Bearer {token}"}
        admitted = []
        for _ in range(2):
            admitted.append(await connect(url, proxy=None, additional_headers=headers))
        answer = f"101 beside {len(crowd)}"
        for one in admitted:
            await one.close()
    except InvalidStatus as error:
        answer = str(error.response.status_code)
    for one in crowd:
        with contextlib.suppress(WebSocketException):
            await one.close()
    return answer


async def _guesses(url: str) -> str:
    looked_at = 0
    for number in range(_GUESSES):
        try:
            headers = {"Authorization": f"Bearer wrong {number}"}
            await connect(url, proxy=None, additional_headers=headers)
        except InvalidStatus as error:
            looked_at += error.response.status_code == 401
    return str(looked_at)


async def _written(log: Path) -> str:
    return str(await asyncio.to_thread(lambda: log.stat().st_size))
