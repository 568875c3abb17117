"""An accepted connection until it becomes a WebSocket: request deadline, permissions, downloads."""

from __future__ import annotations

import asyncio
from email.utils import formatdate
from typing import Final

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.server.http_pages import Page

HEADER_TIMEOUT: Final = 5.0
"""Time for the header of a request [s]; slower clients are disconnected."""

DOWNLOAD_TIMEOUT: Final = 120.0
"""Time for the download of a file [s]: 10 MB at 1 Mbit/s take 80 s."""


class HttpConnection(ServerConnection):
    """A connection that is aborted if its request does not arrive in time.

    The ``open_timeout`` of websockets covers the whole handshake. Here it is the time for a
    download, which takes place during the handshake, and the request has a shorter deadline.
    """

    access: Access | None = None
    """Permissions of the token in the request; None without one."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start the deadline of the request."""
        super().connection_made(transport)
        self._deadline = self.loop.call_later(HEADER_TIMEOUT, self._abort_without_request)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the deadline of the request."""
        self._deadline.cancel()
        super().connection_lost(exc)

    async def download(self, response: Response) -> None:
        """Send a large response and wait until the client has received it.

        websockets limits the time to send a response by ``close_timeout``, which also applies to
        WebSockets and is shorter than a download may take.
        """
        self.transport.write(response.serialize())
        if self.transport.can_write_eof():
            self.transport.write_eof()
        else:  # TLS
            self.transport.close()
        await self.wait_closed()

    def _abort_without_request(self) -> None:
        if self.request is None:
            self.transport.abort()


def page_response(page: Page, headers: dict[str, str]) -> Response:
    """Return a page with further headers as a response of websockets."""
    fields = Headers({"Date": formatdate(usegmt=True), "Connection": "close"})
    fields.update({**page.headers, **headers})
    return Response(page.status.value, page.status.phrase, fields, page.body)


def wants_websocket(request: Request) -> bool:
    """Return whether a request is for a WebSocket instead of a page."""
    return any("websocket" in value.lower() for value in request.headers.get_all("Upgrade"))
