"""Files of the built console page, and the security headers that they are served with."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Final

from teleop.rosbridge.server.http_pages import HttpPages

START: Final = "/"
"""Path of the page itself; a WebSocket upgrade there is the robot's rosbridge."""
FOLDER: Final = "/console/"
"""Folder of all other files of the page."""
CONFIG: Final = f"{FOLDER}config.json"
"""Path of the file that names the robot."""
MISSING: Final = (
    "the console page is not built: `make env` in a clone builds it, or `tools/build-console`"
)
"""What to do where the package has no built page."""

_TYPES: Final[Mapping[str, str]] = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".map": "application/json",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
}
"""Media types by suffix; files with other suffixes are not served."""
_PACKED: Final = (".png", ".woff2")
"""Suffixes of files that are compressed already."""


def built_page() -> Traversable | None:
    """Return the folder of the built page; None if it has not been built."""
    folder = files("teleop.console").joinpath("page", "dist")
    return folder if folder.joinpath("index.html").is_file() else None


def offer_page(
    pages: HttpPages,
    *,
    robot: str = "",
    encrypted: bool = False,
    page: Traversable | None = None,
) -> bool:
    """Offer the page's files, which require no token, and return whether it is built.

    If it is not, ``/`` is a line of text that says how to build it.

    Args:
        pages: Where the files are offered.
        robot: Address of the robot, ``ws://HOST:PORT``; empty for the server that the page is loaded from.
        encrypted: Whether the page is loaded over TLS.
        page: Folder of the built page; that of the package by default.
    """
    page = page or built_page()

    def headers(host: str) -> dict[str, str]:
        return security_headers(connects_to(robot, host, encrypted=encrypted))

    if page is None:
        plain = _TYPES[".txt"]
        pages.add_file(START, f"{MISSING}\n".encode(), plain, public=True, headers=headers)
        return False
    config = json.dumps({"robot": robot, "version": _version()}).encode()
    for path, suffix, body in (*_files(page), (CONFIG, ".json", config)):
        pages.add_file(
            path,
            body,
            _TYPES[suffix],
            public=True,
            compress=suffix not in _PACKED,
            headers=headers,
        )
    return True


def _files(page: Traversable) -> Iterator[tuple[str, str, bytes]]:
    """Yield path, suffix and content of each file; of files in folders below, too."""
    for file, name in _below(page, ""):
        suffix = f".{name.rpartition('.')[2]}"
        if suffix in _TYPES:
            path = START if name == "index.html" else f"{FOLDER}{name}"
            yield path, suffix, file.read_bytes()


def _below(folder: Traversable, prefix: str) -> Iterator[tuple[Traversable, str]]:
    for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
        if entry.is_dir():
            yield from _below(entry, f"{prefix}{entry.name}/")
        elif not entry.name.startswith("."):
            yield entry, f"{prefix}{entry.name}"


def connects_to(robot: str, host: str, *, encrypted: bool) -> str:
    """Return the sources that a page may connect to, for ``connect-src``.

    The page's own server is named as a WebSocket too: not every browser includes those in ``'self'``.

    Args:
        robot: Address of the robot; empty for the page's own server.
        host: Host and port at which the page is requested; empty if unknown.
        encrypted: Whether the page is loaded over TLS.
    """
    if robot:
        # The map is fetched over HTTP, on the port of the WebSocket.
        return f"'self' {robot} {robot.replace('ws', 'http', 1)}"
    return f"'self' {'wss' if encrypted else 'ws'}://{host}" if host else "'self'"


def security_headers(sources: str) -> dict[str, str]:
    """Return the security headers of the page.

    Args:
        sources: Sources that the page may connect to.
    """
    policy = (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data: blob:",
        "manifest-src 'self'",
        f"connect-src {sources}",
        "worker-src 'self'",
        "frame-ancestors 'none'",
        "base-uri 'none'",
        "form-action 'none'",
    )
    return {
        "Content-Security-Policy": "; ".join(policy),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Permissions-Policy": "gamepad=(self)",
    }


def _version() -> str:
    try:
        return version("farsteer")
    except PackageNotFoundError:  # run from a source folder that is not installed
        return "unknown"
