"""A place chosen on the page's picture: the robot drives there while the button is held, in Debian's Chromium."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest
from playwright.async_api import Page

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.console.conftest import PATIENCE, Pages
from tests.teleop.console.hands import press, says, seen
from tests.teleop.console.paced_robot import PacedRobot, paced_robot
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

STATUS = ".steps-status"


async def hold(page: Page) -> None:
    """Put the pointer on the button and keep it pressed."""
    box = await page.get_by_role("button", name="Hold to drive there").bounding_box()
    assert box is not None
    await page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    await page.mouse.down()


async def driven(robot: PacedRobot, begin: np.ndarray, least: float) -> float:
    """Wait until the robot is so far from a place [m]; return how far."""
    async with asyncio.timeout(PATIENCE):
        while (way := _from(robot, begin)) < least:  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.05)
    return way


def _from(robot: PacedRobot, place: np.ndarray) -> float:
    here = robot.simulation.truth().map_from_base.position[:2]
    return float(np.linalg.norm(here - place))


@pytest.mark.long
@in_a_loop
async def test_robot_drives_to_the_place_while_the_button_is_held_and_stops_when_it_is_let_go(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        paced_robot(office, office_cloud, cache) as robot,
        page_of(robot.page, viewport={"width": 1000, "height": 700}) as visit,
    ):
        page = visit.page
        robot.place()
        await seen(page)
        await page.locator("summary", has_text="Steps").click()
        await press(page, "Drive there")
        button = page.get_by_role("button", name="Hold to drive there")
        assert await button.is_disabled()
        canvas = await page.locator("canvas").first.bounding_box()
        assert canvas is not None
        begin = robot.simulation.truth().map_from_base.position[:2].copy()
        # Seen from behind, the robot is in the middle; this is two metres before it and to the right.
        await page.mouse.click(
            canvas["x"] + 0.62 * canvas["width"], canvas["y"] + 0.45 * canvas["height"]
        )
        async with asyncio.timeout(PATIENCE):
            while await button.is_disabled():  # noqa: ASYNC110 - a page has no event of ours
                await asyncio.sleep(0.1)
        await hold(page)
        await driven(robot, begin, 0.3)
        await page.mouse.up()
        await says(page, "the deadman was let go", within=STATUS)
        rest = _from(robot, begin)
        await asyncio.sleep(1.0)
        assert robot.speed < 0.01
        assert _from(robot, begin) == pytest.approx(rest, abs=0.05)

        await hold(page)
        await says(page, "done,", within=STATUS)
        await page.mouse.up()
        assert _from(robot, begin) > rest + 0.1
        assert robot.speed < 0.02
        assert visit.errors == []
