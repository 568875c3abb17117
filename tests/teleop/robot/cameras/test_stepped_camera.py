"""A camera in lockstep: its topics as clients get them, and the same bits each time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from localization.types import Twist
from robot_sim import Simulation, World
from robot_sim.cameras import CameraFrame, VisualState, camera_named
from teleop.robot.cameras.camera_topics import CAMERA_TOPICS
from teleop.robot.cameras.stepped_camera import SteppedCamera
from teleop.robot.serving.serve_config import ServeConfig
from teleop.ros_types import registry
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server
from tests.teleop.robot.served_robots import Serving
from tests.teleop.support import Peer, in_a_loop, peer, stamp_of

SMALL = camera_named("small")
JPEG = "/camera/rgb/image_raw/compressed"


@dataclass
class Rig:
    """A robot that turns on the spot, its camera and a server."""

    simulation: Simulation
    camera: SteppedCamera
    server: Server

    def tick(self, ticks: int) -> None:
        """Advance the world."""
        for _ in range(ticks):
            self.simulation.command(Twist(np.zeros(3), np.array([0.0, 0.0, 0.8])))
            self.simulation.step()
            self.camera.ticked(self.simulation.stamp)


class _Lossless(Observer):
    """Lets no message to a client be dropped, as none is to one that steps the robot."""

    def __init__(self, protocol: Protocol) -> None:
        self._protocol = protocol

    def connected(self, connection: Connection, now: int) -> None:
        self._protocol.connections.set_lossless(connection.id)


@asynccontextmanager
async def turning(world: World) -> AsyncIterator[Rig]:
    simulation = Simulation(world, seed=0)
    protocol = Protocol(registry(), limits=ClientLimits.unhurried())
    protocol.observers.add(_Lossless(protocol))
    server = Server(protocol, port=0, clock=lambda: simulation.stamp, lockstep=True)
    camera = SteppedCamera(simulation, SMALL, server)
    try:
        async with server:
            yield Rig(simulation, camera, server)
    finally:
        camera.close()


async def subscribed(client: Peer, *topics: str, compression: str = "none") -> None:
    await client.subscribe(*topics, compression=compression)
    await client.settle()


@pytest.mark.slow
@in_a_loop
async def test_each_topic_comes_with_the_stamps_at_which_frames_are_due(office: World) -> None:
    async with turning(office) as rig, peer(rig.server.url) as client:
        names = [topic.name for topic in CAMERA_TOPICS]
        await subscribed(client, *names, compression="cbor")
        rig.tick(20)
        await client.settle()
        for topic in CAMERA_TOPICS:
            stamps = [stamp_of(m["header"]["stamp"]) for m in client.messages(topic.name)]
            assert stamps == [n * 20_000_000 for n in (4, 7, 10, 14, 17, 20)], topic.name
        raw, rectified = (
            client.last(f"/camera/rgb/{n}") for n in ("image_raw", "image_rect_color")
        )
        assert raw == rectified
        assert (raw["width"], raw["height"], raw["step"]) == (320, 240, 960)
        colours = np.frombuffer(raw["data"], np.uint8).reshape(240, 320, 3)
        jpeg = Image.open(BytesIO(client.last(JPEG)["data"]))
        assert np.abs(np.asarray(jpeg, float) - colours).mean() < 4.0
        depth = client.last("/camera/depth/image_raw")
        png = Image.open(BytesIO(client.last("/camera/depth/image_raw/compressed")["data"]))
        assert (np.asarray(png) == np.frombuffer(depth["data"], "<u2").reshape(240, 320)).all()
        points = client.last("/camera/depth/points")
        assert [field["name"] for field in points["fields"]] == ["x", "y", "z", "rgb"]
        table = np.frombuffer(points["data"], "<f4").reshape(points["width"], 4)
        measured = np.count_nonzero(np.frombuffer(depth["data"], "<u2"))
        assert 0.2 * measured < len(table) <= 1_000_000 // 16
        near, far = table[:, 2].min(), table[:, 2].max()
        assert SMALL.near <= near < far <= SMALL.far
        info = client.last("/camera/depth/camera_info")
        assert info["header"]["frame_id"] == depth["header"]["frame_id"]
        assert list(info["k"]) == list(SMALL.k)


@pytest.mark.slow
@in_a_loop
async def test_two_runs_give_the_same_bytes(office: World) -> None:
    seen = []
    for _ in range(2):
        async with turning(office) as rig, peer(rig.server.url) as client:
            await subscribed(client, JPEG, "/camera/depth/image_raw", compression="cbor")
            rig.tick(30)
            await client.settle()
            topics = (JPEG, "/camera/depth/image_raw")
            seen.append([m["data"] for topic in topics for m in client.messages(topic)])
    assert len(seen[0]) == 18
    assert seen[0] == seen[1]
    assert len(set(seen[0])) == 18, "the robot turns, so that no picture is like another"


@in_a_loop
async def test_nothing_is_drawn_for_nobody(office: World, monkeypatch: pytest.MonkeyPatch) -> None:
    async with turning(office) as rig:
        drawn: list[int] = []
        render = rig.camera._renderer.render

        def counted(state: VisualState) -> CameraFrame:
            drawn.append(state.stamp)
            return render(state)

        monkeypatch.setattr(rig.camera._renderer, "render", counted)
        rig.tick(10)
        async with peer(rig.server.url) as client:
            await subscribed(client, "/camera/rgb/camera_info")
            rig.tick(10)
            await client.settle()
            assert len(client.messages("/camera/rgb/camera_info")) == 3
            assert (drawn, rig.camera.hub.wanted) == ([], frozenset())
            await subscribed(client, JPEG)
            rig.tick(10)
            assert len(drawn) == 3
        while rig.server.protocol.topics.wanted(JPEG):  # noqa: ASYNC110
            await asyncio.sleep(0.01)
        rig.tick(10)
        assert len(drawn) == 3


@pytest.mark.slow
@in_a_loop
async def test_answer_of_a_step_is_behind_the_pictures_of_its_ticks(serving: Serving) -> None:
    config = ServeConfig(camera="small", lost=True)
    async with serving(config) as server, peer(server.url) as client:
        await client.subscribe(JPEG, "/tf_static", compression="cbor")
        await client.step(10)
        stamps = [stamp_of(message["header"]["stamp"]) for message in client.messages(JPEG)]
        assert stamps == [80_000_000, 140_000_000, 200_000_000]
        frames = {t["child_frame_id"] for t in client.last("/tf_static")["transforms"]}
        assert {"camera_link", client.last(JPEG)["header"]["frame_id"]} <= frames
