"""What ROS# sends, byte for byte; it reads as strictly as ROS# does, and falls where ROS# falls."""

from __future__ import annotations

import asyncio
import sys
from typing import Any

from websockets.asyncio.client import connect

from tests.teleop.rosbridge.foreign_clients.test_ros_sharp import JOY, RosSharp
from tests.teleop.scenario.clients.programs.steering import (
    CONTROL,
    POSE,
    STATE,
    address,
    judged,
    towards,
)

PERIOD = 0.05
"""Time between two messages of a joystick in Unity [s]."""


def joy(axes: list[float], held: int) -> dict[str, Any]:
    """Return a ``sensor_msgs/Joy`` as ROS#'s JoyPublisher fills it: without a time."""
    return {**JOY, "axes": axes, "buttons": [0, 0, 0, 0, held, 0]}


async def drive() -> int:
    async with connect(address(), compression=None, proxy=None) as socket:
        unity = RosSharp(socket)
        await unity.subscribe(STATE, "farsteer_msgs/ScenarioState")
        await unity.subscribe(CONTROL, "farsteer_msgs/TeleopState")
        await unity.subscribe(POSE, "geometry_msgs/PoseWithCovarianceStamped")
        await unity.advertise("/joy", "sensor_msgs/Joy")
        while True:
            await asyncio.sleep(PERIOD)
            await unity.alive()
            states, controls, poses = (unity.received[each] for each in (STATE, CONTROL, POSE))
            if states and states[-1]["phase"] == "over":
                return judged(states[-1])
            if states and controls and poses:
                forward, turn = towards(states[-1], controls[-1], poses[-1])
                await unity.publish("/joy", joy([turn / 1.2, forward / 0.5], 1))


if __name__ == "__main__":
    sys.exit(asyncio.run(drive()))
