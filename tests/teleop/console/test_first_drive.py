"""The guided first drive in real browsers: each task is ticked because the robot did it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.console.conftest import Meets
from tests.teleop.console.firefox import firefox
from tests.teleop.console.hands import until
from tests.teleop.console.paced_robot import PacedRobot, paced_robot
from tests.teleop.support import in_a_loop, soon

pytestmark = [pytest.mark.process, pytest.mark.slow, pytest.mark.long]

DONE = "document.querySelectorAll('.guide li[data-done=true]').length"
SAID = "document.querySelector('.guide')?.innerText ?? ''"
READY = "document.querySelector('.driving-status')?.innerText ?? ''"

Evaluate = Callable[[str], Awaitable[Any]]
Key = Callable[[str, bool], Awaitable[object]]


async def _until(evaluate: Evaluate, expression: str) -> None:
    await until(lambda: evaluate(expression), expression)


async def _hold_until_done(
    evaluate: Evaluate, key: Key, names: tuple[str, ...], count: int
) -> None:
    """Hold keys until so many tasks are ticked; press again when the page asks for that, as where it was too busy."""

    async def done() -> None:
        while await evaluate(DONE) < count:
            for name in names:
                await key(name, True)
            for _ in range(10):
                await asyncio.sleep(0.1)
                if await evaluate(DONE) >= count or "again" in await evaluate(READY):
                    break
            if await evaluate(DONE) < count:
                for name in names:
                    await key(name, False)
                await asyncio.sleep(0.3)

    await soon(done())


async def _walk(robot: PacedRobot, evaluate: Evaluate, key: Key) -> None:
    """Do what the guide asks for, and nothing else."""
    robot.place()
    await _until(evaluate, f"({SAID}).includes('Hold W')")
    await _until(evaluate, f"({READY}).includes('Ready')")
    assert await evaluate(DONE) == 0
    await _hold_until_done(evaluate, key, ("w",), 1)
    await _hold_until_done(evaluate, key, ("w", "a"), 2)
    assert robot.speed > 0.05
    for name in ("w", "a"):
        await key(name, False)
    await _until(evaluate, f"{DONE} === 3")
    assert robot.speed < 0.1
    await key("Escape", True)
    await key("Escape", False)
    await _until(evaluate, f"{DONE} === 4")
    await _until(
        evaluate, f"({SAID}).includes('--playground')"
    )  # the robot here has none, as it says


@in_a_loop
async def test_first_drive_is_walked_in_chromium_and_stays_closed(meets: Meets) -> None:
    async with meets(placed=False, whole_picture=True) as (robot, page, visit):

        async def key(name: str, down: bool) -> None:
            await (page.keyboard.down(name) if down else page.keyboard.up(name))

        await _walk(robot, page.evaluate, key)
        await page.locator(".guide button", has_text="Close").click()
        await page.reload()
        await _until(page.evaluate, f"({READY}).includes('E-stop')")
        assert await page.evaluate(SAID) == ""
        assert visit.errors == []


@in_a_loop
async def test_first_drive_is_walked_in_firefox(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    async with paced_robot(office, office_cloud, cache) as robot, firefox(tmp_path) as browser:
        await browser.open(robot.page)

        async def key(name: str, down: bool) -> None:
            await browser.key(name, down=down)

        await _walk(robot, browser.evaluate, key)
