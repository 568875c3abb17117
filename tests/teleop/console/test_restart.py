"""What becomes of the page when the robot is started anew, when its server is away, and without WebGL."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import pytest
from playwright.async_api import Page

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.scene_clouds import scene_cloud_path
from tests.teleop.console.conftest import VIEWPORT, Meets, Pages, Visit
from tests.teleop.console.hands import drag_hint, hold_until, key, press, says, seen, until
from tests.teleop.console.paced_robot import PacedRobot, Proxy, paced_robot
from tests.teleop.support import in_a_loop, soon

pytestmark = [pytest.mark.process, pytest.mark.slow]

BACK = 1.0
"""Time within which the page connects again once the server is back [s]."""
SLACK = 1.0
"""For a machine with more to do than this [s]."""
RESULT = ".panel-hint-result"
NO_WEBGL = """
const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest);
};
"""


@asynccontextmanager
async def front() -> AsyncIterator[Proxy]:
    """A port that stays, whichever robot is behind it."""
    proxy = Proxy(0)
    async with await asyncio.start_server(proxy.serve, "127.0.0.1", 0) as listener:
        proxy.port = listener.sockets[0].getsockname()[1]
        yield proxy


@pytest.mark.long
@in_a_loop
async def test_new_run_clears_what_belonged_to_the_last_and_does_not_drive_on(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with AsyncExitStack() as last, front() as door:
        robot = await last.enter_async_context(paced_robot(office, office_cloud, cache))
        door.target = robot.proxy.port
        door.whole.set()
        robot.place()
        async with page_of(f"http://127.0.0.1:{door.port}/", viewport=VIEWPORT) as visit:
            page = visit.page
            await seen(page)
            await _hint(page, robot)
            await hold_until(page, key(page, "w"), lambda: robot.speed > 0.2, "that it drives")
            door.cut()
            await last.aclose()
            gone = re.compile("said nothing|connection is lost")
            await says(page, gone, within=".driving-status")

            async with paced_robot(office, office_cloud, cache) as next_robot:
                door.target = next_robot.proxy.port
                door.restore()
                await says(page, "what belonged to its last run is cleared", within=".page-right")
                assert await page.locator(RESULT).inner_text() == ""
                await page.keyboard.down("w")  # its repetition
                await says(page, re.compile("again"), within=".driving-status")
                assert not any(tick.moves for tick in next_robot.ticks)
                await page.keyboard.up("w")
                await hold_until(
                    page, key(page, "w"), lambda: next_robot.speed > 0.2, "that a new press drives"
                )
                await page.keyboard.up("w")


async def _hint(page: Page, robot: PacedRobot) -> None:
    """Give a hint, so that there is one to be cleared."""
    await page.keyboard.press("v")
    await press(page, "Show where it is")
    truth = robot.simulation.truth().map_from_base
    await drag_hint(page, float(truth.position[0]), float(truth.position[1]), truth.yaw)
    await page.keyboard.press("Enter")
    await says(page, re.compile("Accepted|Kept"), within=RESULT)


@pytest.mark.long
@in_a_loop
async def test_page_is_back_within_a_second_with_its_subscriptions_and_its_map(
    meets: Meets,
) -> None:
    async with meets() as (robot, page, visit):
        proxy = robot.proxy
        points = scene_cloud_path("office").stat().st_size
        assert proxy.passed < points  # the surfaces alone
        await page.evaluate("localStorage.setItem('farsteer.shown', JSON.stringify({map: true}))")
        await page.reload()
        await seen(page)
        await until(lambda: proxy.passed > points, "the points of the map")
        await asyncio.sleep(1.0)  # by then they are read and kept
        await hold_until(page, key(page, "w"), lambda: robot.speed > 0.2, "that it drives")
        assert await _time_to_return(visit, robot) < BACK + SLACK
        begun = len(robot.ticks)
        await page.keyboard.down("w")  # its repetition
        await says(page, "Press again to drive")
        await asyncio.sleep(1.0)
        assert not any(tick.moves for tick in robot.ticks[begun:])
        await page.keyboard.up("w")
        before = proxy.passed
        await page.reload()
        await seen(page)
        await asyncio.sleep(1.0)
        assert proxy.passed - before < points / 2


async def _time_to_return(visit: Visit, robot: PacedRobot) -> float:
    """Take the server away for a while; return the time from its return to the page's connection [s]."""
    loop = asyncio.get_running_loop()
    robot.proxy.cut()
    await says(visit.page, "Nothing received for")
    robot.proxy.drop()
    await says(visit.page, "connection", within=".page-top")  # as a notice, or as an alarm
    await asyncio.sleep(1.3)  # by then it tries again and again
    connected: asyncio.Future[float] = loop.create_future()

    def note(_socket: object) -> None:
        if not connected.done():
            connected.set_result(loop.time())

    visit.page.on("websocket", note)
    robot.proxy.restore()
    restored = loop.time()
    return await soon(connected) - restored


@in_a_loop
async def test_without_webgl_one_sentence_says_so_and_the_rest_works(meets: Meets) -> None:
    async with meets(placed=False, scripts=[NO_WEBGL]) as (robot, page, _visit):
        robot.place()
        await says(page, "WebGL is missing")
        assert await page.get_by_text("WebGL").count() == 1
        await says(page, "Knows where it is")
        await hold_until(page, key(page, "w"), lambda: robot.speed > 0.2, "that it drives")
        await page.keyboard.press("Escape")
        await page.keyboard.up("w")
        await says(page, "E-stop, pressed by you")
        await until(lambda: robot.speed < 0.01, "that it stands")
