"""Previews of hints across real processes: a localiser that dies."""

from __future__ import annotations

import asyncio
import os
import signal
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.robot.clients.preview_service import NO_ANSWER, OVERTAKEN
from tests.teleop.robot.clients.test_preview_service import HERE, SERVICE
from tests.teleop.robot.real_time.test_control_process import robot, until
from tests.teleop.support import Peer, in_a_loop, peer

pytestmark = [pytest.mark.process, pytest.mark.slow]


async def answered(client: Peer) -> str:
    """Return the message of a preview; the queue's own tests say in which time it comes."""
    good, values = await client.ask(SERVICE, pose=HERE)
    assert good
    return str(values["message"])


async def scored(client: Peer) -> None:
    """Ask until there is a sweep to score."""
    async with asyncio.timeout(60.0):
        while not (await client.ask(SERVICE, pose=HERE))[1]["success"]:  # noqa: ASYNC110
            await asyncio.sleep(0.1)


@pytest.mark.long
@in_a_loop
async def test_preview_while_a_new_localiser_loads_its_map_is_answered(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with robot(office, office_cloud, cache) as served, peer(served.address.url) as client:
        await scored(client)
        killed = served.process.estimator
        os.kill(killed.pid, signal.SIGKILL)
        for _ in range(3):
            text = await answered(client)
            assert text in (NO_ANSWER, OVERTAKEN) or "sweep" in text
        await until(lambda: served.process.estimator is not killed)
        await scored(client)
        assert (await client.ask(SERVICE, pose=HERE))[1]["present"] == -1.0
