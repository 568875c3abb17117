"""The command ``farsteer link``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from localization.cli.terminal import say
from teleop.errors import SettingError


@dataclass(frozen=True)
class Link:
    """Say where the time between a robot and this machine goes, part by part of the way."""

    action: tyro.conf.Positional[Literal["report"]]
    """What to do: measure, and print a table."""
    url: tyro.conf.Positional[Annotated[str, tyro.conf.arg(metavar="ws[s]://HOST:PORT")]] = (
        "ws://127.0.0.1:9090"
    )
    """Address of the robot."""
    seconds: float = 10.0
    """For how long to measure [s]."""
    token: Path | None = None
    """File with the token to send, on a line of its own."""
    ca: Path | None = None
    """Certificate to trust at a wss:// robot, if this machine does not trust it already (PEM)."""

    def __call__(self) -> int:
        """Measure and print."""
        import asyncio

        from teleop import clock
        from teleop.link.report import measure
        from teleop.rosbridge.client.client import Client
        from teleop.secret_files import read_secret, trust

        if not 1.0 <= self.seconds <= 3600.0:
            raise SettingError(f"seconds must be 1 to 3600, got {self.seconds:g}")

        async def run() -> list[str]:
            token = read_secret(self.token, "token")
            tls = trust(self.ca)
            async with Client(self.url, reconnect=False, token=token, tls=tls) as client:
                return (await measure(client, self.seconds, clock.wall_seconds)).lines()

        say(*asyncio.run(run()))
        return 0
