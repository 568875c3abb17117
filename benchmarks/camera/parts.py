"""A camera on the robot: a frame's processor time, what its process takes, how late ticks are, the speed of lockstep.

Parts by name: scenes real lockstep sim. ``sim`` is ``farsteer sim``, the whole tour, with a camera and without. In ``real`` a viewer in a process of its own takes the JPEG and the raw depth of each frame
(kinect, 640 x 480, 15 Hz, office), in turns with nobody watching; all is on one machine, so other work on it shows.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.camera.scenes import scenes
from benchmarks.common.figures import Figure
from benchmarks.common.sheet import measure
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Hint, Twist
from robot_sim import TICK_NS, Simulation, load_world
from robot_sim.cameras import camera_named
from teleop.joystick import VelocityRequest
from teleop.pictures.picture import PictureFormat
from teleop.robot.cameras.stepped_camera import SteppedCamera
from teleop.robot.drive import Drive
from teleop.robot.inbox import DriveCommand, InboxMessage, PoseHint
from teleop.robot.real_time.control_process import ControlProcess
from teleop.robot.robot import Robot
from teleop.robot.serve import serve
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import NO_PACING, DriveRecord, Pacing
from teleop.ros_types import registry
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server
from teleop.scene_clouds import load_scene_cloud

TURNS = 3
"""Turns with a viewer, and as many without."""
TURN = 10.0
"""Length of a turn [s]."""
GOAL = 60.0
"""Largest share of a core that the camera's process may take [%]."""
STEPPED = 20 * SECOND
"""Robot time of a drive in lockstep [ns]."""


def main(parts: list[str] | None = None, *, out: Path | None = None) -> None:
    """Measure some parts, or all, and print their figures."""
    names = parts or list(PARTS_BY_NAME)
    measure({name: PARTS_BY_NAME[name] for name in names}, out, whole=not parts)


def real() -> Iterator[Figure]:
    """Yield what a camera takes in real time, and how late ticks are with it and without."""
    yield from asyncio.run(_real())


async def _real() -> list[Figure]:
    ready: asyncio.Future[Address] = asyncio.get_running_loop().create_future()
    stop = asyncio.Event()
    ticks: list[tuple[int, int]] = []
    """Reading of the clock at each tick, and robot time, both [ns]."""
    tick = ControlProcess.tick

    def noted(self: ControlProcess, now: int, pacing: Pacing = NO_PACING) -> DriveRecord:
        record = tick(self, now, pacing)
        ticks.append((now, record.stamp))
        return record

    ControlProcess.tick = noted  # type: ignore[method-assign]
    config = ServeConfig(port=0, camera="kinect", log_level="error")
    world, cloud = load_world("office"), load_scene_cloud("office")
    with tempfile.TemporaryDirectory() as folder:
        serving = asyncio.create_task(
            serve(world, cloud, config, cache=Path(folder), ready=ready.set_result, stop=stop)
        )
        try:
            url = (await ready).url
            await asyncio.sleep(5.0)
            late: dict[bool, list[float]] = {False: [], True: []}
            costs: list[float] = []
            rates: list[float] = []
            for turn in range(2 * TURNS):
                seen = turn % 2 == 1
                viewer = await _viewer(url) if seen else None
                await asyncio.sleep(1.0)
                first, begun = len(ticks), _camera_seconds()
                await asyncio.sleep(TURN)
                times, stamps = np.array(ticks[first:]).T
                late[seen] += list(np.maximum(np.diff(times) - TICK_NS, 0) * 1e-6)
                if viewer is not None:
                    seconds, passed = _camera_seconds() - begun, (stamps[-1] - stamps[0]) / SECOND
                    viewer.terminate()
                    frames = await _lines(viewer) * TURN / (TURN + 1.0)
                    costs.append(1e3 * seconds / max(frames, 1))
                    rates.append(frames / passed)
        finally:
            ControlProcess.tick = tick  # type: ignore[method-assign]
            stop.set()
            await serving
    case, n = "kinect in the office", len(costs)
    figures = [
        Figure(
            case, "camera's process", "frames per second of robot time", _middle(rates), "Hz", n
        ),
        Figure(case, "camera's process", "CPU time per frame", _middle(costs), "ms", n),
        # Where the processor is shared, frames are left out: the share is that of all of them.
        Figure(
            case,
            "camera's process",
            "share of a core at 15 Hz",
            1.5 * _middle(costs),
            "%",
            n,
            most=GOAL,
        ),
    ]
    for seen, values in late.items():
        method = "with a viewer" if seen else "without"
        for name, q in (("p50", 50), ("p99", 99), ("max", 100)):
            value = float(np.percentile(values, q))
            figures.append(Figure("lateness of ticks", method, name, value, "ms", len(values)))
    return figures


async def _viewer(url: str) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "benchmarks.camera.viewer", url),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )


async def _lines(process: asyncio.subprocess.Process) -> int:
    """Return how many lines a process wrote until it ended."""
    out, _ = await process.communicate()
    return out.count(b"\n")


def _middle(values: list[float]) -> float:
    return float(np.median(values))


def _camera_seconds() -> float:
    """Return the CPU time of this process' child that draws [s]."""
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            words = (folder / "cmdline").read_bytes()
            if parent == os.getpid() and b"camera_process" in words:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
                return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        except OSError:
            continue
    raise SystemExit("the camera's process is not there")


def lockstep() -> Iterator[Figure]:
    """Yield robot time over CPU time of a drive in lockstep, without a camera and with one."""
    for name, formats in FORMATS.items():
        seconds = _stepped(formats)
        value = STEPPED / SECOND / seconds
        yield Figure("lockstep, office", name, "robot time over CPU time", value, "", 1)


FORMATS: dict[str, frozenset[PictureFormat] | None] = {
    "without a camera": None,
    "camera, nobody watches": frozenset(),
    "JPEG at 15 Hz": frozenset({PictureFormat("/camera/rgb/image_raw", "jpeg")}),
    "JPEG and raw depth at 15 Hz": frozenset(
        {
            PictureFormat("/camera/rgb/image_raw", "jpeg"),
            PictureFormat("/camera/depth/image_raw", "16UC1"),
        }
    ),
}
"""What is watched in the drives of ``lockstep``."""


def _stepped(formats: frozenset[PictureFormat] | None) -> float:
    """Return the CPU time of a drive [s]."""
    simulation = Simulation(load_world("office"), seed=0)
    cloud = load_scene_cloud("office")
    robot = Robot(Drive(simulation), Localizer(prepare(cloud, cache=None), simulation.mounts))
    draw: Callable[[int], Any] = lambda stamp: None  # noqa: E731
    if formats is not None:
        server = Server(Protocol(registry()), port=0, clock=lambda: simulation.stamp, lockstep=True)
        camera = SteppedCamera(simulation, camera_named("kinect"), server)
        draw = camera.ticked
        for wanted in formats:
            camera.hub.watch(wanted, lambda picture: None)
    truth = simulation.truth().map_from_base
    inbox: list[InboxMessage] = [PoseHint("", Hint(0, truth, np.zeros((6, 6))))]
    inbox.append(DriveCommand("driver", VelocityRequest(Twist.planar(0.0, 0.0), enabled=True)))
    twist = Twist.planar(0.0, 0.5)
    begun = time.process_time()
    while simulation.stamp < STEPPED:
        robot.tick(simulation.stamp, inbox)
        draw(simulation.stamp)
        inbox = [DriveCommand("driver", VelocityRequest(twist, enabled=True))]
    return time.process_time() - begun


def sim() -> Iterator[Figure]:
    """Yield the real-time factor of ``farsteer sim`` without a camera and with one that its operator watches."""
    hashes = set()
    for name, options in (("without a camera", ()), ("kinect, watched", ("--camera", "kinect"))):
        with tempfile.TemporaryDirectory() as folder:
            begun = os.times()
            subprocess.run(
                [
                    *(sys.executable, "-m", "teleop", "sim", "--out", folder, "--overwrite"),
                    *("--no-picture", "--json", *options),
                ],
                check=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            ended = os.times()
            facts = json.loads((Path(folder) / "summary.json").read_text())["facts"]
            hashes.add(hashlib.sha256((Path(folder) / "truth.tum").read_bytes()).hexdigest())
        seconds = facts["robot_seconds"]
        cpu = sum(ended[2:4]) - sum(begun[2:4])
        case = "farsteer sim, office"
        factor = seconds / facts["wall_seconds"]
        yield Figure(case, name, "real-time factor", factor, "", 1)
        yield Figure(case, name, "processor time per second of robot time", cpu / seconds, "s", 1)
    if len(hashes) > 1:
        raise SystemExit("the camera has changed the drive")


PARTS_BY_NAME: dict[str, Callable[[], Iterator[Figure]]] = {
    "scenes": scenes,
    "real": real,
    "lockstep": lockstep,
    "sim": sim,
}
PARTS = tuple(PARTS_BY_NAME)
