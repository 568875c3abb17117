"""A server that sends what a robot sends while it drives, without a robot: as many points as one likes."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_to_dict, transform_to_dict
from localization.maps.map_files import load_cloud
from localization.types import Pose
from robot_sim import load_world
from teleop.console.page_files import offer_page
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.serving.server_setup import build_server, offer_map
from teleop.robot.topics.message_parts import header
from teleop.robot.topics.topic_table import latched_messages
from teleop.rosbridge import Server
from teleop.rosbridge.compat.standard_services import serve_standard

LIVE = 1_100
"""Points of a sweep."""
RADIUS, SPEED = 1.5, 0.5
"""Of the circle that is driven [m], and the speed on it [m/s]."""
TOPICS = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/local_cloud": "sensor_msgs/msg/PointCloud2",
    "/localization/status": "farsteer_msgs/msg/LocalizationStatus",
    "/teleop/state": "farsteer_msgs/msg/TeleopState",
}


def server_of() -> Server:
    """Return a server of the robot's types that does not listen yet, with the standard services."""
    server = build_server(ServeConfig(port=0), None, time.time_ns)
    serve_standard(server.protocol)
    return server


def offer_scripts(server: Server, scripts: Mapping[str, bytes]) -> None:
    """Serve scripts by name, each with a page of its own, ``/NAME.html``."""
    for name, script in scripts.items():
        page = (
            f"<!doctype html><meta charset=utf-8><body><script type=module src=/{name}.js></script>"
        )
        server.pages.add_file(f"/{name}.html", page.encode(), "text/html", public=True)
        server.pages.add_file(f"/{name}.js", script, "text/javascript", public=True)


@asynccontextmanager
async def publishing(
    map_file: Path, page: Path | None = None, scripts: Mapping[str, bytes] = MappingProxyType({})
) -> AsyncIterator[str]:
    """Serve the page with a map, and with a robot that drives in a circle; yield the page's address.

    Args:
        map_file: The map.
        page: Folder of the built page; the package's own by default.
        scripts: Scripts by name, each served with a page of its own, ``/NAME.html``.
    """
    server, cloud, world = server_of(), load_cloud(map_file), load_world("office")
    offer_map(server, map_file)
    offer_scripts(server, scripts)
    if not offer_page(server.pages, page=page):
        raise SystemExit("the page is not built: make env builds it")
    for interface, message in latched_messages(cloud, world.robot, world.robot.mounts).items():
        server.protocol.topics.advertise(interface.name, interface.type, latch=True)
        server.protocol.topics.publish(interface.name, message, server.now)
    for name, kind in TOPICS.items():
        server.protocol.topics.advertise(name, kind)
    middle = np.asarray(world.spawn.position)
    near = cloud.points[np.argsort(np.linalg.norm(cloud.points - middle, axis=1))[: 20 * LIVE]]
    async with server:
        driving = asyncio.create_task(_drive(server, middle, near))
        try:
            yield f"http://127.0.0.1:{server.port}/"
        finally:
            driving.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await driving


async def _drive(server: Server, middle: FloatArray, near: FloatArray) -> None:
    random, loop = np.random.default_rng(0), asyncio.get_running_loop()
    begun, tick = loop.time(), 0
    while True:
        stamp = server.now
        angle = SPEED / RADIUS * (loop.time() - begun)
        x, y = middle[:2] + RADIUS * np.array([np.cos(angle), np.sin(angle)])
        pose = Pose.planar(float(x), float(y), angle + np.pi / 2)
        _publish(server, "/tf", {"transforms": [_transform(stamp, pose)]})
        if tick % 2 == 0:
            for name, message in _slower(stamp, pose).items():
                _publish(server, name, message)
            sweep = near[random.choice(len(near), LIVE, replace=False)]
            _publish(server, "/local_cloud", cloud_message(stamp, sweep, random))
        tick += 1
        await asyncio.sleep(begun + 0.05 * tick - loop.time())


def _publish(server: Server, topic: str, message: dict[str, Any]) -> None:
    server.protocol.topics.publish(topic, message, server.now)


def _transform(stamp: int, pose: Pose) -> dict[str, Any]:
    parts = {"header": header(stamp, "map"), "child_frame_id": "base_link"}
    return {**parts, "transform": transform_to_dict(pose)}


def _slower(stamp: int, pose: Pose) -> dict[str, dict[str, Any]]:
    """Return what comes ten times a second besides the sweep."""
    covariance = np.diag([1e-4, 1e-4, 1e-6, 1e-6, 1e-6, 1e-4]).ravel()
    status = {"health": "tracking", "fit": 0.95, "position_sigma": 0.01, "heading_sigma": 0.01}
    state = {"state": "idle", "refuse_above": 1.0, "slow_above": 0.5}
    return {
        "/amcl_pose": {
            "header": header(stamp, "map"),
            "pose": {"pose": pose_to_dict(pose), "covariance": covariance},
        },
        "/localization/status": {"header": header(stamp, "map"), **status},
        "/teleop/state": {"header": header(stamp, "base_link"), **state},
    }


def cloud_message(stamp: int, points: FloatArray, random: np.random.Generator) -> dict[str, Any]:
    """Return a sweep as the robot publishes it: x y z, intensity, distance, 20 bytes a point."""
    table = np.zeros((len(points), 5), dtype="<f4")
    table[:, :3] = points
    table[:, 4] = np.abs(random.normal(scale=0.02, size=len(points)))
    names = ("x", "y", "z", "intensity", "distance")
    return {
        "header": header(stamp, "map"),
        "height": 1,
        "width": len(table),
        "fields": [
            {"name": name, "offset": 4 * i, "datatype": 7, "count": 1}
            for i, name in enumerate(names)
        ],
        "is_bigendian": False,
        "point_step": 20,
        "row_step": 20 * len(table),
        "data": table.tobytes(),
        "is_dense": True,
    }
