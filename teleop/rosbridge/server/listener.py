"""The listening socket of a server."""

from __future__ import annotations

import asyncio
import errno
import ssl
from abc import ABC, abstractmethod
from collections.abc import Collection
from typing import Final, Self

from teleop.rosbridge.errors import ServerError
from teleop.rosbridge.server.accept_errors import AcceptErrors
from teleop.rosbridge.server.connection_flow import ConnectionFlow
from teleop.rosbridge.server.handshake import Handshake
from teleop.rosbridge.server.http_connection import HEADER_TIMEOUT, HttpConnection, Reception
from teleop.rosbridge.server.socket_writer import CLOSE_TIMEOUT
from teleop.rosbridge.server.tls_door import TlsDoor
from teleop.rosbridge.server.websocket_connection import WebSocketConnection

_GOING_AWAY: Final = 1001
"""The WebSocket close code of a server that ends."""


class Listener(ABC):
    """Listens on a port of a host, with TLS or without; subclasses know what receives its connections."""

    def __init__(
        self, host: str, port: int, tls: ssl.SSLContext | None, handshake: Handshake
    ) -> None:
        """Create a listener that does not listen yet; port 0 selects a free one."""
        self.host = host
        self._port = port
        self._handshake = handshake
        self.tls = tls
        """Certificate and key; None if nothing is encrypted."""

        self._server: asyncio.Server | None = None
        self._reception: Reception | None = None
        self._errors: AcceptErrors | None = None

    @abstractmethod
    def _receive(self) -> Reception:
        """Return what receives the connections from now on."""

    async def start(self) -> None:
        """Listen.

        Raises:
            ServerError: If the address is not available; the message is one line.
        """
        loop, reception = asyncio.get_running_loop(), self._receive()
        try:
            self._server = await loop.create_server(
                lambda: self._door(reception), self.host, self._port
            )
        except OSError as error:
            raise ServerError(_cannot_listen(self.host, self._port, error)) from error
        except OverflowError as error:
            raise ServerError(f"port must be 0 to 65535, got {self._port}") from error
        self._reception = reception
        self._errors = AcceptErrors(loop)

    def _door(self, reception: Reception) -> asyncio.Protocol:
        if self.tls is None:
            return HttpConnection(reception)
        return TlsDoor(reception, self.tls, HEADER_TIMEOUT)

    async def close(self) -> None:
        """Stop listening and close all connections; those that do not end in time are aborted."""
        self._handshake.abort_streams()
        if self._server is None or self._reception is None or self._errors is None:
            return
        self._server.close()
        self._errors.remove()
        open_ = self._reception.connections
        closing = [asyncio.create_task(_close(connection)) for connection in list(open_)]
        await _wait(closing, CLOSE_TIMEOUT)
        for connection in list(open_):
            connection.transport.abort()
        await _wait([*closing, *self._reception.tasks], None)
        self._server = None

    async def __aenter__(self) -> Self:
        await self.start()
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        await self.close()

    @property
    def addresses(self) -> list[str]:
        """Addresses of the listening sockets; none before the start."""
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
        return self.tls is not None


async def _close(connection: ConnectionFlow) -> None:
    """Close a WebSocket, or wait for an answer to end."""
    if isinstance(connection, WebSocketConnection):
        await connection.close(_GOING_AWAY, "the server is shutting down")
    elif isinstance(connection, HttpConnection) and not connection.answering:
        connection.transport.abort()
    await connection.wait_ended()


async def _wait(tasks: Collection[asyncio.Task[None]], timeout: float | None) -> None:  # noqa: ASYNC109
    """Wait for tasks; those that do not end in time go on."""
    if tasks:
        await asyncio.wait(tasks, timeout=timeout)


def _cannot_listen(host: str, port: int, error: OSError) -> str:
    where = f"port {port} of {host}"
    if error.errno == errno.EADDRINUSE:
        return f"{where} is in use: end the program that uses it, or choose another port (0: any)"
    if error.errno == errno.EACCES:
        return f"{where} is not permitted for this user: choose one above 1023"
    return f"cannot listen on {where}: {error.strerror or error}"
