"""What the terminal says of a robot that is served: a line for each change, and none without one."""

from __future__ import annotations

import logging

import pytest

from teleop.robot.clients.activity_log import ActivityLog
from teleop.robot.tick_record import TickRecord
from tests.teleop.support import Robots, in_a_loop, peer


@pytest.mark.slow
@in_a_loop
async def test_each_change_of_who_drives_is_said_once(
    robots: Robots, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "teleop.robot.clients.activity_log")
    async with robots() as rig:
        log = ActivityLog()
        rig.server.protocol.observers.add(log)

        def observe(tick: TickRecord) -> None:
            log.driven(tick.drive)

        rig.stepper.stepped.observers = (observe,)
        async with peer(rig.server.url) as stepper:
            await stepper.step()
            async with peer(rig.server.url) as driver:
                name = rig.server.protocol.connections.name(2)
                await driver.joy(0.0)
                await driver.settle()
                await stepper.step()
                for _ in range(5):
                    await driver.joy(1.0)
                    await driver.settle()
                    await stepper.step(2)
                await stepper.step(30)
                await stepper.ask("/teleop/estop")
                await stepper.step()
                await stepper.ask("/teleop/estop_reset")
                await stepper.step()
            await rig.departure()
            await stepper.step()
    said = [record.getMessage() for record in caplog.records]
    stepper_name = said[0].removesuffix(" connected")
    assert said[1:] == [
        f"{name} connected",
        f"{name}: drives",
        f"{name}: stopped, no command for 0.500 s",
        f"e-stop by {stepper_name}",
        f"e-stop reset by {stepper_name}",
        f"{name} left",
        f"{stepper_name} left",
    ]
