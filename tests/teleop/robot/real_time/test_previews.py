"""Previews of hints across real processes: clients that ask much, and a localiser that hangs or dies."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop import clock
from teleop.robot.clients.preview_service import NO_ANSWER, OVERTAKEN
from tests.teleop.robot.clients.test_preview_service import HERE, SERVICE
from tests.teleop.robot.real_time.test_control_process import drive_until, robot, until
from tests.teleop.support import Peer, in_a_loop, peer

pytestmark = [pytest.mark.process, pytest.mark.slow]

FLOOD = 300


async def timed(client: Peer) -> tuple[str, float]:
    """Return the message of a preview, and the time that it took [s]."""
    begun = clock.monotonic()
    good, values = await client.ask(SERVICE, pose=HERE)
    assert good
    return values["message"], (clock.monotonic() - begun) / 1e9


async def scored(client: Peer) -> None:
    """Ask until there is a sweep to score."""
    async with asyncio.timeout(60.0):
        while not (await client.ask(SERVICE, pose=HERE))[1]["success"]:  # noqa: ASYNC110
            await asyncio.sleep(0.1)


@pytest.mark.long
@in_a_loop
async def test_client_that_asks_without_end_is_answered_each_time_and_holds_up_nobody(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        robot(office, office_cloud, cache) as served,
        peer(served.address.url) as client,
        peer(served.address.url) as driver,
    ):
        await scored(client)
        await driver.subscribe("/odom")
        await drive_until(driver, served, 0.6)
        first, messages = len(served.ticks), len(driver.messages("/odom"))
        for k in range(FLOOD):
            call = {"op": "call_service", "id": f"flood {k}", "service": SERVICE}
            await client.say(json.dumps({**call, "args": {"pose": HERE}}))
            if k % 2:
                await asyncio.sleep(0.02)
            if k % 10 == 0:
                await driver.joy(1.0)
        await client.until(lambda: all(client.answer(f"flood {k}") for k in range(FLOOD)))
        answers = [client.answer(f"flood {k}") for k in range(FLOOD)]
        found = [a["values"] for a in answers if a is not None]
        good = [values for values in found if values["success"]]
        bad = {values["message"] for values in found if not values["success"]}
        assert bad <= {OVERTAKEN, NO_ANSWER}
        ticks = served.ticks[first:]
        seconds = (ticks[-1][0] - ticks[0][0]) / 1e9
        assert 3 <= len(good) <= 10 * seconds + 2
        assert answers[-1] is not None
        assert answers[-1]["values"]["message"] != OVERTAKEN, "the newest has its turn"
        assert np.median(np.diff([now for now, _ in ticks])) < 30e6
        await driver.until(
            lambda: len(driver.messages("/odom")) > messages + len(ticks) // 2 - 5, "the estimates"
        )


@in_a_loop
async def test_hung_localiser_leaves_no_preview_without_an_answer_in_two_seconds(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with robot(office, office_cloud, cache) as served, peer(served.address.url) as client:
        await scored(client)
        os.kill(served.process.estimator.pid, signal.SIGSTOP)
        try:
            text, seconds = await timed(client)
            assert text == NO_ANSWER
            assert 1.0 < seconds < 2.0
            await drive_until(client, served, 0.6)
        finally:
            os.kill(served.process.estimator.pid, signal.SIGCONT)
        await scored(client)


@in_a_loop
async def test_preview_while_a_new_localiser_loads_its_map_is_answered_in_two_seconds(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with robot(office, office_cloud, cache) as served, peer(served.address.url) as client:
        await scored(client)
        killed = served.process.estimator
        os.kill(killed.pid, signal.SIGKILL)
        for _ in range(3):
            text, seconds = await timed(client)
            assert seconds < 2.0
            assert text in (NO_ANSWER, OVERTAKEN) or "sweep" in text
        await until(lambda: served.process.estimator is not killed)
        await scored(client)
        assert (await client.ask(SERVICE, pose=HERE))[1]["present"] == -1.0
