"""HTTP pages on the server's port: version, health, and offered files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib.metadata import PackageNotFoundError, version
from typing import Final

PROTOCOL: Final = (2, 1, 0)
"""Version of the rosbridge protocol, as that of rosbridge_suite 2.1.0."""

OPEN_PAGES: Final = ("/version", "/healthz")
"""Pages that require no token."""

_JSON: Final = "application/json"


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
    etag: str


class HttpPages:
    """All pages by path."""

    def __init__(self, clients: Callable[[], int]) -> None:
        """Create the standard pages; ``clients`` returns the number of connected clients."""
        self._clients = clients
        self._files: dict[str, _File] = {}

    def add_file(self, path: str, body: bytes, media_type: str = "application/octet-stream") -> str:
        """Offer a file for download; return its SHA-256, which is also its ETag.

        Args:
            path: Path of the URL, such as ``/map.ply``.
            body: Content of the file.
            media_type: Media type of the file.
        """
        digest = hashlib.sha256(body).hexdigest()
        self._files[path] = _File(body, media_type, f'"{digest}"')
        return digest

    def respond(self, method: str, target: str, headers: Mapping[str, str]) -> Page | None:
        """Return the page at a request's target; None if there is none."""
        path = target.partition("?")[0]
        if path == "/version":
            return _for_method(method, _json_page(_version()))
        if path == "/healthz":
            return _for_method(method, _json_page({"status": "ok", "clients": self._clients()}))
        file = self._files.get(path)
        if file is None:
            return None
        # A cached copy may be used only after validation by its ETag.
        caching = {"ETag": file.etag, "Cache-Control": "no-cache"}
        if _matches(headers.get("If-None-Match", ""), file.etag):
            return _for_method(method, Page(HTTPStatus.NOT_MODIFIED, caching))
        page = Page(HTTPStatus.OK, {"Content-Type": file.media_type, **caching}, file.body)
        return _for_method(method, page)


def _for_method(method: str, page: Page) -> Page:
    if method not in ("GET", "HEAD"):
        return Page(HTTPStatus.METHOD_NOT_ALLOWED, {"Allow": "GET, HEAD", "Content-Length": "0"})
    length = str(len(page.body))
    headers = {**page.headers, "Content-Length": length}
    if page.status is HTTPStatus.NOT_MODIFIED:
        headers = page.headers
    return Page(page.status, headers, page.body if method == "GET" else b"")


def _json_page(content: object) -> Page:
    headers = {"Content-Type": _JSON, "Cache-Control": "no-store"}
    return Page(HTTPStatus.OK, headers, json.dumps(content).encode())


def _matches(condition: str, tag: str) -> bool:
    """Return whether an ETag matches an ``If-None-Match`` (RFC 9110, section 13.1.2)."""
    tags = [part.strip().removeprefix("W/") for part in condition.split(",")]
    return "*" in tags or tag in tags


def _version() -> dict[str, object]:
    parts = dict(zip(("major", "minor", "patch"), PROTOCOL, strict=True))
    try:
        server = version("farsteer")
    except PackageNotFoundError:  # run from a source folder that is not installed
        server = "unknown"
    return {"protocol": parts, "server": server}
