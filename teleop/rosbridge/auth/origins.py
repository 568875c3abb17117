"""Origin check of web pages: any page that a browser on this machine shows could connect."""

from __future__ import annotations

import socket
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from teleop.rosbridge.errors import ServerError

FILES: Final = "file://"
"""Origin of pages opened as files, and of programs made of pages such as Foxglove."""

LOOPBACK: Final = ("localhost", "127.0.0.1", "::1")
"""Addresses that only this machine can reach."""


@dataclass(frozen=True, slots=True)
class Origins:
    """Accepted origins: this machine, the server's own address, and those listed."""

    host: str
    """Address that the server listens on."""

    named: frozenset[str] = frozenset()
    """Further origins in the form of browsers, ``https://x.org``."""

    @classmethod
    def of(cls, host: str, named: Collection[str]) -> Origins:
        """Return the accepted origins after validation.

        Raises:
            ServerError: If one does not have the form of browsers, and so would never match.
        """
        for origin in named:
            plain = origin.isascii() and origin == origin.lower()
            parts = origin.split("/")
            whole = len(parts) == 3 and parts[0].endswith(":") and not parts[1] and _host(origin)
            if not (plain and whole) and origin != FILES:
                raise ServerError(f"{origin!r} is not a valid origin such as https://lab.example")
        return cls(host, frozenset(named))

    def allow(self, origin: str, host: str) -> bool:
        """Return whether a page of ``origin`` may connect by the ``Host`` header ``host``.

        A host name is not sufficient, as its owner can point it at any machine; an address is.
        """
        if origin in self.named:
            return True
        if origin == host and origin not in ("", "null"):
            return True  # a program such as jrosbridge: no browser omits the scheme
        page, requested = _host(origin), _host(f"//{host}")
        if page is None:
            return False
        with suppress(ValueError):
            return page in (*LOOPBACK, self.host, str(ip_address(requested or "")))
        return page in (*LOOPBACK, self.host)

    def allow_host(self, host: str) -> bool:
        """Return whether a page may be requested by a ``Host`` header.

        A foreign page can let its own name point to this machine, and then reads from it as from
        its own origin, but it cannot change the name that the browser sends. Machines in a network
        have names that only others know, so it matters where only this machine listens.
        """
        if self.host not in LOOPBACK or not host:
            return True
        name = _host(f"//{host}") or ""
        with suppress(ValueError):
            return name in LOOPBACK or ip_address(name).is_loopback
        return name in LOOPBACK or any(_host(origin) == name for origin in self.named)

    def names_this_machine(self, host: str) -> bool:
        """Return whether a ``Host`` header certainly names this machine, wherever it listens.

        An address does, since no page can have its name point to it; of names only this machine's own, the one
        that is listened on, and those listed. Programs may leave the header out.
        """
        name = _host(f"//{host}") or ""
        with suppress(ValueError):
            ip_address(name)
            return self.allow_host(host)
        own = (*LOOPBACK, self.host, socket.gethostname().lower())
        named = any(_host(origin) == name for origin in self.named)
        return not host or named or (name in own and self.allow_host(host))


def _host(url: str) -> str | None:
    with suppress(ValueError):
        return urlsplit(url).hostname
    return None
