"""Runs in the console: recorded by a button, looked at again on the same page, and opened by dropping a file."""

from __future__ import annotations

import base64
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from playwright.async_api import Page

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.console.conftest import Meets, Pages, Served, page_address
from tests.teleop.console.hands import hold_until, key, says, until
from tests.teleop.console.paced_robot import paced_robot
from tests.teleop.console.test_camera_and_steps import robot_with_camera
from tests.teleop.robot.served_robots import DRIVER, VIEWER, tokens
from tests.teleop.support import in_a_loop, soon

pytestmark = [pytest.mark.process, pytest.mark.slow, pytest.mark.long]

AT_START = re.compile(r"x 24\.(19|2)")
"""Where the robot begins in the office; an estimate of it may be half a centimetre off."""
DROP = """([name, text]) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const dropped = new DataTransfer();
  dropped.items.add(new File([bytes], name));
  document.dispatchEvent(new DragEvent('drop', { dataTransfer: dropped, bubbles: true, cancelable: true }));
}"""
DRAWN = "() => (document.querySelector('.page-camera')?.naturalWidth ?? 0) > 0"
"""A picture of the camera can be seen."""
SEEK = """(share) => {
  const slider = document.querySelector('.replay input');
  slider.value = String(share * Number(slider.max));
  slider.dispatchEvent(new Event('input', { bubbles: true }));
}"""


@in_a_loop
async def test_run_is_recorded_by_a_button_and_scrubbed_on_the_same_page(
    meets: Meets, tmp_path: Path
) -> None:
    async with meets(robot={"runs": tmp_path}) as (robot, page, visit):
        await says(page, "Ready", within=".driving-status")
        async with _recording(page):
            forward = key(page, "w")
            start = robot.simulation.truth().map_from_base.position[0]

            def driven() -> bool:
                return abs(float(robot.simulation.truth().map_from_base.position[0] - start)) > 0.6

            await hold_until(page, forward, driven, "0.6 m driven")
            await forward(False)
            async with page.expect_download() as picture:
                await page.get_by_role("button", name="Save the picture").click()
            png = Path(await (await picture.value).path()).read_bytes()  # noqa: ASYNC240
            assert png.startswith(b"\x89PNG")
            assert len(png) > 10_000  # an empty canvas is a few hundred bytes
        await says(page, "This is a recording", within=".driving-status")
        await says(page, AT_START, within=".page-left")
        await page.evaluate(SEEK, 1.0)
        await says(page, "x 23.", within=".page-left")
        await page.evaluate(SEEK, 0.0)
        await says(page, AT_START, within=".page-left")
        assert await page.locator(".replay-strip .replay-good").count() > 5
        assert not await page.get_by_role("button", name="Stop!").is_visible()
        await page.get_by_role("button", name="Play", exact=True).click()
        await says(page, "x 23.", within=".page-left")
        ticks = len(robot.ticks)
        await page.keyboard.down("w")
        await page.wait_for_timeout(500)
        await page.keyboard.up("w")
        assert not any(tick.moves for tick in robot.ticks[ticks:])
        assert visit.errors == []
        assert visit.violations == []

        (file,) = tmp_path.glob("*.mcap")  # noqa: ASYNC240
        await page.get_by_role("button", name="Back to the robot").click()
        # The page loads anew: what is dropped before it has begun would be lost.
        await says(page, "Ready", within=".driving-status")
        await _drop(page, file.name, file.read_bytes())
        await says(page, f"Recorded run {file.name}")
        await _drop(page, "notes.txt", b"hello")
        await says(page, "notes.txt is no run that can be read")


@asynccontextmanager
async def _recording(page: Page) -> AsyncIterator[None]:
    """Record a run by the page's buttons, and look at it afterwards."""
    await page.locator("summary", has_text="Runs").click()
    await page.get_by_role("button", name="Record", exact=True).click()
    await page.get_by_role("button", name="End the recording").wait_for()
    yield
    await page.get_by_role("button", name="End the recording").click()
    await page.get_by_role("button", name="Look at run-").click()
    await says(page, "nothing here moves the robot")


async def _drop(page: Page, name: str, content: bytes) -> None:
    await page.evaluate(DROP, [name, base64.b64encode(content).decode()])


@in_a_loop
async def test_replay_shows_alarms_at_their_moments_and_where_the_place_was_doubted(
    meets: Meets, tmp_path: Path
) -> None:
    async with meets(robot={"runs": tmp_path}) as (robot, page, visit):
        await says(page, "Ready", within=".driving-status")
        async with _recording(page):
            await page.wait_for_timeout(2000)
            await page.keyboard.press("Escape")
            await says(page, "E-stop", within=".panel-alarms")
            robot.carry(-5.0, -5.0, 0.0)  # Outside of the map, where it stays lost.
            await says(page, "does not know where it is", within=".panel-alarms")
            await page.wait_for_timeout(1000)
        alarms = page.locator(".panel-alarms")
        await page.evaluate(SEEK, 0.0)
        await soon(alarms.get_by_text("E-stop").wait_for(state="detached"))
        await says(page, "Knows where it is", within=".page-bar")
        await page.evaluate(SEEK, 1.0)
        await says(page, "E-stop", within=".panel-alarms")
        await says(page, "does not know where it is", within=".panel-alarms")
        grades = await page.locator(".replay-strip g").evaluate_all(
            "bars => bars.map((bar) => bar.getAttribute('class'))"
        )
        assert grades[0] == "replay-good"
        assert grades[-1] in ("replay-warn", "replay-bad")
        assert visit.errors == []


@in_a_loop
async def test_replay_shows_the_pictures_of_the_camera_that_were_recorded(
    page_of: Pages, served: Served, tmp_path: Path
) -> None:
    async with (
        robot_with_camera(served, tmp_path) as robot,
        page_of(page_address(robot)) as visit,
    ):
        page = visit.page
        await page.get_by_alt_text("Camera: p3at").wait_for()
        async with _recording(page):
            await page.wait_for_timeout(4000)
        picture = page.locator(".page-camera")
        await picture.wait_for()
        first = await picture.get_attribute("src")
        # Another picture may take its place at any moment, which ends the decoding of the one before.
        await until(lambda: page.evaluate(DRAWN), "a picture of the camera")
        await page.evaluate(SEEK, 1.0)

        async def another() -> bool:
            return await picture.get_attribute("src") != first

        await until(another, "the picture of another moment")
        assert visit.violations == []


@in_a_loop
async def test_damaged_run_is_shown_as_far_as_it_goes_and_says_so(
    meets: Meets, tmp_path: Path
) -> None:
    async with meets(robot={"runs": tmp_path}) as (_robot, page, _visit):
        async with _recording(page):
            await page.wait_for_timeout(6000)
        (file,) = tmp_path.glob("*.mcap")  # noqa: ASYNC240
        whole = file.read_bytes()
        assert await page.get_by_text("damaged or was cut off").count() == 0
        await _drop(page, "cut.mcap", whole[: round(0.9 * len(whole))])
        await says(page, "Recorded run cut.mcap", within=".replay")
        await says(page, "The file is damaged or was cut off: it ends at", within=".replay")
        await says(page, AT_START, within=".page-left")
        await _drop(page, "head.mcap", b"\x00" + whole[1:])
        await says(page, "head.mcap is no run that can be read")
        await says(page, "Recorded run cut.mcap", within=".replay")


@in_a_loop
async def test_run_is_deleted_by_who_may_drive_and_offered_to_nobody_else(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs/run-20261124-193000.mcap").write_bytes(b"cut off")
    book = tokens(tmp_path)
    async with paced_robot(
        office, office_cloud, cache, tokens=book, stepper=DRIVER, runs=tmp_path / "runs"
    ) as robot:
        async with page_of(f"{robot.page}#token={VIEWER}") as viewer:
            await _list(viewer.page)
            await says(viewer.page, "cut off, 0.0 MB")
            assert await viewer.page.get_by_role("button", name="Delete").count() == 0
        async with page_of(f"{robot.page}#token={DRIVER}") as driver:
            await _list(driver.page)
            delete = driver.page.get_by_role("button", name="Delete run-20261124-193000.mcap")
            await delete.click()
            assert list((tmp_path / "runs").iterdir())
            await driver.page.get_by_role("button", name="Delete for good").click()
            await says(driver.page, "No runs have been recorded yet.")
            assert list((tmp_path / "runs").iterdir()) == []


async def _list(page: Page) -> None:
    """Open the panel of runs and list them."""
    await page.locator("summary", has_text="Runs").click()
    await page.get_by_role("button", name="List the runs").click()
