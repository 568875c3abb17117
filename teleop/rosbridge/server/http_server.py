"""A further port of a server, for HTTP alone."""

from __future__ import annotations

from typing import Self

from teleop.rosbridge.server.gate import Gate
from teleop.rosbridge.server.handshake import Handshake
from teleop.rosbridge.server.http_connection import Reception
from teleop.rosbridge.server.http_handlers import HttpHandlers
from teleop.rosbridge.server.http_pages import HttpPages
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.listener import Listener
from teleop.rosbridge.server.server import Server
from teleop.rosbridge.server.websocket_connection import WebSocketConnection


class HttpServer:
    """Serves handlers on the host of a server, with its origins, tokens and certificate, and no WebSocket."""

    def __init__(self, server: Server, port: int, handlers: HttpHandlers) -> None:
        """Create a server that does not listen yet.

        Args:
            server: The server whose further port this is.
            port: Port to listen on; 0 selects a free one, see ``port``.
            handlers: The handlers.
        """
        protocol = server.protocol
        pages = HttpPages(lambda: len(protocol.connections))
        self._limits, self._link = protocol.limits, server.http_link
        self._listener = Listener(server.host, port, server.tls)
        self._handshake = Handshake(protocol, server.origins, pages, handlers, websockets=False)

    @property
    def port(self) -> int:
        """The port that is listened on, also if 0 was requested."""
        return self._listener.port

    async def start(self) -> None:
        """Listen.

        Raises:
            ServerError: If the address is not available; the message is one line.
        """
        off, limits = Keepalive.off(), self._limits
        await self._listener.start(
            Reception(self._handshake.process, _refuse, off, limits, Gate(limits), self._link)
        )

    async def close(self) -> None:
        """Stop listening and disconnect all clients."""
        self._handshake.abort_streams()
        await self._listener.close()

    async def __aenter__(self) -> Self:
        await self.start()
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        await self.close()


async def _refuse(socket: WebSocketConnection) -> None:
    """Close a WebSocket; the handshake admits none."""
    await socket.close(1008, "no WebSocket is served on this port")
