"""Robots as ``farsteer serve`` serves them, in lockstep, with a file of tokens if a test wants one, and their clients."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.ros_types import registry
from teleop.rosbridge import Client
from tests.teleop.support import Peer, Rig, peer, real_time

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


@asynccontextmanager
async def meeting(
    robot: AbstractAsyncContextManager[Rig], clients: int
) -> AsyncIterator[tuple[Rig, list[Peer]]]:
    """Have some clients meet at a robot, in the order of their numbers."""
    async with AsyncExitStack() as stack:
        rig = await stack.enter_async_context(robot)
        peers = [await stack.enter_async_context(peer(rig.server.url)) for _ in range(clients)]
        yield rig, peers


@asynccontextmanager
async def signed_in(
    serving: Callable[[ServeConfig], AbstractAsyncContextManager[Address]],
    folder: Path,
    *bearers: str,
    **settings: Any,
) -> AsyncIterator[tuple[Address, list[Client]]]:
    """Serve a robot with its tokens and its audit log in a folder, and connect who bears some of these."""
    config = ServeConfig(tokens=tokens(folder), audit=folder / "audit.jsonl", **settings)
    async with AsyncExitStack() as stack:
        server = await stack.enter_async_context(serving(config))
        clients = [Client(server.url, token=token, registry=registry()) for token in bearers]
        yield server, [await stack.enter_async_context(client) for client in clients]


def audited(folder: Path) -> list[dict[str, Any]]:
    """Return the lines of the audit log in a folder."""
    return [json.loads(line) for line in (folder / "audit.jsonl").read_text().splitlines()]
