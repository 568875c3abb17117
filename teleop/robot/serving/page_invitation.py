"""Text that ``farsteer serve`` prints of the console page: where it is, and how to open it on a tablet."""

from __future__ import annotations

import sys
from typing import Final

from teleop.console.lan.own_addresses import own_addresses
from teleop.console.lan.qr_code import qr_text
from teleop.console.page_files import MISSING
from teleop.robot.serving.address import Address
from teleop.robot.serving.lan_access import LanAccess

_EVERYWHERE: Final = ("0.0.0.0", "::", "")


def page_addresses(address: Address) -> list[str]:
    """Return the addresses of the console page, the one to prefer first."""
    hosts = [address.host]
    if address.host in _EVERYWHERE:
        hosts = own_addresses() or ["127.0.0.1"]
    return [_page_address(address, host) for host in hosts]


def local_page_address(address: Address) -> str:
    """Return the address of the console page for a browser on this machine."""
    return _page_address(address, "127.0.0.1" if address.host in _EVERYWHERE else address.host)


def _page_address(address: Address, host: str) -> str:
    scheme = "https" if address.encrypted else "http"
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{address.port}/"


def invitation(address: Address, access: LanAccess | None = None) -> str:
    """Return where the console page is; with ``--lan`` also its QR code.

    The token is printed to a terminal only: what is written to a file or a pipe may be kept as a log.

    Args:
        address: Where the robot is served.
        access: What was made for the network; None without ``--lan``.

    Raises:
        MissingLibraryError: If the library of QR codes is missing.
    """
    if not address.page:
        return f"note: {MISSING}"
    first, *others = page_addresses(address)
    if access is None:
        return f"open      {first} in a browser to see and drive it"
    secret = bool(access.link)
    shown = secret and sys.stdout.isatty()
    whole = f"{first}#token={access.link}" if shown else first
    lines = [f"open      {whole} on a tablet, phone or computer of this network"]
    if others:
        lines.append(f"          (also {', '.join(others)})")
    if (shown or not secret) and _can_draw():
        lines.append(qr_text(whole))
    if secret:
        lines.append(f"token     of this machine: {access.token_file}; keep it as you would a key")
    if access.fingerprint:
        lines += [
            "browsers  warn of the certificate, which this machine has made itself; accept it if they show",
            f"          SHA-256 {access.fingerprint}",
        ]
    return "\n".join(lines)


def _can_draw() -> bool:
    """Return whether standard output can show the blocks of a QR code."""
    try:
        "\u2588\u2580\u2584".encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
