"""Robots as ``farsteer serve`` serves them, in lockstep, with a file of tokens if a test wants one."""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.support import real_time

DRIVER, OTHER, ADMIN, VIEWER = (f"{name}-of-whom-nobody-knows" for name in "doav")
TOKENS = f"""
[tokens.driver]
role = "operate"
token = "{DRIVER}"
[tokens.other]
role = "operate"
token = "{OTHER}"
[tokens.boss]
role = "admin"
token = "{ADMIN}"
[tokens.viewer]
role = "view"
token = "{VIEWER}"
"""


def tokens(folder: Path) -> Path:
    path = folder / "tokens.toml"
    path.touch(mode=0o600)
    path.write_text(TOKENS)
    return path


def served(
    world: World, cloud: Cloud, cache: Path, config: ServeConfig, **options: Any
) -> AbstractAsyncContextManager[Address]:
    """A robot in lockstep."""
    return real_time(world, cloud, cache, replace(config, port=0, lockstep=True), **options)


class Serving(Protocol):
    """Serves robots in the office in lockstep."""

    def __call__(self, config: ServeConfig, **options: Any) -> AbstractAsyncContextManager[Address]:
        """Serve a robot; options are those of ``serve``."""
