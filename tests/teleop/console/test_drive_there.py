"""A place chosen on the page's picture: the robot drives there while the button is held, in Debian's Chromium."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import numpy as np
import pytest
from playwright.async_api import Page

from tests.teleop.console.conftest import Meets
from tests.teleop.console.hands import hold_until, press, says, until
from tests.teleop.console.headset_hands import (
    FRAME,
    aim_at_floor,
    aim_at_key,
    enter,
    headset,
    inside,
    press_key,
    worn,
)
from tests.teleop.console.paced_robot import PacedRobot
from tests.teleop.support import PATIENCE, in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

STATUS = ".steps-status"


async def hold_there(page: Page, true: Callable[[str], bool]) -> None:
    """Keep the button pressed until the robot or the status is as wanted; press again, for longer, where the page was too busy."""
    button = page.get_by_role("button", name="Hold to drive there")
    patience = 0.5
    async with asyncio.timeout(PATIENCE):
        while True:
            box = await button.bounding_box()
            assert box is not None
            await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            await page.mouse.down()
            # Until the page has seen the press, it may show how the drive before ended.
            due = asyncio.get_running_loop().time() + patience
            patience *= 2
            while not true(said := await page.locator(STATUS).inner_text()):
                ended = "ended after" in said or "not driven" in said
                if ended and asyncio.get_running_loop().time() > due:
                    break
                await asyncio.sleep(0.05)
            else:
                return
            await page.mouse.up()


def _from(robot: PacedRobot, place: np.ndarray) -> float:
    here = robot.simulation.truth().map_from_base.position[:2]
    return float(np.linalg.norm(here - place))


@pytest.mark.long
@in_a_loop
async def test_robot_drives_to_the_place_while_the_button_is_held_and_stops_when_it_is_let_go(
    meets: Meets,
) -> None:
    async with meets(viewport={"width": 1000, "height": 700}) as (robot, page, visit):
        await page.locator("summary", has_text="Steps").click()
        await press(page, "Drive there")
        button = page.get_by_role("button", name="Hold to drive there")
        assert await button.is_disabled()
        canvas = await page.locator(".page-canvas canvas").bounding_box()
        assert canvas is not None
        begin = robot.simulation.truth().map_from_base.position[:2].copy()
        # Seen from behind, the robot is in the middle; this is two metres before it and to the right.
        await page.mouse.click(
            canvas["x"] + 0.62 * canvas["width"], canvas["y"] + 0.45 * canvas["height"]
        )
        async with asyncio.timeout(PATIENCE):
            while await button.is_disabled():  # noqa: ASYNC110 - a page has no event of ours
                await asyncio.sleep(0.1)
        await hold_there(page, lambda _: _from(robot, begin) > 0.3)
        await page.mouse.up()
        await says(page, "the deadman was let go", within=STATUS)
        rest = _from(robot, begin)
        await asyncio.sleep(1.0)
        assert robot.speed < 0.01
        assert _from(robot, begin) == pytest.approx(rest, abs=0.05)

        await hold_there(page, lambda said: "done," in said)
        await page.mouse.up()
        assert _from(robot, begin) > rest + 0.1
        assert robot.speed < 0.02
        assert visit.errors == []


@pytest.mark.long
@pytest.mark.usefixtures("page_tools")
@in_a_loop
async def test_in_a_headset_a_ray_chooses_the_place_and_its_key_is_the_deadman(
    meets: Meets,
) -> None:
    async with meets(scripts=[headset()], viewport={"width": 800, "height": 400}) as (
        robot,
        page,
        visit,
    ):
        await enter(page)
        here = robot.simulation.truth().map_from_base
        begin = here.position[:2].copy()
        await press_key(page, "Drive there")
        await inside(page, lambda it: "Hold to drive there" not in it["words"])
        for value, ahead in ((1, 3.0), (1, 2.0), (0, 2.0)):  # pressed, dragged, released
            x, y = begin + ahead * np.array([np.cos(here.yaw), np.sin(here.yaw)])
            await aim_at_floor(page, x, y, here.position[2])
            await worn(page, "button", "right", "trigger", value)
            await asyncio.sleep(2 * FRAME)
        await inside(page, lambda it: "Hold to drive there" in it["words"])

        async def hold(held: bool) -> None:
            if held:  # the board has no such key while the page waits for the hand to let go
                await aim_at_key(page, "right", "Hold to drive there")
            await worn(page, "button", "right", "trigger", int(held))

        await hold_until(page, hold, lambda: _from(robot, begin) > 0.3, "0.3 m driven")
        await hold(False)
        await until(lambda: robot.speed < 0.01, "that it stands")
        assert _from(robot, begin) < 1.5, "it drives on to the place, though the key is let go"

        await hold_until(page, hold, lambda: robot.speed > 0.1, "that it drives on")
        await worn(page, "lie", "right", True)  # the controller lies on the table: no rotation
        await until(lambda: robot.speed < 0.01, "that it stands")
        await worn(page, "lie", "right", False)
        rest = _from(robot, begin)
        await asyncio.sleep(1.0)
        assert _from(robot, begin) == pytest.approx(rest, abs=0.02), "it drives on by itself"

        await worn(page, "button", "right", "trigger", 0)
        await hold_until(page, hold, lambda: _from(robot, begin) > 1.9, "that it is there")
        await hold(False)
        await until(lambda: robot.speed < 0.01, "that it stands")
        assert _from(robot, begin) == pytest.approx(2.0, abs=0.15)
        assert visit.errors == []
