"""Answer of a handler to one request: its page, its stream, or that it failed."""

from __future__ import annotations

import logging
from http import HTTPStatus
from typing import Final

from websockets.http11 import Request

from teleop.rosbridge.auth.origins import Origins
from teleop.rosbridge.server.http_connection import HttpConnection
from teleop.rosbridge.server.http_handlers import Route, Stream, request_of
from teleop.rosbridge.server.http_pages import Page

_LOG: Final = logging.getLogger(__name__)

_OWN_SITES: Final = ("same-origin", "none")
"""``Sec-Fetch-Site`` of a page of this server, and of an address that a person typed."""


def foreign_page(request: Request, origins: Origins) -> str | None:
    """Return why a request is that of a page of another origin; None if it is not.

    Browsers say where a request begins (W3C Fetch Metadata); programs say nothing of it. A page whose name was
    pointed at this machine is of its own origin, but its ``Host`` is no name of this machine.
    """
    headers = request.headers
    host, origin = headers.get("Host", ""), headers.get("Origin")
    if not origins.names_this_machine(host):
        return f"host {host[:80]} is not an address of this machine"
    if origin is not None and origin.partition("://")[2] != host:
        return f"pages of {origin[:80]} get nothing here, only the robot's own do"
    site = headers.get("Sec-Fetch-Site", "none")
    if site not in _OWN_SITES:
        return f"a page of another origin gets nothing here (Sec-Fetch-Site: {site[:80]})"
    return None


def text_page(status: HTTPStatus, text: str, **headers: str) -> Page:
    """Return a line of text as a page."""
    fields = {name.replace("_", "-"): value for name, value in headers.items()}
    plain = {"Content-Type": "text/plain; charset=utf-8", "Cache-Control": "no-store", **fields}
    return Page(status, plain, f"{text}\n".encode())


async def answer(socket: HttpConnection, request: Request, route: Route) -> Page | Stream:
    """Return what a handler answers; a failure of its own is logged.

    Raises:
        ConnectionError: If the client left before.
    """
    if request.method not in route.methods:
        allowed = ", ".join(route.methods)
        refusal = f"{request.method[:20]} is not possible here: {allowed}"
        return text_page(HTTPStatus.METHOD_NOT_ALLOWED, refusal, Allow=allowed)
    try:
        asked = request_of(
            request.method,
            request.path,
            request.headers,
            socket.host,
            socket.access,
            socket.body,
        )
    except ValueError:
        return text_page(HTTPStatus.BAD_REQUEST, "the address is not valid")
    try:
        return await socket.while_connected(route.handler(asked))
    except ConnectionError:
        raise
    except Exception:
        _LOG.exception("%s %s failed", request.method, asked.path[:256])
        return text_page(HTTPStatus.INTERNAL_SERVER_ERROR, "internal error")
