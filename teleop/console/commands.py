"""The commands ``farsteer console`` and ``farsteer tokens``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import tyro

from localization.cli.terminal import say
from teleop.errors import SettingError


@dataclass(frozen=True)
class Console:
    """Serve the console page on this machine, for a robot that does not serve it itself.

    Any rosbridge server will do. A robot of `farsteer serve` has the page at its own address.
    """

    url: tyro.conf.Positional[Annotated[str, tyro.conf.arg(metavar="ws://HOST:PORT")]]
    """Address of the robot's rosbridge server."""
    port: int = 9080
    """Port to listen on, on 127.0.0.1; 0 takes a free one."""
    open: bool = False
    """Open the page in a browser."""

    def __call__(self) -> int:
        """Serve until Ctrl-C."""
        from teleop.console.browser import NO_BROWSER, open_in_browser
        from teleop.console.console_server import ConsoleServer
        from teleop.console.page_files import MISSING
        from teleop.console.robot_address import robot_origin

        if not 0 <= self.port <= 65535:
            raise SettingError(f"port must be 0 to 65535, got {self.port}")
        robot = robot_origin(self.url)
        with ConsoleServer(robot, self.port) as server:
            if not server.built:
                raise SettingError(MISSING)
            say(
                f"open      {server.url} in a browser to see and drive the robot at {robot}",
                "Ctrl-C ends.",
            )
            if self.open and not open_in_browser(server.url):
                say(NO_BROWSER)
            try:
                server.serve_forever()
            except KeyboardInterrupt:
                say("\nended")
        return 0


@dataclass(frozen=True)
class Tokens:
    """List the tokens of the devices and links of a robot that is served with --lan, or revoke one.

    A running robot goes by a change within two seconds, and disconnects the bearers of a revoked token.
    """

    revoke: str | None = None
    """Name of the token that ends now."""

    def __call__(self) -> int:
        """Revoke, and list what is left."""
        from datetime import UTC, datetime

        from teleop import clock
        from teleop.console.lan.state_files import state_folder
        from teleop.console.lan.token_book import TokenBook

        book = TokenBook(state_folder() / "lan" / "tokens.toml")
        now = datetime.fromtimestamp(clock.unix_seconds(), UTC)
        if not book.kept:
            raise SettingError(f"there is no list in {book.file}: farsteer serve --lan makes it")
        if self.revoke is not None:
            book.remove(self.revoke, now)
        for token in book.tokens(now):
            end = f"until {token.until:%Y-%m-%d %H:%M} UTC" if token.until else "no end"
            say(f"{token.name:32} {token.role:8} {'link' if token.link else 'device':8} {end}")
        return 0
