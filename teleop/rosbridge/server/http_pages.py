"""HTTP pages on the server's port: version, health, and offered files."""

from __future__ import annotations

import gzip
import hashlib
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib.metadata import PackageNotFoundError, version
from typing import Final, TypeAlias

PROTOCOL: Final = (2, 1, 0)
"""Version of the rosbridge protocol, as that of rosbridge_suite 2.1.0."""

_OPEN: Final = ("/version", "/healthz")
"""Standard pages, which require no token."""

_JSON: Final = "application/json"

_YEAR: Final = 31_536_000
"""Time for which a file that never changes may be cached [s]: a year, as RFC 9111 suggests at most."""

_HOST: Final = re.compile(r"[A-Za-z0-9._-]{1,253}(:\d{1,5})?|\[[0-9A-Fa-f:.]{2,45}\](:\d{1,5})?")
"""A ``Host`` header that can stand in another header; what else a client sends is left out."""

HeadersOfHost: TypeAlias = Callable[[str], Mapping[str, str]]
"""Returns headers of a file by the host and port at which it is requested; empty if unknown."""


@dataclass(frozen=True, slots=True)
class Page:
    """An HTTP response."""

    status: HTTPStatus
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""


@dataclass(frozen=True, slots=True)
class _File:
    body: bytes
    media_type: str
    digest: str
    caching: str
    """The header ``Cache-Control``."""
    public: bool
    headers: HeadersOfHost
    compressed: bytes | None
    """The body as gzip; None where that is not shorter, or was not wanted."""


class HttpPages:
    """All pages by path."""

    def __init__(self, clients: Callable[[], int]) -> None:
        """Create the standard pages; ``clients`` returns the number of connected clients."""
        self._clients = clients
        self._files: dict[str, _File] = {}

    def add_file(
        self,
        path: str,
        body: bytes,
        media_type: str = "application/octet-stream",
        *,
        public: bool = False,
        compress: bool = False,
        immutable: bool = False,
        headers: HeadersOfHost = lambda host: {},
    ) -> str:
        """Offer a file for download; return its SHA-256, which is also its ETag.

        Args:
            path: Path of the URL, such as ``/map.ply``.
            body: Content of the file.
            media_type: Media type of the file.
            public: Whether the file requires no token.
            compress: Whether clients that accept it are sent gzip, with the ETag ``"SHA-256-gzip"``.
            immutable: Whether the path never has another content, so that copies need no validation.
            headers: Returns further headers by the host and port of the request.
        """
        digest = hashlib.sha256(body).hexdigest()
        packed = gzip.compress(body, mtime=0) if compress else body
        caching = "no-cache"  # a copy may be used only after validation by its ETag
        if immutable:
            caching = f"{'public' if public else 'private'}, max-age={_YEAR}, immutable"
        self._files[path] = _File(
            body,
            media_type,
            digest,
            caching,
            public,
            headers,
            packed if len(packed) < len(body) else None,
        )
        return digest

    def is_public(self, target: str) -> bool:
        """Return whether the page at a request's target requires no token."""
        path = target.partition("?")[0]
        file = self._files.get(path)
        return path in _OPEN or (file is not None and file.public)

    def respond(self, method: str, target: str, headers: Mapping[str, str]) -> Page | None:
        """Return the page at a request's target; None if there is none."""
        path = target.partition("?")[0]
        if path == "/version":
            return _for_method(method, _json_page(_version()))
        if path == "/healthz":
            return _for_method(method, _json_page({"status": "ok", "clients": self._clients()}))
        file = self._files.get(path)
        return None if file is None else _for_method(method, _file_page(file, headers))


def _file_page(file: _File, request: Mapping[str, str]) -> Page:
    """Return a file, or that the client's copy is valid."""
    host = request.get("Host", "")
    fields = {"Cache-Control": file.caching}
    fields |= file.headers(host if _HOST.fullmatch(host) else "")
    body, tag = file.body, f'"{file.digest}"'
    if file.compressed is not None:
        fields["Vary"] = "Accept-Encoding"
        if _accepts_gzip(request.get("Accept-Encoding", "")):
            body, tag = file.compressed, f'"{file.digest}-gzip"'
    fields["ETag"] = tag
    if _matches(request.get("If-None-Match", ""), tag):
        return Page(HTTPStatus.NOT_MODIFIED, fields)
    if body is file.compressed:
        fields["Content-Encoding"] = "gzip"
    return Page(HTTPStatus.OK, {"Content-Type": file.media_type, **fields}, body)


def _for_method(method: str, page: Page) -> Page:
    if method not in ("GET", "HEAD"):
        return Page(HTTPStatus.METHOD_NOT_ALLOWED, {"Allow": "GET, HEAD", "Content-Length": "0"})
    return of_method(method, page)


def of_method(method: str, page: Page) -> Page:
    """Return a page with its length, and for ``HEAD`` without its body."""
    headers = {**page.headers, "Content-Length": str(len(page.body))}
    if page.status is HTTPStatus.NOT_MODIFIED:
        headers = page.headers
    return Page(page.status, headers, b"" if method == "HEAD" else page.body)


def _json_page(content: object) -> Page:
    headers = {"Content-Type": _JSON, "Cache-Control": "no-store"}
    return Page(HTTPStatus.OK, headers, json.dumps(content).encode())


def _matches(condition: str, tag: str) -> bool:
    """Return whether an ETag matches an ``If-None-Match`` (RFC 9110, section 13.1.2)."""
    tags = [part.strip().removeprefix("W/") for part in condition.split(",")]
    return "*" in tags or tag in tags


def _accepts_gzip(accepted: str) -> bool:
    """Return whether an ``Accept-Encoding`` names gzip with a weight above 0 (RFC 9110, 12.5.3)."""
    for part in accepted.lower().split(","):
        coding, _, weight = (text.strip() for text in part.partition(";"))
        if coding in ("gzip", "x-gzip"):
            return re.fullmatch(r"q\s*=\s*0(\.0*)?", weight) is None
    return False


def _version() -> dict[str, object]:
    parts = dict(zip(("major", "minor", "patch"), PROTOCOL, strict=True))
    try:
        server = version("farsteer")
    except PackageNotFoundError:  # run from a source folder that is not installed
        server = "unknown"
    return {"protocol": parts, "server": server}
