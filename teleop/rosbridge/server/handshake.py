"""The server's door: which requests may come in, and which want only a page."""

from __future__ import annotations

from http import HTTPStatus
from typing import Final

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response
from websockets.protocol import State

from teleop.rosbridge.auth.authenticator import token_in
from teleop.rosbridge.auth.origins import Origins
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.http_connection import HttpConnection, upgrades
from teleop.rosbridge.server.http_pages import OPEN_PAGES, HttpPages
from teleop.rosbridge.server.outbox import BULK_BYTES

_MOST_DOWNLOADS: Final = 4
"""Large files that go out at one time; each waits in memory until it has been taken."""

_MOST_STRANGERS: Final = 8
"""Clients at one time that have not said who they are; they must not keep out those who have."""


class Handshake:
    """Judges each request before there is a WebSocket, and answers those for pages."""

    def __init__(self, protocol: Protocol, origins: Origins, pages: HttpPages) -> None:
        self._protocol = protocol
        self._origins = origins
        self._pages = pages
        self._takers: set[ServerConnection] = set()
        """Connections that are given large files."""

    def screen(self, socket: ServerConnection, request: Request) -> Response | None:
        """Return the answer to a request that gets no WebSocket; None lets it in.

        Foreign web pages are refused, since any browser on this machine would let them through.
        """
        origin, host = request.headers.get("Origin"), request.headers.get("Host", "")
        if origin is not None and not self._origins.allow(origin, host):
            return socket.respond(HTTPStatus.FORBIDDEN, f"pages of {origin} may not connect here\n")
        if refusal := self._identify(socket, request):
            return refusal
        if not upgrades(request):
            return self._page(socket, request, origin)
        clients = self._protocol.connections
        if len(clients) >= self._protocol.limits.clients:
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many clients\n")
        strangers = sum(client.access is None for client in clients)
        assert isinstance(socket, HttpConnection)
        if socket.access is None and strangers >= _MOST_STRANGERS:
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many without a token\n")
        return None

    def _identify(self, socket: ServerConnection, request: Request) -> Response | None:
        """Let a request in by its token; who has none may still use the ``auth`` operation."""
        gate = self._protocol.gate
        if gate is None:
            return None
        assert isinstance(socket, HttpConnection)
        given = request.headers.get_all("Authorization")
        token = token_in(request.path, given[0] if given else None)
        access: Access | None = gate.anonymous if token is None else gate.token(token)
        socket.access = access
        open_to_all = request.path.partition("?")[0] in OPEN_PAGES
        waits = token is None and (upgrades(request) or open_to_all)
        if access is not None or waits:
            return None
        text = "a token is needed\n" if token is None else "this token is not accepted\n"
        response = socket.respond(HTTPStatus.UNAUTHORIZED, text)
        response.headers["WWW-Authenticate"] = "Bearer"
        return response

    def _page(
        self, socket: ServerConnection, request: Request, origin: str | None
    ) -> Response | None:
        """Answer plain HTTP."""
        page = self._pages.answer(request.method, request.path, request.headers)
        if page is None:
            if request.path.partition("?")[0] == "/":
                return None  # the library says that a WebSocket is expected here
            return socket.respond(HTTPStatus.NOT_FOUND, "there is no such page\n")
        assert isinstance(socket, HttpConnection)
        if len(page.body) > BULK_BYTES:
            self._takers = {taker for taker in self._takers if taker.state is not State.CLOSED}
            if len(self._takers) >= _MOST_DOWNLOADS:
                return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many downloads\n")
            self._takers.add(socket)
        more = {"Vary": "Origin"}
        if origin is not None:
            more["Access-Control-Allow-Origin"] = origin
            more["Access-Control-Expose-Headers"] = "ETag"
        return socket.page(page, more)
