"""How driving ends: with a zero command, whatever clients still want."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from localization.logs.open_log import open_log
from localization.types import WheelSpeeds
from robot_sim import Simulation, World
from teleop import clock
from teleop.robot.drive import Drive
from teleop.robot.real_time.channel import Channel, ChannelClosedError
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.control_process import ControlProcess
from teleop.robot.real_time.process_messages import OTHER, Wanted, pack
from teleop.robot.tick_record import DriveRecord
from tests.teleop.robot.sticks import stick
from tests.teleop.support import peer


class Child:
    """The place of a child process: ends of a channel without a process behind it."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self.channel, self.other = Channel(ours, 2**20), Channel(theirs, 2**20)

    def close(self) -> None:
        self.channel.close()
        self.other.close()

    def as_process(self) -> ChildProcess:
        return cast("ChildProcess", SimpleNamespace(channel=self.channel, kill=lambda: None))


class Driving:
    """A control process in a thread, with a client that never stops sending velocities."""

    def __init__(self, world: World) -> None:
        self.gateway, self.estimator = Child(), Child()
        self.started_again: list[str] = []
        self.ticks: list[DriveRecord] = []
        self.stop = threading.Event()
        self.process = ControlProcess(
            Drive(Simulation(world, seed=0)),
            self.gateway.as_process(),
            self.estimator.as_process(),
            restart_gateway=lambda: self._again("gateway"),
            restart_estimator=lambda: self._again("estimator"),
        )
        tick = self.process.tick

        def kept(*args: Any) -> DriveRecord:
            self.ticks.append(record := tick(*args))
            if len(self.ticks) == 40:
                self.stop.set()
            self._want()
            return record

        cast("Any", self.process).tick = kept

    def _again(self, what: str) -> ChildProcess:
        self.started_again.append(what)
        raise AssertionError(f"{what} is started again")

    def _want(self) -> None:
        command = stick("a", 0.5, arrival=clock.monotonic(), stream=True, rested=True)
        with contextlib.suppress(ChannelClosedError):
            self.gateway.other.send(pack(OTHER, Wanted((command,))))

    def __enter__(self) -> Driving:
        return self

    def __exit__(self, *why: object) -> None:
        self.gateway.close()
        self.estimator.close()

    @property
    def speeds(self) -> list[float]:
        return [float(tick.control.twist.linear[0]) for tick in self.ticks]


@pytest.mark.slow
def test_last_commands_are_zero_and_the_robot_stands_whatever_a_client_still_wants(
    office: World,
) -> None:
    with Driving(office) as driving:
        driving.process.run(driving.stop)
    assert driving.speeds[39] == pytest.approx(0.5)
    assert set(driving.speeds[40:]) == {0.0}
    last = driving.ticks[-1]
    assert abs(last.truth.twist.linear[0]) < 0.01
    assert last.control.reason == "the robot is shut down"


@pytest.mark.slow
def test_processes_that_are_gone_at_the_end_are_not_started_again(office: World) -> None:
    with Driving(office) as driving:
        driving.stop.set()
        driving.gateway.other.close()
        driving.estimator.other.close()
        driving.process.run(driving.stop)
    assert driving.started_again == []
    assert driving.speeds[-1] == 0.0


@contextmanager
def served(log: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Serve a robot in a process of its own that obeys Ctrl-C; yield it, and its address."""
    robot = subprocess.Popen(
        [sys.executable, "-m", "teleop", "serve", "--port", "0", "--record", str(log)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert robot.stdout is not None
    with robot:
        try:
            line = robot.stdout.readline()
            yield robot, line.split()[-1]
        finally:
            if robot.poll() is None:
                robot.kill()


def processes(robot: subprocess.Popen[str]) -> dict[str, int]:
    """Return the numbers of a robot's processes by their names."""
    children = Path(f"/proc/{robot.pid}/task/{robot.pid}/children").read_text().split()
    numbers = (robot.pid, *map(int, children))
    return {Path(f"/proc/{each}/comm").read_text().strip(): each for each in numbers}


async def drive_into(robot: subprocess.Popen[str], url: str, number: int) -> None:
    """Drive for a second, send the signal, and go on sending velocities until the robot is gone."""
    async with peer(url) as client:
        await client.subscribe("/teleop/state")
        for sent in range(400):
            await client.publish("/cmd_vel", {"linear": {"x": 0.5}})
            await asyncio.sleep(0.05)
            states = client.messages("/teleop/state")
            if sent > 40 and states and states[-1]["linear"] > 0.4:
                break
        robot.send_signal(number)
        with contextlib.suppress(Exception):
            while robot.poll() is None:
                await client.publish("/cmd_vel", {"linear": {"x": 0.5}})
                await asyncio.sleep(0.05)


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signal_while_driving_leaves_a_robot_at_rest_in_its_log(
    number: signal.Signals, tmp_path: Path
) -> None:
    log = tmp_path / "drive.mcap"
    with served(log) as (robot, url):
        assert sorted(processes(robot)) == ["control", "estimator", "gateway"], "as ps shows them"
        asyncio.run(drive_into(robot, url, number))
        assert robot.wait(60.0) == 0
    wheels = [r for r in open_log(log) if isinstance(r, WheelSpeeds)]
    speeds = np.array([abs(w.left) for w in wheels])
    assert speeds.max() > 0.1, "it drove"
    assert max(abs(wheels[-1].left), abs(wheels[-1].right)) < 0.01
    assert np.all(np.diff(speeds[speeds.argmax() :]) < 0.02), "it is not driven on"


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
def test_record_goes_on_in_another_file_once_the_estimator_is_killed(tmp_path: Path) -> None:
    log = tmp_path / "drive.mcap"
    with served(log) as (robot, url):
        estimator = processes(robot)["estimator"]

        async def kill_and_drive() -> None:
            while log.stat().st_size < 50_000:  # noqa: ASYNC110 - until the first readings are on the disk
                await asyncio.sleep(0.1)
            os.kill(estimator, signal.SIGKILL)
            await drive_into(robot, url, signal.SIGINT)

        asyncio.run(kill_and_drive())
        assert robot.wait(60.0) == 0
    before, after = (
        [r for r in open_log(file) if isinstance(r, WheelSpeeds)]
        for file in (log, tmp_path / "drive-2.mcap")
    )
    assert before[-1].stamp < after[0].stamp
    steps = np.diff([r.stamp for r in after])
    assert set(steps.tolist()) == {20_000_000}, "control keeps them until there is an estimator"
    assert max(abs(r.left) for r in after) > 0.1
