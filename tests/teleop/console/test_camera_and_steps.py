"""The camera, steps and photographs on the page, in Debian's Chromium, with a robot that has a camera."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from playwright.async_api import Page

from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.console.conftest import Pages, Served, Visit, page_address
from tests.teleop.console.hands import press, says, until
from tests.teleop.console.paced_robot import at_the_pace_of_the_clock
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

STEPS = ".steps-status"


@asynccontextmanager
async def robot_with_camera(served: Served, folder: Path) -> AsyncIterator[Address]:
    """Serve a robot with the smallest camera, at the pace of the clock; a folder takes its runs and ``photos``."""
    config = ServeConfig(camera="small", photos=folder / "photos", runs=folder)
    async with served(config) as robot, at_the_pace_of_the_clock(robot.url):
        yield robot


def streams(visit: Visit) -> list[str]:
    """Return the addresses of all streams that the page has opened."""
    return [path for path in visit.paths if "/stream" in path]


async def age(page: Page) -> float:
    """Return the age of the picture that is shown, as the page says it [s]."""
    words = await page.locator(".camera-age").inner_text()
    found = re.fullmatch(r"(?:at least )?([\d.]+) (ms|s) old.*", words)
    return float("inf") if found is None else float(found[1]) / (1e3 if found[2] == "ms" else 1.0)


@pytest.mark.long
@in_a_loop
async def test_person_watches_the_camera_drives_a_step_and_takes_a_photograph(
    page_of: Pages, served: Served, tmp_path: Path
) -> None:
    async with (
        robot_with_camera(served, tmp_path) as robot,
        page_of(page_address(robot), viewport={"width": 900, "height": 600}) as visit,
    ):
        page = visit.page
        choice = page.get_by_label("Stream")
        await choice.wait_for()
        picture = page.get_by_alt_text("Camera: p3at")
        await picture.wait_for()  # shown until a person chooses otherwise
        await choice.select_option("p3at")
        await until(lambda: picture.evaluate("shown => shown.naturalWidth"), "a picture")

        async def fresh() -> bool:
            return await age(page) < 2.0

        await until(fresh, "a picture of the present")

        await page.locator("summary", has_text="Steps").click()
        await page.get_by_label("Distance").first.fill("0,2")
        await press(page, "Step forward")
        await says(page, "Forward 0.20 m: done, 0.20 m", within=STEPS)
        await page.get_by_label("Angle").first.fill("400")
        await says(page, "Angle: a number from 0.5 to 360 °, not “400”.", within=STEPS)
        assert await page.get_by_role("button", name="Turn left by a step").is_disabled()

        await press(page, "Take a photograph")
        link = page.get_by_role("link", name="photo0.jpg")
        await link.wait_for()
        fetched = await page.request.get(await link.get_attribute("href") or "")
        assert await fetched.body() == (tmp_path / "photos" / "photo0.jpg").read_bytes()

        await choice.select_option("")
        await picture.wait_for(state="detached")
        opened = len(streams(visit))
        await asyncio.sleep(2.0)
        assert len(streams(visit)) == opened
        assert visit.violations == []
        assert visit.errors == []
