"""A person's whole way with the page, in Debian's Chromium, with a robot that is carried off on it."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path

import numpy as np
import pytest

from localization.types import Pose
from tests.teleop.console.conftest import Meets, Visit
from tests.teleop.console.hands import (
    GAMEPAD,
    drag_hint,
    hold_until,
    key,
    let_go,
    pad,
    plug,
    press,
    says,
    seen,
    until,
)
from tests.teleop.console.paced_robot import PacedRobot
from tests.teleop.robot.served_robots import ADMIN, DRIVER, tokens
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]


@pytest.mark.long
@in_a_loop
async def test_person_logs_in_drives_is_carried_off_hints_stops_and_comes_back(
    meets: Meets, tmp_path: Path
) -> None:
    guarded = {"tokens": tokens(tmp_path), "stepper": ADMIN}
    async with meets(placed=False, robot=guarded, scripts=[GAMEPAD], whole_picture=True) as (
        robot,
        _page,
        visit,
    ):
        robot.place()
        await _log_in_and_see(visit)
        await _drive(visit, robot)
        await _carried_off(visit, robot)
        await _hint(visit, robot)
        await _stop_and_release(visit, robot)
        await _lose_the_network(visit, robot)
        assert visit.violations == []
        assert [e for e in visit.errors if "ERR_" not in e and "401" not in e] == []


async def _log_in_and_see(visit: Visit) -> None:
    page = visit.page
    await says(page, "Log in")
    await page.get_by_label("Token").first.fill(DRIVER)
    await page.keyboard.press("Enter")
    await says(page, "Knows where it is")
    await seen(page)
    assert "token" not in page.url
    assert DRIVER not in await page.evaluate(
        "JSON.stringify([{ ...localStorage }, document.title])"
    )


async def _drive(visit: Visit, robot: PacedRobot) -> None:
    page, before = visit.page, robot.simulation.truth().map_from_base
    await plug(page)
    await pad(page, 0.0, deadman=False)
    await asyncio.sleep(0.2)

    async def hold(held: bool) -> None:
        # The deadman first: a stick that is pushed before it does not count.
        await pad(page, 0.0, deadman=held)
        await asyncio.sleep(0.1)
        if held:
            await pad(page, 0.8, 0.2)

    await hold_until(page, hold, lambda: robot.speed > 0.2, "that the robot drives")
    await says(page, "You drive.")
    await hold_until(page, hold, lambda: _far(robot, before) > 1.0, "that it goes a metre")
    await let_go(page, hold)
    await until(lambda: robot.speed < 0.01, "that it stands")


def _far(robot: PacedRobot, there: Pose) -> float:
    here = robot.simulation.truth().map_from_base
    return float(np.hypot(*(here.position - there.position)[:2]))


async def _carried_off(visit: Visit, robot: PacedRobot) -> None:
    here = robot.simulation.truth().map_from_base
    x, y = (float(v) for v in here.position[:2])
    robot.carry(x - 4.0, y, here.yaw + 2.2)
    await says(visit.page, re.compile("lost|in doubt"), within=".panel-alarms")


async def _hint(visit: Visit, robot: PacedRobot) -> None:
    page = visit.page
    await page.keyboard.press("v")  # from above
    await press(page, "Show where it is")
    truth = robot.simulation.truth().map_from_base
    x, y = (float(v) for v in truth.position[:2])
    await drag_hint(page, x + 0.2, y - 0.15, truth.yaw + 0.1)
    await says(page, "fits", within=".panel-preview")
    await page.keyboard.press("Enter")
    await says(page, re.compile("Accepted|Kept"), within=".panel-hint-result")
    await says(page, "Knows where it is")


async def _stop_and_release(visit: Visit, robot: PacedRobot) -> None:
    page = visit.page
    await page.locator(".page-canvas canvas").focus()
    await hold_until(page, key(page, "ArrowUp"), lambda: robot.speed > 0.2, "that keys drive")
    await page.keyboard.press("Escape")
    await until(lambda: robot.speed < 0.01, "that the e-stop stops it")
    await page.keyboard.up("ArrowUp")
    await says(page, "E-stop, pressed by you")
    await press(page, "Release e-stop")
    await says(page, "Are people and things clear")
    await press(page, "Release it")
    await let_go(page, key(page, "ArrowUp"))


async def _lose_the_network(visit: Visit, robot: PacedRobot) -> None:
    page = visit.page
    await hold_until(page, key(page, "w"), lambda: robot.speed > 0.2, "that keys drive again")
    robot.proxy.cut()
    await until(lambda: robot.speed < 0.01, "that the watchdog stops it")
    await says(page, "Nothing received for")
    robot.proxy.restore()
    await says(page, "Knows where it is")
    await says(page, "Press again to drive")
    await asyncio.sleep(1.0)
    assert robot.speed < 0.01, "it drives on by itself after the network is back"
    await page.keyboard.up("w")
    # Backwards, for on a loaded machine it has come far by now, and may stand before a wall.
    # Where it has not come from it backs at 0.15 m/s, for it sees nothing there.
    await hold_until(page, key(page, "s"), lambda: robot.speed > 0.1, "that a new press drives")
    await page.keyboard.up("s")
    await until(lambda: robot.speed < 0.01, "that it stands at the end")
