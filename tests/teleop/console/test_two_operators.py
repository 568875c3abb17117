"""Two operators and an onlooker at one robot: who drives, how it changes hands, and who may stop and release it."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from playwright.async_api import Page

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.console.conftest import VIEWPORT, Pages
from tests.teleop.console.hands import hold_until, key, press, says, until
from tests.teleop.console.paced_robot import PacedRobot, paced_robot
from tests.teleop.robot.served_robots import ADMIN, DRIVER, OTHER, VIEWER, tokens
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

TOKENS = {"anna": DRIVER, "bert": OTHER, "vera": VIEWER, "boss": ADMIN}
TURNS = ".driving-turns"
STATUS = ".driving-status"


@asynccontextmanager
async def robot_with_tokens(
    world: World, cloud: Cloud, cache: Path, folder: Path
) -> AsyncIterator[PacedRobot]:
    """Serve a robot to Anna and Bert, who operate, and Vera, who looks on."""
    book = tokens(folder)
    async with paced_robot(world, cloud, cache, tokens=book, stepper=ADMIN) as robot:
        yield robot


async def opened(page: Page, robot: PacedRobot, name: str) -> Page:
    """Open the page as somebody."""
    await page.goto(f"{robot.page}#token={TOKENS[name]}")
    await says(page, "You may only watch." if name == "vera" else "Ready", within=STATUS)
    return page


async def named(page: Page) -> str:
    """Return the name by which the robot knows a page."""
    await page.locator("summary", has_text="Session").first.click()
    words = await page.locator("p", has_text=re.compile(r"^You are ")).first.text_content()
    found = re.search(r"You are (.+?)\.(?:\s|$)", words or "")
    assert found is not None
    return found[1]


async def stands(robot: PacedRobot) -> None:
    """Wait until the command in force is zero."""
    await until(lambda: not robot.ticks[-1].moves, "that it stands")


async def offered(page: Page, name: str) -> bool:
    """Return whether a button is there to be pressed."""
    return await page.get_by_role("button", name=name).count() > 0


@pytest.mark.long
@in_a_loop
async def test_robot_changes_hands_by_asking_and_taking_over(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    async with (
        robot_with_tokens(office, office_cloud, cache, tmp_path) as robot,
        page_of("about:blank", viewport=VIEWPORT) as visit,
    ):
        anna = await opened(visit.page, robot, "anna")
        bert = await opened(await visit.page.context.new_page(), robot, "bert")
        of_anna, of_bert = await named(anna), await named(bert)

        async def drives_on(what: str) -> None:
            await hold_until(anna, key(anna, "w"), lambda: robot.ticks[-1].moves, what)

        await hold_until(anna, key(anna, "w"), lambda: robot.speed > 0.2, "that Anna drives")
        await says(bert, f"{of_anna} drives", within=STATUS)
        await bert.keyboard.down("ArrowLeft")
        await asyncio.sleep(0.3)
        assert robot.ticks[-1].turn == 0.0, "Bert turns the robot that Anna drives"
        await bert.keyboard.up("ArrowLeft")

        await press(bert, "Ask for the robot")
        await says(bert, "You have asked for the robot", within=TURNS)
        await says(anna, f"{of_bert} asks for the robot", within=TURNS)
        await drives_on("that Anna drives on while she is asked")
        await press(anna, "Refuse")
        await says(bert, "Ask for the robot", within=TURNS)
        await drives_on("that Anna drives on after she has refused")

        await press(bert, "Ask for the robot")
        await says(anna, "asks for the robot", within=TURNS)
        await press(anna, "Give")
        await says(bert, "You drive", within=TURNS)
        await says(anna, f"{of_bert} drives", within=TURNS)
        await stands(robot)
        await asyncio.sleep(0.5)
        assert not robot.ticks[-1].moves, "Anna's key still drives"
        await anna.keyboard.up("w")

        await hold_until(bert, key(bert, "w"), lambda: robot.speed > 0.2, "that Bert drives")
        await press(anna, "Take over")
        await says(anna, "You drive", within=TURNS)
        await says(bert, f"{of_anna} drives", within=TURNS)
        await stands(robot)
        await asyncio.sleep(0.5)
        assert not robot.ticks[-1].moves, "Bert's key still drives"
        await bert.keyboard.up("w")
        assert visit.violations == []


@pytest.mark.long
@in_a_loop
async def test_onlooker_is_offered_no_controls_but_the_stop_which_operators_release(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    async with (
        robot_with_tokens(office, office_cloud, cache, tmp_path) as robot,
        page_of("about:blank", viewport=VIEWPORT) as visit,
    ):
        anna = await opened(visit.page, robot, "anna")
        vera = await opened(await visit.page.context.new_page(), robot, "vera")
        for name in ("Ask for the robot", "Take over", "Show where it is", "Find it", "Turbo"):
            assert not await offered(vera, name), name
        assert await vera.locator(".driving-stick").count() == 0
        assert await offered(anna, "Turbo")

        await hold_until(anna, key(anna, "w"), lambda: robot.speed > 0.2, "that Anna drives")
        await says(vera, f"{await named(anna)} drives", within=TURNS)
        await vera.keyboard.press("ArrowLeft")
        await vera.keyboard.press("h")
        await vera.get_by_role("button", name="Emergency stop").click()
        await stands(robot)
        await says(anna, f"E-stop, pressed by {await named(vera)}", within=STATUS)
        await vera.get_by_role("button", name="Emergency stop is latched").wait_for()
        assert not await offered(vera, "Release e-stop")
        await anna.keyboard.up("w")
        await release(anna)
        await says(anna, "Ready", within=STATUS)
        boss = await opened(await visit.page.context.new_page(), robot, "boss")
        await boss.get_by_role("button", name="Emergency stop (Esc)").click()
        await release(anna)
        await says(anna, "Not released:")
        await release(boss)
        await says(anna, "Ready", within=STATUS)
        await vera.get_by_role("button", name="Emergency stop (Esc)").wait_for()
        assert not any(tick.turn for tick in robot.ticks)


async def release(page: Page) -> None:
    """Ask for the release of the e-stop, and confirm it."""
    await press(page, "Release e-stop")
    await press(page, "Release it")
