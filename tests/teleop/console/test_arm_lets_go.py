"""The arm's part of the page: it stops with the person, takes turns, reads well, and is not there without an arm."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest
from playwright.async_api import Page

from benchmarks.console.losses import HIDE
from robot_sim import World
from tests.teleop.console.arm_hands import (
    PANEL,
    REASON,
    choose_arm,
    drag_handle,
    office_with_parcel,
    standing,
    tip,
)
from tests.teleop.console.conftest import Meets, Pages
from tests.teleop.console.hands import GAMEPAD, pad, plug, press, says, until
from tests.teleop.console.paced_robot import PacedRobot
from tests.teleop.console.test_accessible import CONTROLS, LOOK, MISSED, findings
from tests.teleop.console.test_losing_it import BUSY
from tests.teleop.support import PATIENCE, in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

SIZE = {"width": 1280, "height": 800}
WHEELS = ".driving-status"


@pytest.fixture(scope="module")
def armed() -> World:
    """Return the office with a robot that has an arm."""
    return office_with_parcel(0.21, 0.03)


def rates(robot: PacedRobot) -> float:
    """Return how fast the fastest joint turns [rad/s]."""
    assert robot.simulation.arm is not None
    return float(np.abs(robot.simulation.arm.reading.rates).max())


async def held_key_moves(page: Page, robot: PacedRobot) -> None:
    """Hold a key of the arm until it moves, pressing again where a loaded machine made the page let go."""
    async with asyncio.timeout(PATIENCE):
        while True:
            await page.keyboard.down("u")
            for _ in range(40):
                await asyncio.sleep(0.05)
                if rates(robot) > 0.05:
                    return
            await page.keyboard.up("u")
            await asyncio.sleep(0.6)


@pytest.mark.long
@in_a_loop
async def test_arm_stands_when_the_person_is_gone_and_does_not_move_on(
    meets: Meets, armed: World
) -> None:
    async with meets(armed, viewport=SIZE) as (robot, page, visit):
        await choose_arm(page)
        ways = {
            "tab was hidden": (f"({HIDE})(true)", f"({HIDE})(false)"),
            "another window": ("window.dispatchEvent(new Event('blur'))", "0"),
        }
        for words, (lose, find) in ways.items():
            await held_key_moves(page, robot)
            await page.evaluate(lose)
            await until(lambda: rates(robot) < 0.01, "that it stands")
            await page.evaluate(find)
            await says(page, "Stopped:", within=REASON)
            said = await page.locator(REASON).inner_text()
            assert words in said or BUSY in said
            await asyncio.sleep(0.6)
            assert rates(robot) < 0.01, "it moves on by itself"
            await page.keyboard.up("u")

        # The handle in the picture, from which the system takes the pointer away.
        await standing(page)
        await drag_handle(page, await tip(page), np.array([0.0, 1.0, 0.0]), 60.0)
        await page.evaluate(
            "document.querySelector('canvas').dispatchEvent(new PointerEvent('pointercancel', { pointerId: 1 }))"
        )
        await until(lambda: rates(robot) < 0.01, "that it stands without the pointer")
        await page.mouse.up()

        await held_key_moves(page, robot)
        await page.keyboard.press("Escape")
        await until(lambda: rates(robot) < 0.01, "that the e-stop stops it")
        await page.keyboard.up("u")
        await says(page, "E-stop", within=PANEL)
        assert visit.errors == []


@pytest.mark.long
@in_a_loop
async def test_arm_is_moved_by_who_drives_and_others_see_why_not(
    meets: Meets, page_of: Pages, armed: World
) -> None:
    async with (
        meets(armed, placed=False, viewport=SIZE) as (robot, _page, first),
        page_of(robot.page, viewport=SIZE) as second,
    ):
        for one in (first, second):
            await says(one.page, "Ready", within=WHEELS)
            await choose_arm(one.page)
        await first.page.get_by_role("button", name="Pose “floor”").click()
        await says(first.page, "hold the button to move", within=PANEL)
        await says(second.page, "drives", within=WHEELS)
        opens = second.page.get_by_role("button", name="Open", exact=True)
        assert await opens.is_disabled()
        await second.page.keyboard.down("u")
        await says(second.page, "drives", within=REASON)
        await second.page.keyboard.up("u")
        assert rates(robot) < 0.01
        assert first.errors == second.errors == []


@pytest.mark.long
@in_a_loop
async def test_gamepad_moves_the_arm_and_no_wheel_until_it_is_switched(
    meets: Meets, armed: World
) -> None:
    async with meets(armed, placed=False, scripts=[GAMEPAD], viewport=SIZE) as (robot, page, visit):
        await says(page, "Ready", within=WHEELS)
        await choose_arm(page)
        await plug(page)
        async with asyncio.timeout(PATIENCE):
            while rates(robot) < 0.05:
                await pad(page, 0.0, deadman=False)
                await asyncio.sleep(0.3)
                await pad(page, 0.0)
                await asyncio.sleep(0.3)
                await pad(page, 0.5)
                await asyncio.sleep(0.7)
        assert not any(tick.moves for tick in robot.ticks)
        await page.get_by_role("button", name="the wheels", exact=True).click()
        await until(lambda: rates(robot) < 0.01, "that the arm stands")
        await asyncio.sleep(0.6)
        assert not any(tick.moves for tick in robot.ticks), "the deadman was not pressed anew"
        await pad(page, 0.0, deadman=False)
        assert visit.errors == []


@pytest.mark.long
@pytest.mark.usefixtures("page_tools")
@in_a_loop
async def test_axe_finds_nothing_and_tab_reaches_all_of_the_arm(meets: Meets, armed: World) -> None:
    async with meets(armed, viewport=SIZE) as (_robot, page, _visit):
        await choose_arm(page)
        await page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
        await press(page, "Keep this position")
        await page.get_by_role("button", name="Pose “floor”").click()
        await says(page, "hold the button to move", within=PANEL)
        found = {"day": await findings(page)}
        await page.get_by_label("Night").or_(page.get_by_text("Night", exact=True)).first.click()
        found["night"] = await findings(page)
        lines = [f"{where}: {what}" for where, wrongs in found.items() for what in wrongs]
        assert not lines, "\n".join(lines)
        for _ in range(200):
            await page.keyboard.press("Tab")
            if not await page.evaluate(LOOK):
                break
        assert await page.evaluate(MISSED, CONTROLS) == []
        assert await page.evaluate("window.unseen") == []


@pytest.mark.long
@in_a_loop
async def test_page_of_a_robot_without_an_arm_fetches_and_shows_nothing_of_it(
    meets: Meets, office: World, armed: World
) -> None:
    fetched = []
    for world in (office, armed):
        async with meets(world, viewport=SIZE) as (_robot, page, visit):
            if world is armed:
                await choose_arm(page)
                await page.locator(".arm-choice", has_text="The ghost").wait_for()
            fetched.append(
                {p.rsplit("/", 1)[1].split("-")[0] for p in visit.paths if "/parts/" in p}
            )
            assert (await page.locator(PANEL).count() > 0) == (world is armed)
    assert fetched[1] - fetched[0] >= {"arm"}
    assert not fetched[0] & {"arm", "TransformControls"}
