"""A person's whole way in a headset: in, looking, driving, carried off, a hint, the arm, the e-stop, out."""

from __future__ import annotations

import asyncio
import io

import numpy as np
import pytest
from PIL import Image
from playwright.async_api import Page

from tests.teleop.console.arm_hands import office_with_parcel
from tests.teleop.console.conftest import Meets
from tests.teleop.console.hands import hold_until, says, until
from tests.teleop.console.headset_hands import (
    FRAME,
    aim_at_floor,
    enter,
    figures,
    grip,
    headset,
    inside,
    press_key,
    tap,
    worn,
)
from tests.teleop.console.paced_robot import PacedRobot
from tests.teleop.support import in_a_loop

pytestmark = [
    pytest.mark.process,
    pytest.mark.slow,
    pytest.mark.usefixtures("page_tools"),
]

SIZE = {"width": 1120, "height": 600}


@pytest.mark.long
@in_a_loop
async def test_person_enters_looks_drives_is_carried_off_hints_moves_the_arm_stops_and_leaves(
    meets: Meets,
) -> None:
    async with meets(
        office_with_parcel(0.21, 0.03), robot={"guard": False}, scripts=[headset(building=True)]
    ) as (robot, page, visit):
        await enter(page)
        await _look(page, robot)
        # A headset whose frames come late lets go of everything, and here a processor draws them.
        await page.set_viewport_size({"width": 800, "height": 400})
        await _hide(page, "Building")
        await _drive(page, robot)
        await _hint(page, robot)
        await _arm(page, robot)
        await _stop_release_and_leave(page, robot)
        assert {host.partition(":")[0] for host in visit.hosts} == {"127.0.0.1"}
        assert visit.violations == []
        assert visit.errors == []


async def _look(page: Page, robot: PacedRobot) -> None:
    """Both eyes see the same building, from places as far apart as eyes are; one turns, goes elsewhere, and has a table."""
    picture = np.asarray(Image.open(io.BytesIO(await page.screenshot())).convert("RGB"), float)
    left, right = picture[:, :560], picture[:, 560:1120]
    assert left.std() > 10.0, "the left eye sees nothing"
    assert 0.5 < np.abs(left - right).mean() < 60.0, "the eyes see the same, or nothing in common"
    shown = await inside(page)
    truth = robot.simulation.truth().map_from_base
    head = np.array([shown["head"][axis] for axis in "xyz"])
    assert np.linalg.norm(head[:2] - truth.position[:2]) == pytest.approx(1.8, abs=0.1)
    assert head[2] == pytest.approx(1.6, abs=0.1)
    heading = shown["heading"]
    await worn(page, "stick", "left", 1, 0)
    turned = await inside(page, lambda it: abs(it["heading"] - heading) > 0.1)
    assert abs(np.angle(np.exp(1j * (turned["heading"] - heading)))) == pytest.approx(
        np.pi / 6, abs=1e-6
    )
    await worn(page, "stick", "left", 0, 0)
    await press_key(page, "On a table")
    await inside(page, lambda it: it["stand"] == "table" and it["head"]["z"] > 10.0)
    await press_key(page, "Ride along")
    ridden = await inside(page, lambda it: it["stand"] == "ride" and it["head"]["z"] < 2.0)
    assert (
        np.hypot(*(np.array([ridden["head"]["x"], ridden["head"]["y"]]) - truth.position[:2])) < 0.1
    )


async def _hide(page: Page, layer: str) -> None:
    """Take a layer out of the picture, in the page's folded panel."""
    box = page.locator("label.panel-check", has_text=layer).locator("input")
    await box.evaluate("box => box.click()")
    assert not await box.is_checked()


async def _drive(page: Page, robot: PacedRobot) -> None:
    """It goes where the stick is pushed; who rides along goes with it, with darker edges, and is not turned."""
    before = await inside(page)
    hold = grip(page, 0.8, 0.3)
    await hold_until(page, hold, lambda: robot.speed > 0.2, "that the robot drives")
    await inside(page, lambda it: it["covered"] > 0.2)
    await hold(False)
    await until(lambda: robot.speed < 0.01, "that it stands")
    after = await inside(page, lambda it: it["covered"] < 0.05)
    assert after["heading"] == before["heading"]
    truth = robot.simulation.truth().map_from_base
    assert (
        np.hypot(*(np.array([after["head"]["x"], after["head"]["y"]]) - truth.position[:2])) < 0.3
    )


async def _hint(page: Page, robot: PacedRobot) -> None:
    """Carried off, the robot takes the place to which a ray points, and the heading in which it is dragged."""
    here = robot.simulation.truth().map_from_base
    x, y = (float(v) for v in here.position[:2])
    robot.carry(x - 3.0, y, here.yaw + 1.8)
    await press_key(page, "Beside it")
    await press_key(page, "Show where it is")
    truth = robot.simulation.truth().map_from_base
    x, y, z = (float(v) for v in truth.position)
    await aim_at_floor(page, x + 0.1, y - 0.1, z)
    await worn(page, "button", "right", "trigger", 1)
    await asyncio.sleep(2 * FRAME)
    ahead = truth.yaw + 0.05
    await aim_at_floor(page, x + 0.1 + np.cos(ahead), y - 0.1 + np.sin(ahead), z)
    await asyncio.sleep(FRAME)
    await worn(page, "button", "right", "trigger", 0)
    await inside(page, lambda it: any("explains" in words for words in it["words"]))
    await press_key(page, "It is here")
    await inside(
        page, lambda it: any(words.startswith(("Accepted", "Kept")) for words in it["words"])
    )
    await says(page, "Knows where it is")


async def _arm(page: Page, robot: PacedRobot) -> None:
    """The other hand closes the clutch and leads the tip upwards; opened, it leads nothing."""
    await page.locator(".arm-tip").wait_for(state="attached")
    arm = robot.simulation.arm
    assert arm is not None

    def angles() -> np.ndarray:
        return np.array(arm.reading.angles)

    before = angles()
    for _ in range(20):
        await worn(page, "place", "left", -0.25, 1.5, -0.4)
        await asyncio.sleep(2 * FRAME)
        await worn(page, "button", "left", "squeeze", 1)
        await asyncio.sleep(4 * FRAME)
        for step in range(20):
            await worn(page, "place", "left", -0.25, 1.5 + 0.005 * step, -0.4)
            await asyncio.sleep(0.05)
        await worn(page, "button", "left", "squeeze", 0)
        await asyncio.sleep(2 * FRAME)
        if np.abs(angles() - before).max() >= 0.05:
            break
    else:
        said = await page.locator(".panel-arm").inner_text()
        pytest.fail(
            f"the arm does not follow; wrist {(await inside(page))['words']}; page:\n{said}"
        )
    await until(lambda: np.abs(arm.reading.rates).max() < 0.02, "that the arm stands")
    held = angles()
    await worn(page, "place", "left", -0.25, 1.3, -0.4)
    await asyncio.sleep(1.0)
    assert np.abs(angles() - held).max() < 0.02, "the arm follows a hand whose clutch is open"
    await worn(page, "guess", "left", True)
    await worn(page, "button", "left", "squeeze", 1)
    # Below the picture, where a small window does not show it.
    untracked = page.locator(".panel-arm").get_by_text("The hand is not tracked")
    await untracked.first.wait_for(state="attached")
    await worn(page, "button", "left", "squeeze", 0)
    await worn(page, "guess", "left", False)


async def _stop_release_and_leave(page: Page, robot: PacedRobot) -> None:
    """B stops at full speed; the board asks before it releases; Leave brings the page back, with the robot standing."""
    hold = grip(page, -0.8)
    await hold_until(page, hold, lambda: robot.speed > 0.2, "that it drives again")
    await tap(page, "left", "y-button")
    await until(lambda: robot.speed < 0.01, "that the e-stop stops it")
    await hold(False)
    await inside(page, lambda it: any("E-stop" in words for words in it["words"]))
    await press_key(page, "Release e-stop…")
    await press_key(page, "Release it")
    await inside(page, lambda it: "Stop!" in it["words"])
    await press_key(page, "Leave")
    async with asyncio.timeout(60.0):
        while await figures(page) is not None:  # noqa: ASYNC110 - a page has no event of ours
            await asyncio.sleep(0.1)
    assert await page.get_by_role("button", name="Enter VR").count() == 1
    assert robot.speed < 0.01
