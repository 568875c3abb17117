"""A rosbridge of standard types: it passes a robot's topics and ``/cmd_vel`` on, and has nothing else."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from threading import Thread
from typing import Any, Final

import numpy as np

from localization.maps.cloud import Cloud
from teleop.console.console_server import ConsoleServer
from teleop.rosbridge import Client, Protocol, Server, TypeRegistry

TOPICS: Final = {
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
    "/odom": "nav_msgs/Odometry",
    "/scan": "sensor_msgs/LaserScan",
    "/local_cloud": "sensor_msgs/PointCloud2",
    "/imu/data": "sensor_msgs/Imu",
}
RESOLUTION: Final = 0.1
"""Side of a cell of the grid [m]."""
HEIGHTS: Final = (0.2, 1.6)
"""Heights of what counts as an obstacle in the grid [m]."""


def grid_message(cloud: Cloud) -> dict[str, Any]:
    """Return the cloud as a grid: occupied where a robot would bump into something, otherwise free."""
    points = cloud.points
    low = points[:, :2].min(axis=0)
    cells = np.floor((points[:, :2] - low) / RESOLUTION).astype(int)
    columns, rows = cells.max(axis=0) + 1
    grid = np.zeros((rows, columns), int)
    tall = (points[:, 2] > HEIGHTS[0]) & (points[:, 2] < HEIGHTS[1])
    grid[cells[tall, 1], cells[tall, 0]] = 100
    pose = {
        "position": {"x": float(low[0]), "y": float(low[1]), "z": 0.0},
        "orientation": {"w": 1.0},
    }
    info = {"resolution": RESOLUTION, "width": int(columns), "height": int(rows), "origin": pose}
    return {"header": {"frame_id": "map"}, "info": info, "data": grid.ravel().tolist()}


def _pass_on(protocol: Protocol, topic: str, message: dict[str, Any]) -> None:
    protocol.topics.publish(topic, message, 0)


@asynccontextmanager
async def plain_page(robot: str, cloud: Cloud) -> AsyncIterator[str]:
    """Serve the page for such a rosbridge of a robot, and return the page's address.

    Args:
        robot: Address of the robot's WebSocket.
        cloud: The robot's map.
    """
    protocol = Protocol(TypeRegistry())
    async with Server(protocol, port=0) as server, Client(robot) as client:
        protocol.topics.advertise("/map", "nav_msgs/OccupancyGrid", latch=True)
        protocol.topics.publish("/map", grid_message(cloud), 0)
        for topic, type in TOPICS.items():
            protocol.topics.advertise(topic, type, latch=topic == "/tf_static")
            await client.subscribe(topic, type, partial(_pass_on, protocol, topic))
        tasks: set[asyncio.Task[bool]] = set()

        def command(_client: int, message: dict[str, Any], _now: int) -> None:
            task = asyncio.create_task(client.publish("/cmd_vel", message))
            tasks.add(task)
            task.add_done_callback(tasks.discard)

        await client.advertise("/cmd_vel", "geometry_msgs/Twist")
        protocol.topics.subscribe("/cmd_vel", "geometry_msgs/Twist", command)
        with ConsoleServer(server.url.rstrip("/"), 0) as pages:
            thread = Thread(target=pages.serve_forever, name="pages")
            thread.start()
            try:
                yield pages.url
            finally:
                pages.shutdown()
                thread.join()
