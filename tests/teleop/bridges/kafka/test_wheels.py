"""Commands through a broker drive the wheels of the simulated robot, one after the other."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from robot_sim import TICK_NS, Simulation, SimulationConfig, World
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.drive import Drive
from teleop.robot.topics.topic_table import latched_messages
from teleop.ros_types import registry
from teleop.rosbridge import ClientLimits, Protocol, Server
from tests.teleop.bridges.kafka.support import bridge, sender
from tests.teleop.bridges.support import Broker
from tests.teleop.support import in_a_loop


@dataclass
class Driven:
    """A robot that drives and talks, and does not localise; time passes when nothing else happens."""

    drive: Drive
    adapter: RosbridgeAdapter
    server: Server
    way: list[tuple[float, float]] = field(default_factory=list)
    """After each tick the true distance from the start [m] and the true angle turned [rad]."""

    async def run(self) -> None:
        """Let its time pass, at most four times as fast as the clock's."""
        start = self.drive.simulation.truth().map_from_base
        while True:
            record = self.drive.tick(self.drive.simulation.stamp, self.adapter.wishes.take())
            self.adapter.driven(record)
            self.server.protocol.timers.tick(record.stamp)
            now = self.drive.simulation.truth().map_from_base
            moved = float(np.linalg.norm(now.position[:2] - start.position[:2]))
            self.way.append((moved, math.remainder(now.yaw - start.yaw, math.tau)))
            await asyncio.sleep(TICK_NS / 4e9)


@asynccontextmanager
async def driven(world: World, cloud: Cloud) -> AsyncIterator[Driven]:
    simulation = Simulation(world, seed=0, config=SimulationConfig(scanners=()))
    protocol = Protocol(registry(), limits=ClientLimits.unhurried())
    server = Server(protocol, port=0, clock=lambda: simulation.stamp, lockstep=True)
    latched = latched_messages(cloud, world.robot, simulation.mounts)
    adapter = RosbridgeAdapter(server, latched, undo_memory=0, round_trips=lambda client: None)
    robot = Driven(Drive(simulation), adapter, server)
    async with server:
        running = asyncio.create_task(robot.run())
        try:
            yield robot
        finally:
            running.cancel()
            with suppress(asyncio.CancelledError):
                await running


@in_a_loop
async def test_two_commands_drive_the_wheels_of_the_robot_in_order(
    tansu: Broker, topic: str, tmp_path: Path, office: World, office_cloud: Cloud
) -> None:
    async with (
        driven(office, office_cloud) as robot,
        bridge(tansu.address, robot.server.url, topic, tmp_path) as running,
        sender(tansu.address, topic) as glasses,
    ):
        await running.reads()
        await glasses.send(distance=0.1, movement="up")
        await glasses.send(angle=15, movement="left")
        results = await glasses.results(2)
    assert [(r["offset"], r["outcome"]) for r in results] == [(0, "done"), (1, "done")]
    assert results[0]["distance"] == pytest.approx(0.1, abs=0.005)
    assert math.degrees(results[1]["angle"]) == pytest.approx(15.0, abs=0.5)
    moved, turned = robot.way[-1]
    assert moved == pytest.approx(0.1, abs=0.02)
    assert math.degrees(turned) == pytest.approx(15.0, abs=1.0)
    begun = next(n for n, (_, turned) in enumerate(robot.way) if abs(turned) > math.radians(3.0))
    assert robot.way[begun][0] == pytest.approx(0.1, abs=0.02), "the turn begins behind the way"
