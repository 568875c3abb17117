"""The address that is listened at."""

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
from teleop.rosbridge.server.http_connection import DOWNLOAD_TIMEOUT, HEADER_TIMEOUT, HttpConnection
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.socket_writer import PATIENCE

# websockets tells of each port scan with a traceback; what concerns us is raised.
_WIRE: Final = logging.getLogger(f"{__name__}.wire")
_WIRE.setLevel(logging.CRITICAL)


class Listener:
    """A host and a port, with TLS or without."""

    def __init__(self, host: str, port: int, tls: ssl.SSLContext | None) -> None:
        """Make an endpoint that does not listen yet; port 0 takes a free one."""
        self.host = host
        self._port = port
        self._tls = tls
        self._server: WebSocketServer | None = None

    async def start(
        self,
        attend: Callable[[ServerConnection], Awaitable[None]],
        screen: Callable[[ServerConnection, Request], Response | None],
        pulse: Keepalive,
        largest: int,
    ) -> None:
        """Listen.

        Args:
            attend: Is called with each connection, which ends with it.
            screen: Answers requests that get no connection.
            pulse: How a dead client is found out.
            largest: Bound on a frame that comes in [bytes].

        Raises:
            ServerError: If the address cannot be had; one line says which and what to do.
        """
        try:
            self._server = await serve(
                attend,
                self.host,
                self._port,
                compression=None,  # websockets' default costs 47 ms a megabyte
                max_size=largest,
                ping_interval=pulse.ping_interval,
                ping_timeout=pulse.ping_timeout,
                open_timeout=DOWNLOAD_TIMEOUT,  # for the request, HttpConnection has its own
                close_timeout=2,
                create_connection=HttpConnection,
                process_request=screen,
                logger=_WIRE,
                ssl=self._tls,
                ssl_handshake_timeout=None if self._tls is None else HEADER_TIMEOUT,
            )
        except OSError as error:
            raise ServerError(_cannot_listen(self.host, self._port, error)) from error

    async def close(self, split_message: Callable[[], None]) -> None:
        """Stop listening and say goodbye to all; ``split_message`` is called if somebody does not hear it."""
        if self._server is None:
            return
        self._server.close(reason="the server ends")
        try:
            async with asyncio.timeout(PATIENCE):
                await self._server.wait_closed()
        except TimeoutError:  # somebody does not even read that we go
            split_message()
            await self._server.wait_closed()
        self._server = None

    @property
    def addresses(self) -> list[str]:
        """Where it listens."""
        if self._server is None:
            return []
        return [listening.getsockname()[0] for listening in self._server.sockets]

    @property
    def port(self) -> int:
        """The port listened at, also if any would do."""
        if self._server is not None and self._server.sockets:
            return int(self._server.sockets[0].getsockname()[1])
        return self._port

    @property
    def url(self) -> str:
        """What a client on this machine connects to."""
        scheme = "wss" if self.encrypted else "ws"
        return f"{scheme}://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"

    @property
    def encrypted(self) -> bool:
        """Whether what goes over the wire is encrypted."""
        return self._tls is not None


def _cannot_listen(host: str, port: int, error: OSError) -> str:
    where = f"port {port} of {host}"
    if error.errno == errno.EADDRINUSE:
        return f"{where} is in use: end the program that holds it, or take another port (0: any)"
    if error.errno == errno.EACCES:
        return f"{where} may not be used by this user: take one above 1023"
    return f"cannot listen at {where}: {error.strerror or error}"
