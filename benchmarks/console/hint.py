"""From the alarm to the accepted hint, by a hand that knows the way."""

from __future__ import annotations

import asyncio
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.common.figures import Figure
from benchmarks.console.browser import PATIENCE, page_at
from robot_sim import load_world
from teleop.scene_clouds import load_scene_cloud
from tests.teleop.console.hands import drag_hint, press, says
from tests.teleop.console.paced_robot import PacedRobot, paced_robot

RUNS = 5
GOAL = 5.0
"""Longest time from lost to found [s]."""
REACTION = 0.3
"""What the hand waits before it presses, before it drags, and before it confirms [s]."""
AWAY = ((-4.0, 0.0, 2.2), (-3.0, 0.5, -2.0), (-4.5, -0.3, 1.6), (-3.5, 0.2, 3.0), (-4.0, 0.4, -1.2))
"""Where it is carried off to, from where it starts: x, y [m], turn [rad]."""


def hint() -> Iterator[Figure]:
    """Yield the time from the alarm that the robot is lost to the accepted hint."""
    times = asyncio.run(_times())
    case = f"carried off in the office; the hand waits {REACTION} s before each of three steps"
    n = len(times)
    yield Figure(case, "alarm to accepted", "median", float(np.median(times)), "s", n, most=GOAL)
    yield Figure(case, "alarm to accepted", "longest", max(times), "s", n)


async def _times() -> list[float]:
    world, cloud = load_world("office"), load_scene_cloud("office")
    chance, times = random.Random(0), list[float]()
    for away in AWAY[:RUNS]:
        with tempfile.TemporaryDirectory() as folder:
            async with paced_robot(world, cloud, Path(folder)) as robot:
                times.append(await _found(robot, away, chance))
    return times


async def _found(
    robot: PacedRobot, away: tuple[float, float, float], chance: random.Random
) -> float:
    """Carry a robot off, and return how long its operator takes to show where it is [s]."""
    clock = asyncio.get_running_loop().time
    robot.place()
    async with page_at(robot.page) as page:
        await says(page, "Knows where it is")
        await page.locator(".page-canvas canvas").focus()
        await page.keyboard.press("v")  # from above
        here = robot.simulation.truth().map_from_base
        x, y = (float(v) for v in here.position[:2])
        robot.carry(x + away[0], y + away[1], here.yaw + away[2])
        alarms = page.locator(".panel-alarms")
        lost = alarms.get_by_text("lost").or_(alarms.get_by_text("in doubt")).first
        await lost.wait_for(state="visible", timeout=1000 * PATIENCE)
        begun = clock()
        await asyncio.sleep(REACTION)
        await press(page, "Show where it is")
        await asyncio.sleep(REACTION)
        truth = robot.simulation.truth().map_from_base
        x, y = (float(v) for v in truth.position[:2])
        aside = (chance.uniform(-0.3, 0.3) for _ in range(3))
        await drag_hint(page, x + next(aside), y + next(aside), truth.yaw + next(aside))
        await asyncio.sleep(REACTION)
        await page.keyboard.press("Enter")
        accepted = page.locator(".panel-hint-result").get_by_text("Accepted").first
        await accepted.wait_for(timeout=1000 * PATIENCE)
        return clock() - begun
