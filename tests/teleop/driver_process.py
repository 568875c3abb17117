"""An operator to be killed: ``python -m tests.teleop.driver_process ws://...`` drives ahead for ever."""

from __future__ import annotations

import asyncio
import sys

from localization.types import Twist
from teleop.joystick import write_joy
from teleop.ros_types import registry
from teleop.rosbridge.client.client import Client


async def main(url: str) -> None:
    async with Client(url, registry=registry()) as client:
        await client.advertise("/joy", "sensor_msgs/msg/Joy")
        speeds = [0.0] * 5 + [0.7] * 1000
        for speed in speeds:
            axes, buttons = write_joy(Twist.planar(speed, 0.0))
            await client.publish("/joy", {"axes": axes, "buttons": buttons})
            await asyncio.sleep(0.05)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
