"""A robot that ``farsteer serve --camera`` serves, in real time and in lockstep."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from localization.maps.cloud import Cloud
from robot_sim import World
from robot_sim.errors import CameraError
from teleop.robot.serve import serve
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.support import in_a_loop, peer, soon, stamp_of

JPEG = "/camera/rgb/image_rect_color/compressed"


@asynccontextmanager
async def seeing(
    world: World, cloud: Cloud, cache: Path, *, lockstep: bool
) -> AsyncIterator[Address]:
    """Serve a robot with a small camera."""
    ready: asyncio.Future[Address] = asyncio.get_running_loop().create_future()
    stop = asyncio.Event()
    config = ServeConfig(port=0, lockstep=lockstep, camera="small", lost=True)
    serving = asyncio.create_task(
        serve(world, cloud, config, cache=cache, ready=ready.set_result, stop=stop)
    )
    try:
        first: set[asyncio.Future[object]] = {ready, serving}  # type: ignore[arg-type]
        await asyncio.wait(first, return_when=asyncio.FIRST_COMPLETED)
        yield ready.result() if ready.done() else serving.result()  # type: ignore[misc]
    finally:
        stop.set()
        await serving


@pytest.mark.slow
@in_a_loop
async def test_answer_of_a_step_is_behind_the_pictures_of_its_ticks(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        seeing(office, office_cloud, cache, lockstep=True) as address,
        peer(address.url) as client,
    ):
        await client.subscribe(JPEG, "/tf_static", compression="cbor")
        await client.step(10)
        stamps = [stamp_of(message["header"]["stamp"]) for message in client.messages(JPEG)]
        assert stamps == [80_000_000, 140_000_000, 200_000_000]
        frames = {t["child_frame_id"] for t in client.last("/tf_static")["transforms"]}
        assert {"camera_link", client.last(JPEG)["header"]["frame_id"]} <= frames


@pytest.mark.process
@pytest.mark.slow
@in_a_loop
async def test_pictures_come_in_real_time_and_are_young(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        seeing(office, office_cloud, cache, lockstep=False) as address,
        peer(address.url) as client,
    ):
        await client.subscribe("/clock", JPEG, compression="cbor")
        ages: list[int] = []
        while len(ages) < 10:
            await client.until(lambda: len(client.messages(JPEG)) > len(ages))
            now = stamp_of(client.last("/clock")["clock"])
            ages.append(now - stamp_of(client.last(JPEG)["header"]["stamp"]))
        assert Image.open(BytesIO(client.last(JPEG)["data"])).size == (320, 240)
        # Drawn, encoded and sent; on a loaded machine later.
        assert 0 <= np.median(ages) < 1_000_000_000


@in_a_loop
async def test_unknown_camera_is_refused_with_the_names_of_those_there_are(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    for lockstep in (True, False):
        config = ServeConfig(port=0, lockstep=lockstep, camera="kinetc")
        with pytest.raises(CameraError, match=r"kinetc.*kinect"):
            await soon(serve(office, office_cloud, config, cache=cache))
