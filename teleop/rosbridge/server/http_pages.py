"""What the server's port answers to plain HTTP: its version, its health, and files it offers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib.metadata import PackageNotFoundError, version
from typing import Final

PROTOCOL: Final = (2, 1, 0)
"""Version of the rosbridge protocol: that of rosbridge_suite 2.1.0, whose operations these are."""

OPEN_PAGES: Final = ("/version", "/healthz")
"""Pages that are shown without a token."""

_JSON: Final = "application/json"


@dataclass(frozen=True, slots=True)
class Page:
    """An answer."""

    status: HTTPStatus
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""


@dataclass(frozen=True, slots=True)
class _File:
    body: bytes
    kind: str
    tag: str


class HttpPages:
    """Pages by their paths."""

    def __init__(self, clients: Callable[[], int]) -> None:
        """Make the pages every server has; ``clients`` counts those connected."""
        self._clients = clients
        self._files: dict[str, _File] = {}

    def offer(self, path: str, body: bytes, kind: str) -> str:
        """Offer a file; return its SHA-256, which is its ETag too.

        Args:
            path: Where, ``/map.ply``.
            body: Its bytes; they are kept, so that all who ask get the same.
            kind: Its media type.
        """
        digest = hashlib.sha256(body).hexdigest()
        self._files[path] = _File(body, kind, f'"{digest}"')
        return digest

    def answer(self, method: str, target: str, headers: Mapping[str, str]) -> Page | None:
        """Return the page at a request's target; None if there is none."""
        path = target.partition("?")[0]
        if path == "/version":
            return _for(method, _page(_version()))
        if path == "/healthz":
            return _for(method, _page({"status": "ok", "clients": self._clients()}))
        file = self._files.get(path)
        if file is None:
            return None
        # A copy of yesterday may be shown only after asking whether it is still the one.
        caching = {"ETag": file.tag, "Cache-Control": "no-cache"}
        if _known(headers.get("If-None-Match", ""), file.tag):
            return _for(method, Page(HTTPStatus.NOT_MODIFIED, caching))
        page = Page(HTTPStatus.OK, {"Content-Type": file.kind, **caching}, file.body)
        return _for(method, page)


def _for(method: str, page: Page) -> Page:
    if method not in ("GET", "HEAD"):
        return Page(HTTPStatus.METHOD_NOT_ALLOWED, {"Allow": "GET, HEAD", "Content-Length": "0"})
    length = str(len(page.body))
    headers = {**page.headers, "Content-Length": length}
    if page.status is HTTPStatus.NOT_MODIFIED:
        headers = page.headers
    return Page(page.status, headers, page.body if method == "GET" else b"")


def _page(content: object) -> Page:
    headers = {"Content-Type": _JSON, "Cache-Control": "no-store"}
    return Page(HTTPStatus.OK, headers, json.dumps(content).encode())


def _known(condition: str, tag: str) -> bool:
    """Return whether a tag is among those of an ``If-None-Match`` (RFC 9110, section 13.1.2)."""
    tags = [part.strip().removeprefix("W/") for part in condition.split(",")]
    return "*" in tags or tag in tags


def _version() -> dict[str, object]:
    parts = dict(zip(("major", "minor", "patch"), PROTOCOL, strict=True))
    try:
        server = version("farsteer")
    except PackageNotFoundError:  # run from a folder that was never installed
        server = "unknown"
    return {"protocol": parts, "server": server}
