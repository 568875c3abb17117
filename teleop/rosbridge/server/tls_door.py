"""An accepted socket until TLS is agreed on: it counts from the start, and has little time."""

from __future__ import annotations

import asyncio
import ssl

from teleop.rosbridge.server.http_connection import HttpConnection, Reception


class TlsDoor(asyncio.Protocol):
    """Has asyncio encrypt a socket, and hands it over."""

    def __init__(self, reception: Reception, tls: ssl.SSLContext, timeout: float) -> None:
        """Prepare for one socket; ``timeout`` is the time for the TLS handshake [s]."""
        self._reception, self._tls, self._timeout = reception, tls, timeout

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Count the socket, and begin."""
        assert isinstance(transport, asyncio.Transport)
        peer = transport.get_extra_info("peername")
        self._reception.gate.enter(transport, str(peer[0]) if peer else "")
        self._reception.run(self._open(transport))

    async def _open(self, transport: asyncio.Transport) -> None:
        connection = HttpConnection(self._reception)
        try:
            secured = await asyncio.get_running_loop().start_tls(
                transport,
                connection,
                self._tls,
                server_side=True,
                ssl_handshake_timeout=self._timeout,
            )
        except OSError:  # whatever has failed, the client has its reasons
            secured = None
        self._reception.gate.leave(transport)
        if secured is None or secured.is_closing():
            transport.abort()
        else:
            connection.connection_made(secured)
