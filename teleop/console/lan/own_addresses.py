"""Addresses and names under which others in the network reach this machine."""

from __future__ import annotations

import socket
import struct
from contextlib import closing, suppress
from ipaddress import IPv4Address
from typing import Final

try:
    import fcntl
except ImportError:  # not a POSIX system
    fcntl = None  # type: ignore[assignment]

_SIOCGIFADDR: Final = 0x8915
"""Request for the IPv4 address of an interface (linux/sockios.h)."""
_ELSEWHERE: Final = ("192.0.2.1", 9)
"""An address of no network (RFC 5737), to find the interface that leads outside; nothing is sent to it."""


def own_addresses() -> list[str]:
    """Return this machine's IPv4 addresses without loopback: first the one that leads outside."""
    found = [address for address in (_outside(), *_of_interfaces()) if address]
    return [a for a in dict.fromkeys(found) if not IPv4Address(a).is_loopback]


def own_names() -> list[str]:
    """Return the names that others may know this machine by: its own, and that of multicast DNS."""
    name = socket.gethostname().partition(".")[0].lower()
    plain = name.replace("-", "a").isalnum() and name.isascii() and name != "localhost"
    return [name, f"{name}.local"] if plain else []


def _outside() -> str | None:
    with (
        suppress(OSError),
        closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe,
    ):
        probe.connect(_ELSEWHERE)
        address: str = probe.getsockname()[0]
        return address
    return None


def _of_interfaces() -> list[str]:
    found: list[str] = []
    if fcntl is None:
        return found
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        for _, name in socket.if_nameindex():
            # An interface may have no IPv4 address.
            with suppress(OSError):
                answer = fcntl.ioctl(
                    probe.fileno(), _SIOCGIFADDR, struct.pack("256s", name.encode()[:15])
                )
                found.append(socket.inet_ntoa(answer[20:24]))
    return found
