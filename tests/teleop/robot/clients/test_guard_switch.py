"""``/teleop/guard_switch`` and ``/teleop/guard`` over the socket, in lockstep."""

from __future__ import annotations

import pytest

from tests.teleop.robot.served_robots import meeting
from tests.teleop.support import Robots, arm, drive, in_a_loop


@pytest.mark.slow
@in_a_loop
async def test_only_the_driver_switches_the_guard_off_and_everybody_sees_by_whom(
    robots: Robots,
) -> None:
    async with meeting(robots(guard=True), 2) as (_, (driver, other)):
        await other.subscribe("/teleop/guard", "/teleop/state", "/drive_limits")
        await arm(driver)
        await drive(driver, 1.0, steps=3)
        assert 0.0 < other.last("/teleop/state")["guard_ahead"] <= 4.0
        assert other.last("/drive_limits")["acceleration"] == 0.5
        assert other.last("/teleop/guard")["state"] == "free"
        assert other.last("/teleop/guard")["forward"]
        _, refused = await other.ask("/teleop/guard_switch", data=False)
        assert not refused["success"]
        assert refused["message"].endswith("only the driver may switch the guard off")
        assert (await driver.ask("/teleop/guard_switch", data=False))[1]["success"]
        await driver.step(5)
        name = (await driver.ask("/teleop/session"))[1]["name"]
        assert other.last("/teleop/guard")["overridden_by"] == name
        assert other.last("/teleop/state")["guard_overridden_by"] == name
