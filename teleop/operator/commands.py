"""The command ``farsteer operate``."""

from __future__ import annotations

from dataclasses import dataclass, field

import tyro

from localization.cli.terminal import say
from teleop.operator.operate_config import OperateConfig


@dataclass(frozen=True)
class Operate:
    """Operate a robot: rerun shows the live cloud over the map; keyboard or gamepad drive.

    It reconnects by itself. Without a screen, --record writes the display to a file. To see and drive a
    robot without all this, open the page that `farsteer serve` names in a browser.
    """

    operator: tyro.conf.OmitArgPrefixes[OperateConfig] = field(default_factory=OperateConfig)
    """Robot, map and display."""

    def __call__(self) -> int:
        """Operate until the user, Ctrl-C or the end of the duration; 1 if a hint was not taken."""
        import asyncio

        from teleop.operator.operate import run_operator

        return asyncio.run(run_operator(self.operator, say=say))
