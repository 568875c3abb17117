"""The console page in Debian's Firefox: open, see, drive, stop, load again."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.console.firefox import Firefox, firefox
from tests.teleop.console.hands import SEEN, until
from tests.teleop.console.paced_robot import paced_robot
from tests.teleop.support import in_a_loop, soon

pytestmark = [pytest.mark.process, pytest.mark.slow]

DRAWN = "window.farsteerFigures().frameTimes.length"
STATUS = "document.querySelector('.driving-status').innerText"


@pytest.mark.long
@in_a_loop
async def test_firefox_sees_drives_stops_and_loads_again(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    async with paced_robot(office, office_cloud, cache) as robot, firefox(tmp_path) as browser:
        robot.place()
        await browser.open(robot.page)
        await browser.says("Knows where it is")
        await browser.until(SEEN)
        await browser.until(DRAWN)
        await browser.until(f"{STATUS}.includes('Ready')")

        await _hold_until(browser, lambda: robot.speed > 0.2)
        await browser.says("You drive.")
        await browser.key("Escape", down=True)
        await until(lambda: not robot.ticks[-1].moves, "that it stands")
        await browser.key("Escape", down=False)
        await browser.key("ArrowUp", down=False)
        await browser.says("E-stop, pressed by you")
        await browser.click("button", "Release e-stop")
        await browser.says("Are people and things clear")
        await browser.click("button", "Release it")
        await browser.until(f"{STATUS}.includes('Ready')")

        await browser.reload()
        await browser.until(SEEN)
        await browser.until(f"{STATUS}.includes('Ready')")
        assert not robot.ticks[-1].moves


async def _hold_until(browser: Firefox, true: Callable[[], bool]) -> None:
    """Hold a key; let go and press again when the page asks for that, as it does where it was too busy."""
    await browser.key("ArrowUp", down=True)

    async def driven() -> None:
        while not true():
            await asyncio.sleep(0.1)
            if "again" in await browser.evaluate(STATUS):
                await browser.key("ArrowUp", down=False)
                await asyncio.sleep(0.3)
                await browser.key("ArrowUp", down=True)
                await asyncio.sleep(0.3)

    await soon(driven())
