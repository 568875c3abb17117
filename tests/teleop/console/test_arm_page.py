"""The arm on the page, in Debian's Chromium: a box is picked up by mouse and keys, and everything ends with the person."""

from __future__ import annotations

import asyncio
import contextlib

import numpy as np
import pytest
from playwright.async_api import TimeoutError as PlaywrightTimeout

from tests.teleop.console.arm_hands import (
    PANEL,
    REASON,
    bring,
    choose_arm,
    drag_handle,
    drag_until_it_follows,
    go,
    hold_key_until,
    office_with_parcel,
    standing,
    tip,
)
from tests.teleop.console.conftest import Meets
from tests.teleop.console.hands import press, says
from tests.teleop.console.paced_robot import PacedRobot
from tests.teleop.support import PATIENCE, in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

SIZE = {"width": 1280, "height": 800}
AHEAD, LEFT = 0.21, 0.03
"""Where the box lies, from the arm's base [m]."""
TWO_MINUTES = 120.0


def height(robot: PacedRobot) -> float:
    """Return the true height of the box [m]."""
    ((_, pose),) = robot.simulation.truth().parcels
    return float(pose.position[2])


@pytest.mark.long
@in_a_loop
async def test_newcomer_picks_a_box_up_by_mouse_and_keys_within_two_minutes(meets: Meets) -> None:
    world = office_with_parcel(AHEAD, LEFT)
    async with meets(world, viewport=SIZE) as (robot, page, visit):
        on_the_floor, began = height(robot), len(robot.ticks)
        await choose_arm(page)
        await page.get_by_role("button", name="Open", exact=True).click()
        await says(page, "Its jaws are 60 mm apart", within=PANEL)
        await go(page, "Pose “floor”")
        await standing(page)
        await drag_until_it_follows(page, np.array([0.0, 1.0, 0.0]), 20.0)
        await press(page, "Precision")
        await bring(page, 1, LEFT, plus="j", minus="l")
        await bring(page, 0, AHEAD, plus="i", minus="k")
        await hold_key_until(page, "o", lambda at: at[2] <= 0.018, "that it is around the box")
        await page.get_by_role("button", name="Close", exact=True).click()
        await says(page, "Holds something", within=PANEL)
        await press(page, "Normal")
        await hold_key_until(page, "u", lambda at: at[2] >= 0.09, "that it lifts")
        await says(page, "It is lifted", within=PANEL)
        took = 0.02 * (len(robot.ticks) - began)
        assert height(robot) - on_the_floor > 0.04
        assert took <= TWO_MINUTES
        assert visit.violations == []
        assert visit.errors == []


@pytest.mark.long
@in_a_loop
async def test_ghost_is_gone_to_positions_are_repeated_and_the_way_out_is_taken(
    meets: Meets,
) -> None:
    async with meets(office_with_parcel(AHEAD, LEFT), viewport=SIZE) as (_robot, page, visit):
        await choose_arm(page)
        await page.locator("summary", has_text="Teach").click()
        await press(page, "Keep this position")
        await go(page, "Pose “floor”")
        await standing(page)
        await press(page, "plan first, then go")
        before = await tip(page)
        there = page.get_by_role("button", name="Go there")
        async with asyncio.timeout(PATIENCE):
            while not await there.is_visible():
                await drag_handle(page, before, np.array([0.0, 1.0, 0.0]), 40.0)
                await page.mouse.up()
                await asyncio.sleep(0.5)
        assert np.allclose(await tip(page), before, atol=0.003), "the arm waits for its plan"
        await go(page, "Go there")
        await standing(page)
        moved = await tip(page) - before
        assert moved[1] > 0.02
        assert abs(moved[[0, 2]]).max() < 0.006
        await press(page, "Keep this position")

        await go(page, "Go through them", title="Position 2")
        await standing(page)
        assert np.allclose(await tip(page), before + moved, atol=0.006)

        out = page.locator(f"{REASON} button")
        await page.keyboard.down("o")
        await out.wait_for()
        await page.keyboard.up("o")
        low = (await standing(page))[2]
        # On a loaded machine the robot may have given the move up: then a person presses again.
        async with asyncio.timeout(PATIENCE):
            while await out.count():
                with contextlib.suppress(PlaywrightTimeout):
                    await out.click(timeout=1000.0)
                await asyncio.sleep(0.5)
        await standing(page)
        assert (await tip(page))[2] > low + 0.005
        assert visit.errors == []
