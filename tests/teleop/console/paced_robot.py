"""A robot for the page: simulated time, stepped at the pace of the clock, with hands that reach into its world.

Its link goes through a proxy that a test can cut, as a network does that is gone without a word.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from websockets.asyncio.client import connect

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.surfaces.files import surfaces_of
from localization.types import SECOND, Hint, Pose
from robot_sim import Simulation, World
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.inbox import PoseHint
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import TickRecord
from teleop.scene_clouds import scene_cloud_path
from tests.teleop.support import Peer

TICK = 0.02
"""Time between two ticks [s]."""


class Tick(NamedTuple):
    """What was in force in one tick."""

    forward: float
    """Forward speed of the command in force [m/s]."""
    turn: float
    """Its turn rate [rad/s]."""
    age: float
    """Time since the driver's last command [s]; 0 without a driver."""

    @property
    def moves(self) -> bool:
        """Whether the command is any but zero."""
        return self.forward != 0.0 or self.turn != 0.0


@dataclass
class Proxy:
    """Passes connections on to a port of this machine, until it is cut."""

    target: int
    port: int = 0
    whole: asyncio.Event = field(default_factory=asyncio.Event)
    passed: int = 0
    """What has gone to the page so far [bytes]."""
    _writers: set[asyncio.StreamWriter] = field(default_factory=set)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Pass one connection on."""
        if not self.whole.is_set():
            writer.transport.abort()
            return
        server, to_server = await asyncio.open_connection("127.0.0.1", self.target)
        self._writers |= {writer, to_server}
        await asyncio.gather(
            self._pass(reader, to_server), self._pass(server, writer, counted=True)
        )
        for one in (writer, to_server):
            one.close()
            self._writers.discard(one)

    async def _pass(
        self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, *, counted: bool = False
    ) -> None:
        with contextlib.suppress(ConnectionError):
            while piece := await source.read(65_536):
                await self.whole.wait()  # what is under way is held up, as in a network
                sink.write(piece)
                self.passed += len(piece) if counted else 0
                await sink.drain()
        with contextlib.suppress(ConnectionError, OSError):
            sink.write_eof()

    def cut(self) -> None:
        """Pass nothing on from now, without closing anything."""
        self.whole.clear()

    def drop(self) -> None:
        """End all connections, and refuse new ones while it is cut, as without a server."""
        for writer in self._writers:
            writer.transport.abort()
        self._writers.clear()

    def restore(self) -> None:
        """Be whole again for new connections; those of before are gone."""
        self.drop()
        self.whole.set()


@dataclass
class PacedRobot:
    """A robot in the office, and where its page is."""

    simulation: Simulation
    service: LockstepService
    proxy: Proxy
    ticks: list[Tick] = field(default_factory=list)
    """What was in force, tick by tick."""

    @property
    def page(self) -> str:
        """Address of the page, through the proxy."""
        return f"http://127.0.0.1:{self.proxy.port}/"

    def place(self) -> None:
        """Give the robot its true pose as a hint."""
        truth = self.simulation.truth().map_from_base
        self.service.adapter.wishes.post(PoseHint("", Hint(0, truth, np.zeros((6, 6)))))

    def carry(self, x: float, y: float, heading: float) -> None:
        """Carry the robot off; x and y [m], heading [rad]."""
        height = float(self.simulation.truth().map_from_base.position[2])
        there = Pose.planar(x, y, heading)
        self.simulation.carry_to(Pose(np.array([x, y, height]), there.quaternion_wxyz))

    @property
    def speed(self) -> float:
        """True speed [m/s]."""
        return float(np.linalg.norm(self.simulation.truth().twist.linear[:2]))

    def observe(self, tick: TickRecord) -> None:
        """Note what is in force."""
        control = tick.drive.control
        forward, turn = float(control.twist.linear[0]), float(control.twist.angular[2])
        self.ticks.append(Tick(forward, turn, control.command_age / SECOND))


@asynccontextmanager
async def paced_robot(
    world: World,
    cloud: Cloud,
    cache: Path,
    *,
    tokens: Path | None = None,
    stepper: str = "",
    runs: Path = Path("runs/recorded"),
    guard: bool = True,
) -> AsyncIterator[PacedRobot]:
    """Serve a robot with its page, stepped at the pace of the clock.

    Args:
        world: The world, of which a cloud is shipped.
        cloud: The cloud.
        cache: Folder of prepared maps.
        tokens: File of tokens; without one everybody may do everything.
        stepper: Token of the client that steps the robot.
        runs: Folder of recorded runs.
        guard: Whether the robot has its guard.
    """
    config = ServeConfig(port=0, lockstep=True, tokens=tokens, runs=runs)
    prepared = prepare(cloud, cache=cache)
    stepped = build_stepped_robot(RobotParts(world, guard=guard), cloud, prepared, config)
    service, simulation = LockstepService(stepped), stepped.robot.simulation
    stepped.gateway.offer_files(scene_cloud_path(world.name), surfaces_of(cloud, cache=cache))
    async with stepped.gateway.server as server:
        assert stepped.gateway.page, "the page is not built: make env builds it"
        proxy = Proxy(server.port)
        listener = await asyncio.start_server(proxy.serve, "127.0.0.1", 0)
        proxy.whole.set()
        proxy.port = listener.sockets[0].getsockname()[1]
        paced = PacedRobot(simulation, service, proxy)
        service.stepped.observers = (paced.observe,)
        try:
            async with at_the_pace_of_the_clock(server.url, stepper):
                yield paced
        finally:
            listener.close()
            proxy.restore()


@asynccontextmanager
async def at_the_pace_of_the_clock(url: str, token: str = "") -> AsyncIterator[None]:
    """Step a robot in lockstep as time passes."""
    pacing = asyncio.create_task(_pace(url, token))
    try:
        yield
    finally:
        pacing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await pacing


async def _pace(url: str, token: str) -> None:
    """Step the robot a tick each 20 ms; time that was lost is lost."""
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    async with connect(
        url, additional_headers=headers, compression=None, ping_interval=None, proxy=None
    ) as connection:
        client, loop = Peer(connection), asyncio.get_running_loop()
        due = loop.time()
        while True:
            await client.step()
            client.received.clear()
            client.frames.clear()
            due = max(due + TICK, loop.time())
            await asyncio.sleep(due - loop.time())
