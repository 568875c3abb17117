"""A further port of a server, for HTTP alone."""

from __future__ import annotations

from teleop.rosbridge.server.gate import Gate
from teleop.rosbridge.server.handshake import Handshake
from teleop.rosbridge.server.http_connection import Reception
from teleop.rosbridge.server.http_handlers import HttpHandlers
from teleop.rosbridge.server.http_pages import HttpPages
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.listener import Listener
from teleop.rosbridge.server.server import Server
from teleop.rosbridge.server.websocket_connection import WebSocketConnection


class HttpServer(Listener):
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
        handshake = Handshake(protocol, server.origins, pages, handlers, websockets=False)
        super().__init__(server.host, port, server.tls, handshake)

    def _receive(self) -> Reception:
        off, limits = Keepalive.off(), self._limits
        return Reception(self._handshake.process, _refuse, off, limits, Gate(limits), self._link)


async def _refuse(socket: WebSocketConnection) -> None:
    """Close a WebSocket; the handshake admits none."""
    await socket.close(1008, "no WebSocket is served on this port")
