"""Check of a robot's address before it is named in a page's security headers."""

from __future__ import annotations

import re
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from teleop.errors import SettingError

_NAME: Final = re.compile(r"(?!-)[A-Za-z0-9_-]{1,63}(\.[A-Za-z0-9_-]{1,63})*\.?")
_PORTS: Final = {"ws": 80, "wss": 443}
"""Port of each scheme where the address has none."""


def robot_origin(address: str) -> str:
    """Return an address in the form ``ws://HOST:PORT``.

    Raises:
        SettingError: If it is not the address of a WebSocket; the message is one line.
    """
    wrong = SettingError(
        f"{address[:200]!r} is not a robot's address: ws://HOST:PORT, or wss://HOST:PORT with encryption"
    )
    try:
        parts = urlsplit(address)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        raise wrong from None
    plain = not (parts.username or parts.password or parts.query or parts.fragment)
    if parts.scheme not in _PORTS or not plain or parts.path not in ("", "/"):
        raise wrong
    if ":" in host:
        try:
            host = f"[{ip_address(host).compressed}]"
        except ValueError:
            raise wrong from None
    elif not _NAME.fullmatch(host):
        raise wrong
    if port == 0:
        raise wrong
    return f"{parts.scheme}://{host}:{port or _PORTS[parts.scheme]}"
