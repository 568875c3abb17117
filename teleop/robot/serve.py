"""Serve a robot until told to stop: any rosbridge client may drive it."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from localization.cloud import Cloud
from localization.localizer import Localizer, LocalizerConfig
from localization.log import ReadingsWriter
from localization.prepared import prepare
from localization.replay import config_metadata
from localization.types import Hint
from robot_sim import Simulation, World
from teleop import pacing
from teleop.interfaces import registry
from teleop.robot import topics
from teleop.robot.host import Host, Stepper
from teleop.robot.outfit import Outfit
from teleop.robot.robot import Robot, Snapshot
from teleop.rosbridge.limits import Limits
from teleop.rosbridge.protocol import Protocol
from teleop.rosbridge.server import Server


@dataclass(frozen=True, slots=True)
class ServeConfig:
    """How the robot is served."""

    host: str = "127.0.0.1"
    """Address to listen on; others than loopback are open to the network."""
    port: int = 9090
    """0 takes a free one."""
    seed: int = 0
    """Of sensor noise."""
    placed: bool = True
    """Whether the robot knows where it starts; else it waits for a hint on ``/initialpose``."""
    record: Path | None = None
    """Where to write the log of readings (MCAP)."""
    lockstep: bool = False
    """Whether time stands still until a client steps it (``/sim/step``)."""
    outfit: Outfit = field(default_factory=Outfit)
    """Of the robot; its world is built by the caller."""
    messages: tuple[Path, ...] = ()
    """Folders of further ``.msg``, ``.srv`` and ``.action`` files, for topics among clients."""

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise ValueError(f"port must be 0 to 65535, got {self.port}")
        if self.seed < 0:
            raise ValueError(f"seed must be >= 0, got {self.seed}")


async def serve(
    world: World,
    cloud: Cloud,
    config: ServeConfig,
    *,
    cache: Path | None = None,
    map_file: Path | None = None,
    ready: Callable[[Server], None] = lambda server: None,
    stop: asyncio.Event | None = None,
) -> float:
    """Serve in real time or in lockstep, until Ctrl-C or until ``stop`` is set.

    Args:
        world: the scene.
        cloud: its prebuilt cloud.
        config: where to listen, and the rest.
        cache: folder for derived files.
        map_file: what is offered as ``/map.ply`` over HTTP, on the same port.
        ready: called once clients can connect.
        stop: ends serving.

    Returns:
        The real-time factor that was kept; 0 in lockstep, which has none.

    Raises:
        ServerError: if the port is taken.
    """
    simulation = Simulation(world, seed=config.seed, config=config.outfit.simulation())
    localizer = Localizer(prepare(cloud, cache=cache), simulation.mounts)
    robot = Robot(simulation, localizer)
    types = registry(config.messages)
    if config.lockstep:
        protocol = Protocol(types, limits=Limits.unhurried())
        server = Server(
            protocol, config.host, config.port, clock=lambda: simulation.stamp, lockstep=True
        )
    else:
        server = Server(Protocol(types), config.host, config.port, clock=pacing.monotonic)
    log = _log(config, simulation, cloud)

    def record(snapshot: Snapshot) -> None:
        if log is not None:
            for reading in snapshot.readings:
                log.write(reading, snapshot.stamp)

    if map_file is not None:
        _offer(server, map_file)
    host = Host(robot, server, cloud, sinks=(record,))
    if config.placed:
        # On its mark, as a robot is that was put where it always starts.
        host.post(Hint(0, simulation.truth().map_from_base, np.zeros((6, 6))))
    stop = stop or asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            loop.add_signal_handler(number, stop.set)
    try:
        await server.start()
        ready(server)
        if not config.lockstep:
            return await pacing.real_time(host.tick, stop)
        Stepper(host)
        await stop.wait()
        return 0.0
    finally:
        await server.close()
        if log is not None:
            log.close()


def _offer(server: Server, map_file: Path) -> None:
    server.offer("/map.ply", map_file.read_bytes())


def _log(config: ServeConfig, simulation: Simulation, cloud: Cloud) -> ReadingsWriter | None:
    if config.record is None:
        return None
    metadata = {
        "scene": simulation.world.name,
        "seed": str(config.seed),
        "map_sha256": cloud.sha256,
        **config_metadata(LocalizerConfig()),
    }
    radius = simulation.world.robot.rolling_radius
    return ReadingsWriter(config.record, simulation.mounts, metadata, wheel_radius=radius)


def greeting(server: Server, world: World, cloud: Cloud, map_path: Path) -> str:
    """Return what to print once clients can connect: address, map, topics, and a client that works."""
    names = ", ".join(t.name for t in topics.OUTPUTS)
    inputs = ", ".join(t.name for t in topics.INPUTS)
    lockstep = server.lockstep
    services = ", ".join(s.name for s in topics.SERVICES if lockstep or s.name != "/sim/step")
    open_to_all = server.host not in ("127.0.0.1", "localhost", "::1")
    warning = (
        "\nwarning: anybody who reaches this address can drive the robot" if open_to_all else ""
    )
    return f"""\
{world.name} at {server.url}{warning}
map       {map_path}
          {len(cloud.points)} points, sha256 {cloud.sha256[:16]}...
topics    {names}
listens   {inputs}
services  {services}

{_LOCKSTEP if lockstep else _SNIPPET_INTRODUCED.format(snippet(server.port))}
Ctrl-C ends."""


_SNIPPET_INTRODUCED = """\
drive it with roslibpy (pip install roslibpy):

{}"""

_LOCKSTEP = "time stands still until a client calls /sim/step; docs/teleoperation.md has an example"


def snippet(port: int) -> str:
    """Return ten lines of roslibpy that drive forward, print the pose and receive a cloud."""
    return f"""\
import time, roslibpy
ros = roslibpy.Ros("127.0.0.1", {port})
ros.run()
pose = roslibpy.Topic(ros, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", throttle_rate=500)
pose.subscribe(lambda m: print("pose", m["pose"]["pose"]["position"]))
cloud = roslibpy.Topic(ros, "/local_cloud", "sensor_msgs/PointCloud2", throttle_rate=500)
cloud.subscribe(lambda m: print("cloud of", m["width"], "points"))
joy = roslibpy.Topic(ros, "/joy", "sensor_msgs/Joy")
for forward in [0.0] + [1.0] * 30:  # a neutral stick first, then three seconds ahead
    joy.publish({{"axes": [0.0, forward], "buttons": [0, 0, 0, 0, 1]}})
    time.sleep(0.1)
ros.terminate()
"""
