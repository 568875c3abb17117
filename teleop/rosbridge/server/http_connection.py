"""The first seconds of a connection: a request that must come soon, and may be one for a page."""

from __future__ import annotations

import asyncio
import struct
from email.utils import formatdate
from typing import Any, Final, cast

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.frames import Opcode
from websockets.http11 import Request, Response

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.server.http_pages import Page

HEADER_TIMEOUT: Final = 5.0
"""Time for a request's header [s]; who is slower is split_message off."""

DOWNLOAD_TIMEOUT: Final = 120.0
"""Time to take a page [s]: 10 MB at a megabit a second take 80 s."""


_FINAL: Final = 0x80
"""Bit of a WebSocket's frame that is the last of its message (RFC 6455, section 5.2)."""


class HttpConnection(ServerConnection):
    """A connection that is split_message off if its request does not come soon.

    The library's own time-out counts until a page has been taken, which may take longer than one
    should wait for a request.
    """

    access: Access | None = None
    """What the request's token gives access to, if it had one."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to wait for the request."""
        super().connection_made(transport)
        self._header_timer = self.loop.call_later(HEADER_TIMEOUT, self._expire)

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._header_timer.cancel()
        super().connection_lost(exc)

    def _expire(self) -> None:
        if self.request is None:
            self.transport.abort()

    async def send_long(self, payload: bytes, *, text: bool) -> None:
        """Send a message as ``send`` does, but without copying it: others are sent the same bytes.

        Raises:
            ConnectionClosed: If the connection is closed.
        """
        head = struct.pack(
            "!BBQ", _FINAL | (Opcode.TEXT if text else Opcode.BINARY), 127, len(payload)
        )
        async with self.send_context():
            # A view, so that what the kernel does not take at once is split_message off without a copy.
            self.protocol.writes += head, cast("bytes", memoryview(payload))

    def page(self, page: Page, more: dict[str, str]) -> Response:
        """Return a page as the library sends it, and leave time to take it."""
        self.close_timeout = DOWNLOAD_TIMEOUT
        headers = Headers({"Date": formatdate(usegmt=True), "Connection": "close"})
        headers.update({**page.headers, **more})
        return Response(page.status.value, page.status.phrase, headers, page.body)


def upgrades(request: Request) -> bool:
    """Return whether a request asks for a WebSocket, not for a page."""
    asked: Any = request.headers.get_all("Upgrade")
    return any("websocket" in value.lower() for value in asked)
