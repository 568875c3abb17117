"""Serve a robot in lockstep and drive it step by step: simulated time, faster than real time, same bits each run.

Robot and client are two parts of this one program; a client in another process or language does the same.
"""

import argparse
import asyncio
from typing import Any

from localization import prepare
from robot_sim import load_world
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.serving.serve_config import ServeConfig
from teleop.ros_types import registry
from teleop.rosbridge import Client
from teleop.scene_clouds import load_scene_cloud


async def run(scene: str, seconds: float) -> None:
    cloud, config = load_scene_cloud(scene), ServeConfig(port=0, lockstep=True)
    parts = RobotParts(load_world(scene), seed=0)
    robot = build_stepped_robot(parts, cloud, prepare(cloud), config)
    LockstepService(robot)  # /sim/step
    async with (
        robot.gateway.server as server,
        Client(server.url, registry=registry(), keepalive=None) as client,
    ):
        truth: list[dict[str, Any]] = []
        await client.subscribe("/ground_truth/odom", "nav_msgs/Odometry", truth.append)
        await client.advertise("/joy", "sensor_msgs/Joy")
        forward = 0.0  # the robot arms on a neutral stick
        for _ in range(round(10 * seconds)):
            message = {"axes": [0.0, forward], "buttons": [0, 0, 0, 0, 1]}
            await client.publish("/joy", message)
            await client.call("/sim/step", {"ticks": 5})  # 5 ticks of 20 ms
            forward = 1.0
        stamp = robot.stamp  # when the client leaves, the robot brakes to rest
    start, end = (m["pose"]["pose"]["position"] for m in (truth[0], truth[-1]))
    way = ((end["x"] - start["x"]) ** 2 + (end["y"] - start["y"]) ** 2) ** 0.5
    print(f"{stamp / 1e9:.1f} s of robot time, drove {way:.2f} m")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="office")
    parser.add_argument("--seconds", type=float, default=3.0, help="robot time")
    arguments = parser.parse_args()
    asyncio.run(run(arguments.scene, arguments.seconds))


if __name__ == "__main__":
    main()
