"""The arm on the page, in Debian's Chromium: a box is picked up by mouse and keys, and everything ends with the person."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from tests.teleop.console.arm_hands import (
    PANEL,
    bring,
    choose_arm,
    drag_handle,
    go,
    hold_key_until,
    office_with_parcel,
    standing,
    tip,
)
from tests.teleop.console.conftest import Pages
from tests.teleop.console.hands import press, says, seen
from tests.teleop.console.paced_robot import PacedRobot, paced_robot
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow, pytest.mark.untraced]

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
async def test_newcomer_picks_a_box_up_by_mouse_and_keys_within_two_minutes(
    page_of: Pages, office_cloud: Cloud, cache: Path
) -> None:
    world = office_with_parcel(AHEAD, LEFT)
    async with (
        paced_robot(world, office_cloud, cache) as robot,
        page_of(robot.page, viewport=SIZE) as visit,
    ):
        robot.place()
        page = visit.page
        await says(page, "Knows where it is")
        await seen(page)
        on_the_floor, began = height(robot), len(robot.ticks)
        await choose_arm(page)
        await page.get_by_role("button", name="Open", exact=True).click()
        await says(page, "Its jaws are 60 mm apart", within=PANEL)
        await go(page, "Pose “floor”")
        await standing(page)
        at = await tip(page)
        await drag_handle(page, at, np.array([0.0, 1.0, 0.0]), 20.0)
        await says(page, "It follows the ghost", within=PANEL)
        await standing(page)
        await page.mouse.up()
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
