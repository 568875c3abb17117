"""The page as a wall of screens: pictures that meet to the pixel, the same moment on each, and nothing that drives."""

from __future__ import annotations

import asyncio
import contextlib
import io
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from statistics import median

import numpy as np
import pytest
from PIL import Image
from playwright.async_api import Page

from tests.teleop.console.conftest import Meets, Pages, Served, page_address
from tests.teleop.console.hands import seen, until
from tests.teleop.console.test_camera_and_steps import robot_with_camera, streams
from tests.teleop.support import PATIENCE, in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

THREE = "?screen=0,1,1.2,90,2,1.5&screen=1,0,1.2,0,2,1.5&screen=0,-1,1.2,-90,2,1.5&eye=0.3,0.2,1.5"
"""Screens to the left, ahead and to the right of somebody who stands aside of their middle."""
SIZE = {"width": 1200, "height": 300}
BUILDING = "try { localStorage.setItem('farsteer.shown', JSON.stringify({ cloud: false, scan: false, oldSweeps: false })); } catch {}"
FRAME = 1000.0 / 60.0
"""Of a screen [ms]."""
WAY = 0.06
"""What the slower of two links takes, each way [s]."""


@in_a_loop
async def test_pictures_of_three_screens_meet_to_the_pixel_and_keys_drive_nothing(
    meets: Meets,
) -> None:
    async with meets(query=THREE, scripts=[BUILDING], viewport=SIZE) as (robot, page, visit):
        await _shown(page)
        assert await page.get_by_role("button", name="Emergency stop").count() == 0
        await page.keyboard.down("w")
        await asyncio.sleep(1.0)
        await page.keyboard.up("w")
        assert not any(tick.moves for tick in robot.ticks)
        # On a loaded machine the building appears bit by bit, and a slanted line alone says nothing.
        await until(lambda: _meet(page), "that the pictures meet at their edges")
        assert visit.errors == []


async def _meet(page: Page) -> bool:
    """Return whether something is seen, and the pictures differ least at their edges where none is moved."""
    picture = np.asarray(Image.open(io.BytesIO(await page.screenshot())).convert("RGB"), float)
    apart = [
        {shift: _difference(picture, edge, shift) for shift in range(-5, 6)} for edge in (400, 800)
    ]
    fit = all(min(at, key=at.__getitem__) == 0 and at[0] < 2.0 for at in apart)
    return picture.std() > 10.0 and fit


def _difference(picture: np.ndarray, edge: int, shift: int) -> float:
    """Return how different the columns at both sides of an edge are, one of them moved up by some pixels."""
    before, after = picture[10:-10, edge - 1], np.roll(picture[:, edge], -shift, axis=0)[10:-10]
    return float(np.abs(before - after).mean())


async def _shown(page: Page) -> float:
    """Wait for a picture; return by how much its stamp is ahead of the machine's clock [ms]."""
    async with asyncio.timeout(60.0):
        while True:
            found = await page.evaluate("farsteerFigures().wall")
            if found and found.get("stamp"):
                return 1000.0 * float(found["stamp"]) - float(found["at"])
            await asyncio.sleep(0.05)


@pytest.mark.long
@in_a_loop
async def test_pages_on_links_of_different_delay_show_the_same_stamp_within_a_frame(
    page_of: Pages, served: Served
) -> None:
    async with served(lockstep=False) as robot, _slow(robot.port) as port:
        near, far = page_address(robot), f"http://127.0.0.1:{port}/"
        query, size = "?screen=1,0,1.2,0,2,1.5", {"width": 300, "height": 200}
        async with (
            page_of(f"{near}{query}", scripts=[BUILDING], viewport=size) as one,
            page_of(f"{far}{query}", scripts=[BUILDING], viewport=size) as other,
        ):
            await seen(one.page)
            await seen(other.page)
            apart: deque[float] = deque([60.0] * 20, maxlen=20)
            # A machine that is too busy to keep the simulation's pace makes its clock jump; without it they stay together.
            async with asyncio.timeout(PATIENCE):
                while abs(median(apart)) >= FRAME:
                    await asyncio.sleep(0.2)
                    apart.append(await _shown(one.page) - await _shown(other.page))


@pytest.mark.long
@in_a_loop
async def test_wall_fetches_no_picture_of_a_camera_since_it_shows_none(
    page_of: Pages, served: Served, tmp_path: Path
) -> None:
    async with robot_with_camera(served, tmp_path) as robot:
        address, size = page_address(robot), {"width": 300, "height": 200}
        wall_address = f"{address}?screen=1,0,1.2,0,2,1.5"
        async with (
            page_of(wall_address, scripts=[BUILDING], viewport=size) as wall,
            page_of(address, viewport=size) as console,
        ):
            await seen(wall.page)
            await console.page.get_by_alt_text("Camera: p3at").wait_for()
            assert len(streams(console)) > 0
            assert streams(wall) == []
            assert await wall.page.get_by_role("button").count() == 0


@asynccontextmanager
async def _slow(target: int) -> AsyncIterator[int]:
    """Pass connections on to a port, each way by ``WAY`` later; yield the port to connect to."""
    loop, sinks = asyncio.get_running_loop(), list[asyncio.StreamWriter]()

    async def passed(source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError):
            while piece := await source.read(65_536):
                loop.call_later(WAY, sink.write, piece)
        loop.call_later(WAY, sink.close)

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, back = await asyncio.open_connection("127.0.0.1", target)
        sinks.extend((back, writer))
        await asyncio.gather(passed(reader, back), passed(there, writer))

    server = await asyncio.start_server(connected, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        for sink in sinks:
            sink.transport.abort()
        await asyncio.sleep(2 * WAY)
