"""What a person does with a robot before a picture is taken."""

from __future__ import annotations

import asyncio

from playwright.async_api import Page

from tests.teleop.console.hands import drag_hint, hold_until, key, press, says
from tests.teleop.console.paced_robot import PacedRobot
from tools.console_pictures.studio import REST


async def drive(page: Page, robot: PacedRobot, held: str, seconds: float) -> None:
    """Hold a key for a time."""
    await page.locator(".page-canvas canvas").click(position={"x": 300, "y": 120})
    await hold_until(page, key(page, held), lambda: robot.speed > 0.1, "that the robot drives")
    await asyncio.sleep(seconds)


async def carry_off(page: Page, robot: PacedRobot) -> None:
    """Carry the robot to another place and wait until it no longer knows where it is."""
    robot.carry(16.0, 3.2, 0.9)
    await says(page, "In doubt where it is")


async def place_hint(page: Page, robot: PacedRobot, aside: float, turned: float) -> None:
    """Drag a hint that is wrong by so much [m, rad], and wait for what the robot makes of it."""
    await press(page, "Show where it is")
    await asyncio.sleep(REST)
    truth = robot.simulation.truth().map_from_base
    x, y = (float(v) for v in truth.position[:2])
    await drag_hint(page, x + aside, y - 0.3 * aside, truth.yaw + turned)
    await says(page, "fits" if abs(aside) < 0.5 else "does not fit", within=".panel-preview")
    await asyncio.sleep(REST)
