"""Runs in the console: recorded by a button, looked at again on the same page, and opened by dropping a file."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.console.conftest import Pages
from tests.teleop.console.hands import hold_until, key, says, seen
from tests.teleop.console.paced_robot import paced_robot
from tests.teleop.support import in_a_loop, soon

pytestmark = [pytest.mark.process, pytest.mark.slow, pytest.mark.long]

DROP = """([name, text]) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const dropped = new DataTransfer();
  dropped.items.add(new File([bytes], name));
  document.dispatchEvent(new DragEvent('drop', { dataTransfer: dropped, bubbles: true, cancelable: true }));
}"""
SEEK = """(share) => {
  const slider = document.querySelector('.replay input');
  slider.value = String(share * Number(slider.max));
  slider.dispatchEvent(new Event('input', { bubbles: true }));
}"""
POSE = ".panel-localization"


@in_a_loop
async def test_run_is_recorded_by_a_button_and_scrubbed_on_the_same_page(
    office: World, office_cloud: Cloud, cache: Path, page_of: Pages, tmp_path: Path
) -> None:
    async with (
        paced_robot(office, office_cloud, cache, runs=tmp_path) as robot,
        page_of(robot.page) as visit,
    ):
        page = visit.page
        robot.place()
        await seen(page)
        await says(page, "Ready", within=".driving-status")
        await page.locator("summary", has_text="Runs").click()
        await page.get_by_role("button", name="Record", exact=True).click()
        await page.get_by_role("button", name="End the recording").wait_for()
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
        await page.get_by_role("button", name="End the recording").click()
        await page.get_by_role("button", name="Look at run-").click()
        await says(page, "nothing here moves the robot")
        await says(page, "This is a recording", within=".driving-status")
        await says(page, "x 24.2", within=".page-left")
        await page.evaluate(SEEK, 1.0)
        await says(page, "x 23.", within=".page-left")
        await page.evaluate(SEEK, 0.0)
        await says(page, "x 24.2", within=".page-left")
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
        await soon(page.locator(".replay").wait_for(state="detached"))
        text = base64.b64encode(file.read_bytes()).decode()
        await page.evaluate(DROP, [file.name, text])
        await says(page, f"Recorded run {file.name}")
        await page.evaluate(DROP, ["notes.txt", base64.b64encode(b"hello").decode()])
        await says(page, "notes.txt is no run that can be read")
