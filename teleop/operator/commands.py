"""The command ``farsteer operate``."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import tyro

from localization.cli.terminal import say
from teleop.operator.operate_config import OperateConfig


@dataclass(frozen=True)
class Operate:
    """Operate a robot: rerun shows the live cloud over the map, the keyboard drives.

    It reconnects by itself. Without a screen, --record writes the display to a file.
    """

    operator: tyro.conf.OmitArgPrefixes[OperateConfig] = field(default_factory=OperateConfig)
    """Robot, map and display."""

    def __call__(self) -> int:
        """Operate until q, Ctrl-C or the end of the duration."""
        import asyncio

        from teleop.operator.operate import run_operator
        from teleop.scene_clouds import scene_cloud_path

        config = self.operator
        if config.map is None:
            config = replace(config, map=scene_cloud_path("office"))
        asyncio.run(run_operator(config, say=lambda line: say(f"\r{line}\r")))
        return 0
