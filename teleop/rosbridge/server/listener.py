"""The listening socket of the server."""

from __future__ import annotations

import asyncio
import errno
import logging
import ssl
from collections.abc import Awaitable, Callable
from typing import Final

from websockets.asyncio.server import Server as WebSocketServer, ServerConnection, serve
from websockets.http11 import Request, Response

from teleop.rosbridge.errors import ServerError
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.server.accept_errors import AcceptErrors
from teleop.rosbridge.server.gate import Gate
from teleop.rosbridge.server.http_connection import HEADER_TIMEOUT, HttpConnection
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.socket_writer import CLOSE_TIMEOUT

# websockets logs a traceback for each port scan; errors that matter are raised.
_WIRE: Final = logging.getLogger(f"{__name__}.wire")
_WIRE.setLevel(logging.CRITICAL)


class Listener:
    """A host and a port to listen on, with TLS or without."""

    def __init__(self, host: str, port: int, tls: ssl.SSLContext | None) -> None:
        """Create a listener that does not listen yet; port 0 selects a free one."""
        self.host = host
        self._port = port
        self._tls = tls
        self._server: WebSocketServer | None = None
        self._errors: AcceptErrors | None = None

    async def start(
        self,
        handle: Callable[[ServerConnection], Awaitable[None]],
        process_request: Callable[[ServerConnection, Request], Awaitable[Response | None]],
        keepalive: Keepalive,
        limits: ClientLimits,
    ) -> None:
        """Listen.

        Args:
            handle: Called with each WebSocket, which is closed when it returns.
            process_request: Returns the response to a request that is not upgraded.
            keepalive: Timeouts of unresponsive clients.
            limits: Limits of connections and frames.

        Raises:
            ServerError: If the address is not available; the message is one line.
        """
        connection = type("GatedConnection", (HttpConnection,), {"gate": Gate(limits)})
        try:
            self._server = await serve(
                handle,
                self.host,
                self._port,
                compression=None,  # websockets' default costs 47 ms a megabyte
                max_size=limits.frame,
                ping_interval=keepalive.ping_interval,
                ping_timeout=keepalive.ping_timeout,
                open_timeout=None,  # streams have no end; all else has a deadline of its own
                close_timeout=2,
                create_connection=connection,
                process_request=process_request,
                logger=_WIRE,
                ssl=self._tls,
                ssl_handshake_timeout=None if self._tls is None else HEADER_TIMEOUT,
            )
            self._errors = AcceptErrors(asyncio.get_running_loop())
        except OSError as error:
            raise ServerError(_cannot_listen(self.host, self._port, error)) from error

    async def close(self, abort_clients: Callable[[], None]) -> None:
        """Stop listening and close all connections; unresponsive ones by ``abort_clients``."""
        if self._server is None:
            return
        if self._errors is not None:
            self._errors.remove()
            self._errors = None
        self._server.close(reason="the server is shutting down")
        try:
            async with asyncio.timeout(CLOSE_TIMEOUT):
                await self._server.wait_closed()
        except TimeoutError:
            abort_clients()
            await self._server.wait_closed()
        self._server = None

    @property
    def addresses(self) -> list[str]:
        """Addresses of the listening sockets."""
        if self._server is None:
            return []
        return [listening.getsockname()[0] for listening in self._server.sockets]

    @property
    def port(self) -> int:
        """The port that is listened on, also if 0 was requested."""
        if self._server is not None and self._server.sockets:
            return int(self._server.sockets[0].getsockname()[1])
        return self._port

    @property
    def url(self) -> str:
        """URL for clients on this machine."""
        scheme = "wss" if self.encrypted else "ws"
        return f"{scheme}://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"

    @property
    def encrypted(self) -> bool:
        """Whether connections are encrypted."""
        return self._tls is not None


def _cannot_listen(host: str, port: int, error: OSError) -> str:
    where = f"port {port} of {host}"
    if error.errno == errno.EADDRINUSE:
        return f"{where} is in use: end the program that uses it, or choose another port (0: any)"
    if error.errno == errno.EACCES:
        return f"{where} is not permitted for this user: choose one above 1023"
    return f"cannot listen on {where}: {error.strerror or error}"
