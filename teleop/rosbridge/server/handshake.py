"""Decision on each HTTP request: reject it, upgrade it to a WebSocket, or answer it with a page."""

from __future__ import annotations

from http import HTTPStatus
from typing import Final

from websockets.http11 import Request, Response

from teleop.rosbridge.auth.authenticator import token_in
from teleop.rosbridge.auth.origins import Origins
from teleop.rosbridge.auth.permissions import UNGUARDED
from teleop.rosbridge.framing.outbox import BULK_BYTES
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.downloads import Downloads
from teleop.rosbridge.server.handled_request import answer, foreign_page
from teleop.rosbridge.server.http_connection import (
    HttpConnection,
    page_response,
    wants_websocket,
)
from teleop.rosbridge.server.http_handlers import HttpHandlers, Route, Stream
from teleop.rosbridge.server.http_pages import HttpPages, Page, of_method
from teleop.rosbridge.server.request_reader import NOT_UNDERSTOOD

_SINGLE: Final = ("Host", "Origin", "Sec-Fetch-Site", "If-None-Match", "Accept-Encoding")
"""Headers that a request may have only once, since proxies disagree on which one counts."""

_PREFLIGHT: Final = Page(
    HTTPStatus.NO_CONTENT,
    {
        "Vary": "Origin",
        "Access-Control-Allow-Methods": "GET, HEAD",
        "Access-Control-Allow-Headers": "Authorization",
        "Access-Control-Max-Age": "600",
    },
)
"""Allows a page of another origin to send its token in a header: browsers ask first, without it."""


class Handshake:
    """Processes each request before there is a WebSocket."""

    def __init__(
        self,
        protocol: Protocol,
        origins: Origins,
        pages: HttpPages,
        handlers: HttpHandlers,
        *,
        websockets: bool = True,
    ) -> None:
        self._protocol = protocol
        self._origins = origins
        self._pages = pages
        self._handlers = handlers
        self._websockets = websockets
        self._downloads = Downloads()
        self._streams: set[HttpConnection] = set()

    async def process(self, socket: HttpConnection, request: Request) -> Response | None:
        """Return the response to a request, or None if it has been answered, or is a WebSocket now.

        Foreign web pages are rejected, since a browser on this machine would let them connect.
        """
        if not self._known(socket, request) and not socket.gate.admit_request(
            socket.host, socket.now
        ):
            return socket.respond(HTTPStatus.TOO_MANY_REQUESTS, "too many requests\n")
        for name in _SINGLE:
            if len(request.headers.get_all(name)) > 1:
                return socket.respond(HTTPStatus.BAD_REQUEST, f"more than one {name} header\n")
        origin, host = request.headers.get("Origin"), request.headers.get("Host", "")
        if not wants_websocket(request) and not self._origins.allow_host(host):
            return socket.respond(HTTPStatus.FORBIDDEN, f"host {host[:80]} is not this machine\n")
        if origin is not None and not self._origins.allow(origin, host):
            return socket.respond(HTTPStatus.FORBIDDEN, f"origin {origin} is not allowed\n")
        route = None if wants_websocket(request) else self._handlers.find(request.path)
        if socket.body and (route is None or not route.takes_body):
            return socket.respond(HTTPStatus.BAD_REQUEST, f"{NOT_UNDERSTOOD}\n")
        if route is not None and route.own_pages_only:
            if why := foreign_page(request, self._origins):
                return socket.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
            origin = None  # so no header lets another origin read the answer
        if origin is not None and _is_preflight(request):
            return page_response(_PREFLIGHT, {"Access-Control-Allow-Origin": origin})
        if refusal := self._authenticate(socket, request, route):
            return refusal
        if route is not None:
            return await self._handled(socket, request, route, origin)
        if not wants_websocket(request):
            return await self._page(socket, request, origin)
        if not self._websockets:
            return socket.respond(HTTPStatus.NOT_FOUND, "no WebSocket is served on this port\n")
        access = UNGUARDED if self._protocol.authenticator is None else socket.access
        if why := self._protocol.places.refusal(access, socket.host):
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, f"{why}\n")
        return socket.upgrade(request)

    def abort_streams(self) -> None:
        """Disconnect the clients that wait for a handler, or take its stream."""
        for socket in self._streams:
            socket.transport.abort()

    def _known(self, socket: HttpConnection, request: Request) -> bool:
        """Return whether a request has a token of its address, which no flood may keep out."""
        token = None if self._protocol.authenticator is None else _token(request)
        return token is not None and self._protocol.token_guesses.known(socket.host, token)

    def _authenticate(
        self, socket: HttpConnection, request: Request, route: Route | None
    ) -> Response | None:
        """Verify the token of a request; without one, the ``auth`` operation may follow."""
        authenticator = self._protocol.authenticator
        if authenticator is None:
            return None
        token = _token(request)
        if token is None:
            socket.access = authenticator.anonymous
        else:
            guesses = self._protocol.token_guesses
            if guesses.locked(socket.host, token, socket.now):
                text = "too many wrong tokens from this address: try again later\n"
                response = socket.respond(HTTPStatus.TOO_MANY_REQUESTS, text)
                response.headers["Retry-After"] = "10"
                return response
            socket.access = authenticator.verify_token(token)
            if socket.access is None:
                guesses.wrong(socket.host, token, socket.now)
            else:
                guesses.accepted(socket.host, token, socket.now)
        public = self._pages.is_public(request.path) if route is None else route.public
        no_token_needed = wants_websocket(request) or public
        may_follow = token is None and no_token_needed
        if socket.access is not None or may_follow:
            return None
        text = "a token is required\n" if token is None else "the token is not accepted\n"
        response = socket.respond(HTTPStatus.UNAUTHORIZED, text)
        response.headers["WWW-Authenticate"] = "Bearer"
        return response

    async def _page(
        self, socket: HttpConnection, request: Request, origin: str | None
    ) -> Response | None:
        """Return the response to a request for a page; a large one has been sent already."""
        page = self._pages.respond(request.method, request.path, request.headers)
        if page is None:
            if request.path.partition("?")[0] == "/" and self._websockets:
                return socket.upgrade(request)  # which says that a WebSocket is expected
            return socket.respond(HTTPStatus.NOT_FOUND, "page not found\n")
        return await self._send(socket, page, origin)

    async def _handled(
        self, socket: HttpConnection, request: Request, route: Route, origin: str | None
    ) -> Response | None:
        """Return the response of a handler; a stream has been sent already, until its end."""
        self._streams.add(socket)
        try:
            answered = await answer(socket, request, route)
            if isinstance(answered, Stream):
                head = page_response(Page(HTTPStatus.OK, dict(answered.headers)), {})
                try:
                    if request.method == "HEAD":
                        return head
                    await socket.stream(head, answered.chunks)
                finally:
                    answered.ended()
                return None
        except ConnectionError:
            return socket.respond(HTTPStatus.REQUEST_TIMEOUT, "the client has left\n")
        finally:
            self._streams.discard(socket)
        return await self._send(socket, of_method(request.method, answered), origin)

    async def _send(
        self, socket: HttpConnection, page: Page, origin: str | None
    ) -> Response | None:
        """Return the response of a page; a large one has been sent already."""
        varies = (page.headers.get("Vary"), "Origin")
        headers = {"Vary": ", ".join(name for name in varies if name)}
        if origin is not None:
            headers["Access-Control-Allow-Origin"] = origin
            headers["Access-Control-Expose-Headers"] = "ETag"
        response = page_response(page, headers)
        if len(page.body) <= BULK_BYTES:
            return response
        if not self._downloads.enter(socket):
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many downloads\n")
        try:
            await socket.download(response)
        finally:
            self._downloads.leave(socket)
        return None


def _is_preflight(request: Request) -> bool:
    """Return whether a browser asks what a page of another origin may request."""
    return request.method == "OPTIONS" and "Access-Control-Request-Method" in request.headers


def _token(request: Request) -> str | None:
    """Return the token in a request, if there is one; in the header it is UTF-8."""
    given = [value.encode("iso-8859-1") for value in request.headers.get_all("Authorization")]
    return token_in(request.path, given[0].decode(errors="replace") if given else None)
