"""Which web pages may connect: any page that a browser on this machine shows could try."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from teleop.rosbridge.errors import ServerError

FILES: Final = "file://"
"""Origin of pages that were opened as files, and of programs that are pages, as Foxglove's."""

LOOPBACK: Final = ("localhost", "127.0.0.1", "::1")
"""What this machine alone can reach."""


@dataclass(frozen=True, slots=True)
class Origins:
    """Pages of this machine, of the server's own address, and those named."""

    host: str
    """What the server listens at."""

    named: frozenset[str] = frozenset()
    """Further origins, as browsers write them: ``https://x.org``."""

    @classmethod
    def of(cls, host: str, named: Collection[str]) -> Origins:
        """Return origins that have been checked.

        Raises:
            ServerError: If one is not as browsers write them, and would never be met.
        """
        for origin in named:
            plain = origin.isascii() and origin == origin.lower()
            parts = origin.split("/")
            whole = len(parts) == 3 and parts[0].endswith(":") and not parts[1] and _host(origin)
            if not (plain and whole) and origin != FILES:
                raise ServerError(f"{origin!r} is no origin; one is https://lab.example")
        return cls(host, frozenset(named))

    def allow(self, origin: str, host: str) -> bool:
        """Return whether a page of ``origin`` may connect, having asked for ``host``.

        A host name proves nothing, as its owner can point it at any machine; an address does.
        """
        if origin in self.named:
            return True
        if origin == host and origin not in ("", "null"):
            return True  # a program such as jrosbridge: no browser leaves the scheme out
        page, asked = _host(origin), _host(f"//{host}")
        if page is None:
            return False
        with suppress(ValueError):
            return page in (*LOOPBACK, self.host, str(ip_address(asked or "")))
        return page in (*LOOPBACK, self.host)


def _host(url: str) -> str | None:
    with suppress(ValueError):
        return urlsplit(url).hostname
    return None
