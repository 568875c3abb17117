"""An HTTP server that holds a bounded number of connections, in all and of one address."""

from __future__ import annotations

from collections import Counter
from typing import Any, Final

from tornado.httpserver import HTTPServer
from tornado.iostream import IOStream

from teleop.bridges.rest.media_types import PLAIN

MAX_CONNECTIONS: Final = 256
"""Connections at a time; each may hold a body of 1 MB."""
MAX_OF_ADDRESS: Final = 64
"""Connections of one address at a time: one client leaves room for others."""

_BODY: Final = b'{"error_code": 50302, "message": "there are too many connections already"}'
_FULL: Final = (
    f"HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Type: {PLAIN}\r\n"
    f"Content-Length: {len(_BODY)}\r\n\r\n"
).encode() + _BODY


class BoundedServer(HTTPServer):
    """Closes connections beyond the bounds, with an answer of status 503."""

    def initialize(self, *args: Any, **kwargs: Any) -> None:
        """Take what ``HTTPServer`` takes."""
        super().initialize(*args, **kwargs)
        self._held: Counter[str] = Counter()

    def handle_stream(self, stream: IOStream, address: tuple[Any, ...]) -> None:
        """Serve a connection, if there is room for it."""
        host = _host(address)
        if self._held[host] >= MAX_OF_ADDRESS or self._held.total() >= MAX_CONNECTIONS:
            stream.write(_FULL)
            stream.close()
            return
        self._held[host] += 1
        super().handle_stream(stream, address)

    def on_close(self, server_conn: Any) -> None:
        """Make room for another connection."""
        super().on_close(server_conn)
        host = _host(server_conn.context.address)
        self._held[host] -= 1
        if not self._held[host]:
            del self._held[host]


def _host(address: tuple[Any, ...] | None) -> str:
    return str(address[0]) if address else ""
