"""Control beside others that hang or die: real processes, real sockets, real signals."""

from __future__ import annotations

import asyncio
import os
import select
import signal
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.types import SECOND, Health
from robot_sim import Simulation, World
from teleop import clock
from teleop.robot.assembly import latched_of
from teleop.robot.drive import Drive
from teleop.robot.inbox import DriveCommand
from teleop.robot.real_time.control_process import ControlProcess
from teleop.robot.real_time.process_messages import EstimatorSetup, GatewaySetup
from teleop.robot.safety.control_state import ControlMode
from teleop.robot.serve import start_estimator, start_gateway
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import DriveRecord
from tests.teleop.support import Peer, in_a_loop, peer

pytestmark = [pytest.mark.process, pytest.mark.slow]

WATCHDOG = SECOND // 2


@dataclass
class Robot:
    """A robot in real time whose ticks are kept."""

    process: ControlProcess
    address: Address
    ticks: list[tuple[int, DriveRecord]] = field(default_factory=list)
    """Time [ns] and record of each tick."""

    @property
    def speed(self) -> float:
        """Speed in force [m/s]."""
        return float(self.ticks[-1][1].control.twist.linear[0])

    @property
    def longest_gap(self) -> int:
        """Longest time between two ticks [ns]."""
        return int(np.diff([now for now, _ in self.ticks]).max())

    def last_command(self) -> int:
        """Return the arrival of the newest command [ns]."""
        return max(
            m.arrival or 0 for _, t in self.ticks for m in t.inbox if isinstance(m, DriveCommand)
        )

    def first_zero_after(self, when: int) -> int:
        """Return the time of the first tick after a time whose command is zero [ns]."""
        return next(now for now, t in self.ticks if now > when and not t.control.twist.linear.any())


@asynccontextmanager
async def robot(world: World, cloud: Cloud, cache: Path) -> AsyncIterator[Robot]:
    simulation = Simulation(world, seed=0)
    latched = latched_of(simulation, cloud, "run")
    config = ServeConfig(port=0, log_level="error")
    for_gateway = GatewaySetup(config, world.name, latched, None, SECOND)
    for_estimator = EstimatorSetup(cloud, simulation.mounts, cache, None, {}, 0.11)
    ended = threading.Event()

    def again() -> GatewaySetup:
        fixed = ServeConfig(port=address.port, log_level="error")
        return GatewaySetup(fixed, world.name, latched, None, SECOND)

    estimator = start_estimator().begin(for_estimator)
    await asyncio.to_thread(estimator.ready)
    process = ControlProcess(
        Drive(simulation),
        start_gateway().begin(for_gateway),
        estimator,
        restart_gateway=lambda: start_gateway().begin(again()),
        restart_estimator=lambda: start_estimator().begin(for_estimator),
    )
    try:
        address = await asyncio.to_thread(process.ready)
        served = Robot(process, address)

        def run() -> None:
            for beat in clock.beats(ended):
                served.ticks.append((beat.now, process.tick(beat.now)))

        driving = asyncio.create_task(asyncio.to_thread(run))
        try:
            yield served
        finally:
            ended.set()
            await driving
    finally:
        process.end()


async def drive_until(client: Peer, served: Robot, speed: float) -> None:
    """Show a neutral stick, and hold it ahead until the command is in force."""
    await client.joy(0.0)
    await asyncio.sleep(0.1)  # of two commands in a tick only the newer one counts
    async with asyncio.timeout(60.0):
        while served.speed < speed:
            await client.joy(1.0)
            await asyncio.sleep(0.05)


async def until(true: Callable[[], object]) -> None:
    """Wait for what the ticks of another thread bring about."""
    async with asyncio.timeout(60.0):
        while not true():  # noqa: ASYNC110
            await asyncio.sleep(0.02)


def kill(process: int) -> int:
    """Kill a process and return when it has ended [ns]: the system takes a while to close its connections."""
    ends = os.pidfd_open(process)
    try:
        os.kill(process, signal.SIGKILL)
        assert select.select([ends], [], [], 60.0)[0]
        return clock.monotonic()
    finally:
        os.close(ends)


@in_a_loop
async def test_robot_brakes_and_gets_a_new_server_when_the_server_is_killed(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with robot(office, office_cloud, cache) as served:
        async with peer(served.address.url) as client:
            await drive_until(client, served, 0.6)
            before = clock.monotonic()
            ended = await asyncio.to_thread(kill, served.process.gateway.pid)
            await asyncio.wait_for(client.gone.wait(), 60.0)
            await until(lambda: not served.speed)
        zero = served.first_zero_after(before)
        ticks_until = [now for now, _ in served.ticks if ended < now <= zero]
        assert len(ticks_until) <= 2, "the end of the connection is noticed with the next tick"
        state = next(t for now, t in served.ticks if now == zero).control
        assert (state.control, state.reason) == (ControlMode.IDLE, "the server has ended")
        async with asyncio.timeout(60.0):
            while True:
                try:
                    async with peer(served.address.url) as client:
                        await client.joy(1.0)
                        await drive_until(client, served, 0.6)
                        break
                except OSError:
                    await asyncio.sleep(0.1)


@pytest.mark.long
@in_a_loop
async def test_watchdog_brakes_while_the_server_hangs_and_it_is_replaced(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with robot(office, office_cloud, cache) as served:
        async with peer(served.address.url) as client:
            await drive_until(client, served, 0.6)
            hung = served.process.gateway
            os.kill(hung.pid, signal.SIGSTOP)
            await until(lambda: not served.speed)
            last = served.last_command()
            delay = served.first_zero_after(last) - last
            assert delay <= WATCHDOG + served.longest_gap
            await until(lambda: served.process.gateway is not hung)
            state = served.ticks[-1][1].control
            assert state.controller == ""
        hung.kill()


@in_a_loop
async def test_hung_localiser_delays_estimates_and_no_command(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with robot(office, office_cloud, cache) as served, peer(served.address.url) as client:
        await client.subscribe("/odom", "/teleop/state")
        await client.until(lambda: client.messages("/odom"))
        os.kill(served.process.estimator.pid, signal.SIGSTOP)
        await asyncio.sleep(0.2)
        count, begun = len(client.messages("/odom")), len(served.ticks)
        await drive_until(client, served, 0.6)
        states = len(client.messages("/teleop/state"))
        await client.until(lambda: len(client.messages("/teleop/state")) > states + 5)
        assert len(client.messages("/odom")) <= count + 1
        missed = len(served.ticks) - begun
        os.kill(served.process.estimator.pid, signal.SIGCONT)
        await client.until(lambda: len(client.messages("/odom")) >= count + missed // 2 - 2)


@pytest.mark.long
@in_a_loop
async def test_killed_localiser_is_started_again_without_a_pose(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with robot(office, office_cloud, cache) as served, peer(served.address.url) as client:
        await client.subscribe("/localization/status")
        await client.until(lambda: client.messages("/localization/status"))
        killed = served.process.estimator
        os.kill(killed.pid, signal.SIGKILL)
        await drive_until(client, served, 0.6)
        await until(lambda: served.process.estimator is not killed)
        count = len(client.messages("/localization/status"))
        await client.until(lambda: len(client.messages("/localization/status")) > count + 2)
        assert client.last("/localization/status")["health"] == Health.WAITING
