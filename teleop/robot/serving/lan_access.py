"""Settings of ``farsteer serve --lan``: who may connect from the network, and how connections are encrypted."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from localization.extras import require
from teleop import clock
from teleop.console.lan.certificate import ensure_certificate
from teleop.console.lan.own_addresses import own_addresses, own_names
from teleop.console.lan.state_files import private_folder, state_folder
from teleop.console.lan.token_book import TokenBook
from teleop.robot.serving.serve_config import ServeConfig

_LINK: Final = "link of the terminal"
"""Name of the link that is printed: each device that opens it drives with a token of its own."""


@dataclass(frozen=True, slots=True)
class LanAccess:
    """What was made for the network; what the user gave instead is not in here."""

    link: str = field(default="", repr=False)
    """Token of the link that is printed, another one at each start; empty if the user gave a file of tokens."""
    token_file: Path | None = None
    """File of this machine's own token."""
    certificate: Path | None = None
    """Certificate that clients can be configured to trust; None if the user gave one."""
    fingerprint: str = ""
    """SHA-256 of the certificate, in pairs of digits; empty if the user gave one."""


def lan_access(config: ServeConfig, folder: Path | None = None) -> tuple[ServeConfig, LanAccess]:
    """Return settings with token, certificate and origins, as far as the user did not give them.

    Args:
        config: Settings with ``lan``.
        folder: Folder in which token and certificate are kept; that of the user by default.

    Raises:
        MissingLibraryError: If a library is missing.
        SettingError: If what is kept cannot be read or written.
    """
    require("segno", "--lan")
    folder = folder or state_folder() / "lan"
    private_folder(folder)
    access = LanAccess()
    if config.tokens is None:
        file, listed = folder / "token", folder / "tokens.toml"
        book, now = TokenBook(listed), datetime.fromtimestamp(clock.unix_seconds(), UTC)
        book.ensure_machine(file, now)
        if _LINK in [token.name for token in book.tokens(now)]:
            book.remove(_LINK, now)
        _, link = book.add(_LINK, "operate", now, None, link=True)
        access = replace(access, link=link, token_file=file)
        config = replace(config, tokens=listed)
    addresses, names = own_addresses(), own_names()
    if config.host not in (None, "0.0.0.0", "::"):
        addresses = [config.listening_host]
    if config.tls_cert is None:
        crt, key = folder / "robot.crt", folder / "robot.key"
        fingerprint = ensure_certificate(crt, key, [*addresses, *names])
        access = replace(access, certificate=crt, fingerprint=fingerprint)
        config = replace(config, tls_cert=crt, tls_key=key)
    if config.port:
        # A page's own address is accepted if it is one; these names are of this machine only.
        own = (f"https://{name}:{config.port}" for name in names)
        config = replace(config, origins=(*config.origins, *own))
    return config, access
