"""Coroutines that answer HTTP requests at paths of their own, with a page or with a stream."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias
from urllib.parse import parse_qsl, unquote, urlsplit

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.server.http_pages import Page

READING: Final = ("GET", "HEAD")
"""Methods that change nothing."""

_MAX_FIELDS: Final = 32
"""Number of fields of a query; further ones are ignored, so that none costs much."""


@dataclass(frozen=True, slots=True)
class HttpRequest:
    """A request, as its handler sees it."""

    method: str
    """Method, in upper case."""
    path: str
    """Path of the URL without its query, with percent signs decoded."""
    query: Mapping[str, str]
    """First value of each field of the URL's query, decoded."""
    headers: Mapping[str, str]
    """Header, whose names have no case."""
    address: str
    """Network address of the client, without the port."""
    access: Access | None
    """Permissions of the client; None if a token is required and it gave none."""
    body: bytes = b""
    """Body of a POST; empty but for routes that take one."""


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """A response that goes on until the client leaves or there are no further chunks."""

    headers: Mapping[str, str]
    """Header of the response."""
    chunks: AsyncIterator[bytes]
    """The body; the next chunk is requested when the socket has taken the one before."""
    ended: Callable[[], object] = lambda: None
    """Called once at the end, also of a stream that never began."""


Handler: TypeAlias = Callable[[HttpRequest], Awaitable[Page | Stream]]
"""Answers a request; it is cancelled if the client leaves before the answer."""


@dataclass(frozen=True, slots=True)
class Route:
    """A handler, and the requests that it is given."""

    handler: Handler
    methods: tuple[str, ...] = READING
    """Methods that the handler knows; others are answered with 405."""
    public: bool = False
    """Whether requests without a token are handed over too, so that the handler decides."""
    own_pages_only: bool = False
    """Whether pages of other origins, those that may connect included, are refused."""
    takes_body: bool = False
    """Whether a request may have a body; others with one are refused."""


class HttpHandlers:
    """All handlers by path."""

    def __init__(self) -> None:
        self._routes: dict[str, Route] = {}

    def add(self, path: str, route: Route) -> None:
        """Hand the requests for a path over; one that ends with a slash stands for all below it."""
        self._routes[path] = route

    def find(self, target: str) -> Route | None:
        """Return the route of a request's target; None if there is none."""
        path = target.partition("?")[0]
        while path not in self._routes and path:
            path = path[: path.rstrip("/").rfind("/") + 1]
            if path == "/":
                return None  # what is below the root is not the root
        return self._routes.get(path)


def request_of(
    method: str,
    target: str,
    headers: Mapping[str, str],
    address: str,
    access: Access | None,
    body: bytes = b"",
) -> HttpRequest:
    """Return a request for its handler.

    Raises:
        ValueError: If the target is no valid URL.
    """
    parts = urlsplit(target)
    query: dict[str, str] = {}
    for name, value in parse_qsl(parts.query, keep_blank_values=True)[:_MAX_FIELDS]:
        query.setdefault(name, value)
    return HttpRequest(method, unquote(parts.path), query, headers, address, access, body)
