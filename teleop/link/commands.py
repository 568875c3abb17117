"""The command ``farsteer link``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

from localization.cli.terminal import say
from teleop.errors import SettingError


@dataclass(frozen=True)
class Link:
    """Say where the time between a robot and this machine goes, part by part of the way."""

    action: tyro.conf.Positional[Literal["report"]]
    """What to do: measure, and print a table."""
    url: tyro.conf.Positional[Annotated[str, tyro.conf.arg(metavar="ws://HOST:PORT")]] = (
        "ws://127.0.0.1:9090"
    )
    """Address of the robot."""
    seconds: float = 10.0
    """For how long to measure [s]."""
    token: str | None = None
    """Token of the robot, if it wants one."""

    def __call__(self) -> int:
        """Measure and print."""
        import asyncio

        from teleop import clock
        from teleop.link.report import measure
        from teleop.rosbridge.client.client import Client

        if not 1.0 <= self.seconds <= 3600.0:
            raise SettingError(f"seconds must be 1 to 3600, got {self.seconds:g}")

        async def run() -> list[str]:
            async with Client(self.url, reconnect=False, token=self.token) as client:
                return (await measure(client, self.seconds, clock.wall_seconds)).lines()

        say(*asyncio.run(run()))
        return 0
