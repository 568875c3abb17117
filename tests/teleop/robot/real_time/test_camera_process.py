"""The camera's process in real time: pictures beside the drive, killed, starved, and where nothing can be drawn."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from localization.types import SECOND
from robot_sim import TICK_NS, Simulation, World
from teleop import clock
from teleop.pictures.picture import Picture, PictureFormat
from teleop.robot.real_time.camera_feed import CameraFeed
from teleop.robot.real_time.camera_receiver import CameraReceiver
from teleop.robot.real_time.camera_start import CameraStart
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.picture_link import PictureLink
from teleop.robot.real_time.process_messages import NEXT_STATE
from teleop.ros_types import registry
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server
from tests.teleop.support import PATIENCE, in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

JPEG = PictureFormat("/camera/rgb/image_raw", "jpeg")
RAW = PictureFormat("/camera/rgb/image_raw", "rgb8")


@dataclass
class Rig:
    """A robot's ticks and the camera's process, joined as control and the gateway join them."""

    simulation: Simulation
    feed: CameraFeed
    receiver: CameraReceiver
    costs: list[int] = field(default_factory=list)
    """Processor time that the feed took of each tick [ns]."""

    async def until(self, true: Callable[[], object]) -> None:
        """Tick in real time until a condition holds."""
        async with asyncio.timeout(PATIENCE):
            while not true():
                self.simulation.step()
                begun = time.thread_time_ns()
                self.feed.ticked(clock.monotonic())
                self.costs.append(time.thread_time_ns() - begun)
                self.receiver.ticked(self.simulation.stamp)
                await asyncio.sleep(0.02)


@asynccontextmanager
async def rig(world: World) -> AsyncIterator[Rig]:
    simulation = Simulation(world, seed=0)
    start = CameraStart(world, "small")
    feed = await asyncio.to_thread(start.feed, simulation)
    assert feed is not None
    assert start.model is not None
    server = Server(Protocol(registry()), port=0, clock=clock.monotonic)
    receiver = CameraReceiver(PictureLink(os.dup(start.link)), start.model, server)
    robot = Rig(simulation, feed, receiver)
    try:
        yield robot
    finally:
        robot.receiver.close()
        feed.end()
        start.close()


def named(process: ChildProcess) -> str:
    """Return the name by which ps shows a process."""
    return Path(f"/proc/{process.pid}/comm").read_text().strip()


@pytest.mark.long
@in_a_loop
async def test_pictures_of_the_newest_frames_come_while_they_are_wanted(office: World) -> None:
    async with rig(office) as robot:
        await robot.until(lambda: robot.simulation.stamp >= 400_000_000)
        assert robot.receiver.hub.wanted == frozenset()
        assert robot.feed.process is not None
        assert named(robot.feed.process) == "camera"
        came: list[Picture] = []
        watch = robot.receiver.hub.watch(JPEG, came.append)
        also = robot.receiver.hub.watch(RAW, came.append)
        await robot.until(lambda: len(came) >= 12)
        stamps = [picture.stamp for picture in came if picture.format == RAW]
        assert min(stamps) > 400_000_000
        assert (np.diff(stamps) >= 60_000_000).all()
        assert {len(picture.data) for picture in came if picture.format == RAW} == {320 * 240 * 3}
        watch.close()
        also.close()
        await asyncio.sleep(0.5)  # what was on its way
        came.clear()
        end = robot.simulation.stamp + 400_000_000
        await robot.until(lambda: robot.simulation.stamp >= end)
        assert came == []
        assert np.median(robot.costs) < 100_000, "the drive pays less than 0.1 ms"


@pytest.mark.long
@in_a_loop
async def test_camera_and_gateway_go_on_with_each_other_s_successors(
    office: World, caplog: pytest.LogCaptureFixture
) -> None:
    async with rig(office) as robot:
        came: list[Picture] = []
        robot.receiver.hub.watch(RAW, came.append)
        await robot.until(lambda: came)
        killed = robot.feed.process
        assert killed is not None
        os.kill(killed.pid, signal.SIGKILL)
        await robot.until(lambda: robot.feed.process is not killed and robot.feed.process)
        begun, count = robot.simulation.stamp, len(came)
        await robot.until(lambda: came[count:] and came[-1].stamp > begun)
        assert [r.getMessage() for r in caplog.records] == [
            "the camera has ended: it is started again"
        ]
        # The gateway is replaced, too, in the midst of a picture.
        descriptor, camera = os.dup(robot.receiver._link.fileno()), robot.receiver._topics._camera
        robot.receiver.close()
        await asyncio.sleep(0.2)  # the camera goes on until its link is full
        server = Server(Protocol(registry()), port=0, clock=clock.monotonic)
        robot.receiver = CameraReceiver(PictureLink(descriptor), camera, server)
        newer: list[Picture] = []
        robot.receiver.hub.watch(JPEG, newer.append)
        begun = robot.simulation.stamp
        await robot.until(lambda: newer and newer[-1].stamp > begun)


def test_robot_where_nothing_can_be_drawn_is_served_without_a_camera(
    office: World,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "egl")
    # The dispatcher of EGL finds no driver.
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", os.devnull)
    start = CameraStart(office, "small")
    assert start.feed(Simulation(office, seed=0)) is None
    assert start.model is None
    start.close()
    (line,) = [record.getMessage() for record in caplog.records]
    assert line.startswith("serving without a camera: ")
    assert "libegl1" in line
    assert "\n" not in line
    assert "Traceback" not in capfd.readouterr().err


class AskingCamera:
    """A camera's process that asks for a frame again and again."""

    def __init__(self) -> None:
        self.channel, self.waiting, self.handed = self, False, 0

    def receive(self) -> list[bytes]:
        return [NEXT_STATE]

    def send(self, payload: bytes) -> None:
        self.handed += 1


def handed(feed: CameraFeed, camera: AskingCamera, begin: int, seconds: float, gap: int) -> int:
    """Return how many frames are handed over in ticks of this length [ns]."""
    before = camera.handed
    for now in range(begin, begin + round(seconds * SECOND), gap):
        feed.ticked(now, gap)
    return camera.handed - before


def test_late_ticks_are_spared_the_camera_until_ticks_keep_time() -> None:
    camera = AskingCamera()
    simulation: Any = SimpleNamespace(stamp=SECOND, visual_state=lambda: b"")
    feed = CameraFeed(cast(Any, camera), simulation, 50.0, restart=lambda: cast(Any, camera))
    assert handed(feed, camera, 0, 1.0, TICK_NS) == 50
    late = [handed(feed, camera, at * SECOND, 1.0, 6 * TICK_NS) for at in range(1, 12)]
    assert late[0] <= 5
    assert sum(late[1:]) <= 4
    assert handed(feed, camera, 20 * SECOND, 1.0, TICK_NS) == 50
