"""A client of the REST proxy that sends bytes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from teleop.bridges.broker_options import BrokerOptions
from teleop.bridges.rest.rest_config import RestConfig
from teleop.bridges.rest.server import rest_server
from tests.teleop.bridges.support import PATIENCE

JSON = "application/vnd.kafka.json.v2+json"
PLAIN = "application/vnd.kafka.v2+json"


class Glasses:
    """Sends requests as bytes, on one connection, and reads answers."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    async def ask(
        self, line: str, body: str = "", *headers: str, host: str = "127.0.0.1:8082"
    ) -> tuple[int, str, Any]:
        """Send a request; return status, media type and body."""
        fields = [f"{line} HTTP/1.1", f"Host: {host}", *headers]
        if body or line.startswith("POST"):
            fields.append(f"Content-Length: {len(body.encode())}")
        self.writer.write("\r\n".join([*fields, "", body]).encode())
        async with asyncio.timeout(PATIENCE):
            head = (await self.reader.readuntil(b"\r\n\r\n")).decode().split("\r\n")
            answer = dict(field.split(": ", 1) for field in head[1:] if field)
            content = await self.reader.readexactly(int(answer.get("Content-Length", 0)))
        media = answer.get("Content-Type", "")
        return int(head[0].split()[1]), media, json.loads(content) if content else None


@asynccontextmanager
async def proxy(brokers: str | BrokerOptions, **options: Any) -> AsyncIterator[Any]:
    broker = BrokerOptions(brokers) if isinstance(brokers, str) else brokers
    """A proxy that lets clients send to any topic, unless its options say otherwise."""
    async with rest_server(broker, RestConfig(**{"port": 0, "send_to": "*", **options})) as server:
        yield server


@asynccontextmanager
async def glasses(url: str) -> AsyncIterator[Glasses]:
    reader, writer = await asyncio.open_connection("127.0.0.1", int(url.rpartition(":")[2]))
    try:
        yield Glasses(reader, writer)
    finally:
        writer.close()
        await writer.wait_closed()
