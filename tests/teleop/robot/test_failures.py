"""What may go wrong on the operator's side: none of it leaves the robot driving, or harms another."""

from __future__ import annotations

import asyncio
import json
import shlex
import signal
import socket
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.maps.map_files import save_cloud
from localization.types import SECOND
from robot_sim import TICK_NS
from teleop.__main__ import main
from teleop.robot.safety.control_state import SafetyConfig
from teleop.robot.serving.address import Address
from teleop.scenario.referee.outcome import ExitStatus
from teleop.scenario.session.run import run_scenario
from teleop.scenario.session.station import COMMAND
from teleop.scenario.tour.options import TourOptions, tour_scenario
from tests.teleop.robot.served_robots import meeting
from tests.teleop.support import (
    ROOT,
    InRealTime,
    Peer,
    Robots,
    command,
    drive,
    in_a_loop,
    peer,
    position_of,
    soon,
    stamp_of,
)

WATCHDOG = SafetyConfig().watchdog
FULL_SPEED = 0.68
"""The robot goes at 0.7 m/s, or nearly so [m/s]."""
STOPPING_DISTANCE = 0.35
"""From 0.7 m/s [m]."""
GARBAGE = (
    "",
    "{",
    "[]",
    "null",
    '{"op":"publish","topic":"/joy","msg":{"axes":[9e999,1],"buttons":[0,0,0,0,1]}}',
    '{"op":"publish","topic":"/joy","msg":{"axes":"full speed"}}',
    '{"op":"publish","topic":"/teleop/state","msg":{}}',
    '{"op":"call_service","service":"/sim/step","args":{"ticks":"all"}}',
    '{"op":"fire"}',
    "[" * 5000,
    "\ud7ff\u0000",
    b"\xff\xfe\x00",
    b"\x9f" * 100,
)


@pytest.fixture(scope="module")
def other_map(office_cloud: Cloud, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The office's cloud with a point missing: a different map."""
    path = tmp_path_factory.mktemp("maps") / "cloud.ply"
    points, normals = office_cloud.points[1:], office_cloud.normals[1:]
    save_cloud(replace(office_cloud, points=points, normals=normals), path)
    return path


# Lockstep: exact


async def at_full_speed(driver: Peer) -> None:
    await driver.subscribe("/ground_truth/odom", "/teleop/state")
    await drive(driver, 0.0, steps=1)
    await drive(driver, 1.0, steps=17)
    assert driver.speed > FULL_SPEED


@in_a_loop
async def test_garbage_from_another_client_does_not_disturb_the_driver(robots: Robots) -> None:
    async with meeting(robots(), 2) as (_, (driver, rude)):
        await at_full_speed(driver)
        for frame in GARBAGE:
            await rude.say(frame)
            answered = "/sim/step" in str(frame)  # with a refusal; all else with a status
            assert len(await rude.settle()) == (0 if answered else 1), frame
            await driver.joy(1.0)
            await driver.step(5)
            assert driver.speed > FULL_SPEED
            assert driver.last("/teleop/state")["linear"] == pytest.approx(0.7)
        assert await driver.settle() == []


@in_a_loop
async def test_garbage_from_the_driver_counts_as_silence(robots: Robots) -> None:
    """It counts as silence: after the watchdog's time the robot brakes."""
    async with robots() as rig, peer(rig.server.url) as driver:
        await at_full_speed(driver)
        last = rig.robot.simulation.stamp - 5 * TICK_NS  # of the tick that took the last Joy
        for n in range(75):
            await driver.say(GARBAGE[n % len(GARBAGE)])
            await driver.step(1)
        states = driver.messages("/teleop/state")
        moving = [stamp_of(m["header"]["stamp"]) for m in states if m["linear"]]
        assert moving[-1] - last <= WATCHDOG + TICK_NS
        assert abs(driver.speed) < 0.005
        assert driver.last("/teleop/state")["state"] == "disarmed"


# Real time: with real clocks, processes and signals


@asynccontextmanager
async def operator(url: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """Run an operator that drives ahead at 0.7 m/s, in a process of its own."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "tests.teleop.driver_process", url, cwd=ROOT
    )
    try:
        yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()


async def until_fast(watcher: Peer) -> None:
    await watcher.subscribe("/ground_truth/odom", "/teleop/state")
    await watcher.until(
        lambda: watcher.messages("/ground_truth/odom") and watcher.speed > FULL_SPEED
    )


async def until_at_rest(watcher: Peer) -> None:
    def resting() -> bool:
        return abs(watcher.speed) < 0.005 and not watcher.last("/teleop/state")["linear"]

    await watcher.until(resting)


class Stop:
    """How the robot stopped after a moment, as a watching client observed it."""

    def __init__(self, watcher: Peer, count_before: int) -> None:
        after = [o for o in watcher.received[count_before:] if o["op"] == "publish"]
        self.odometry: list[dict[str, Any]] = [
            o["msg"] for o in after if o["topic"] == "/ground_truth/odom"
        ]
        self.states = watcher.messages("/teleop/state")
        speeds = np.array([m["twist"]["twist"]["linear"]["x"] for m in self.odometry])
        slower = np.flatnonzero(speeds < 0.95 * speeds[0])
        self.onset = self.odometry[int(slower[0]) - 1]
        """The last message before the robot was seen to brake."""

    @property
    def delay(self) -> float:
        """From the moment to the onset [s]."""
        stamps = [stamp_of(m["header"]["stamp"]) for m in (self.odometry[0], self.onset)]
        return (stamps[1] - stamps[0]) / SECOND

    @property
    def distance(self) -> float:
        """From the onset to rest [m]."""
        way = position_of(self.odometry[-1]) - position_of(self.onset)
        return float(np.linalg.norm(way))

    @property
    def oldest_command(self) -> float:
        """Largest age of a command that the robot followed [s]."""
        return max(float(m["command_age"]) for m in self.states if m["linear"])


LONGEST = (WATCHDOG + TICK_NS) / SECOND
"""A command may be followed [s]."""
SLACK = 0.15
"""Of the watcher's view: messages come every 40 ms, and slowing by 5 % takes two ticks [s]."""


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
@pytest.mark.parametrize(
    ("end", "clients", "reason"),
    [(signal.SIGKILL, 1, "disconnected"), (signal.SIGSTOP, 2, "no command for 0.")],
    ids=["killed", "frozen"],
)
@in_a_loop
async def test_robot_stops_when_its_operator_is_killed_or_freezes_with_its_socket_open(
    end: signal.Signals,
    clients: int,
    reason: str,
    in_real_time: InRealTime,
) -> None:
    async with (
        in_real_time() as server,
        peer(server.url) as watcher,
        operator(server.url) as process,
    ):
        await until_fast(watcher)
        count = len(watcher.received)
        process.send_signal(end)
        await until_at_rest(watcher)
        await watcher.subscribe("/client_count")
        await watcher.until(lambda: watcher.messages("/client_count"))
        assert watcher.last("/client_count")["data"] == clients
        stop = Stop(watcher, count)
        assert stop.oldest_command <= LONGEST
        assert stop.delay <= LONGEST + SLACK
        assert stop.distance <= STOPPING_DISTANCE
        assert any(reason in m["reason"] for m in stop.states)
        if end == signal.SIGSTOP:
            # Awake again it sends full speed, and late pings; that alone starts nothing.
            process.send_signal(signal.SIGCONT)
            before = len(watcher.messages("/teleop/state"))
            await watcher.until(lambda: len(watcher.messages("/teleop/state")) >= before + 10)
            assert abs(watcher.speed) < 0.005


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
@in_a_loop
async def test_misbehaving_clients_do_not_disturb_the_driver(in_real_time: InRealTime) -> None:
    async with (
        in_real_time() as server,
        peer(server.url) as watcher,
        operator(server.url),
    ):
        await until_fast(watcher)
        for sin in (oversize_frame, half_a_message, torn_handshake, no_reading):
            before = len(watcher.messages("/teleop/state"))
            await sin(server)
            await until_published(watcher, "/teleop/state", before + 15)
            states = watcher.messages("/teleop/state")[before:]
            disturbed = [m for m in states if m["state"] != "armed" or m["linear"] <= FULL_SPEED]
            assert not disturbed, sin.__name__


async def until_published(watcher: Peer, topic: str, count: int) -> None:
    await watcher.until(lambda: len(watcher.messages(topic)) >= count)


async def oversize_frame(server: Address) -> None:
    async with peer(server.url) as sinner:
        await sinner.say("x" * 1_000_001)
        await soon(sinner.gone.wait())
        assert sinner.connection.close_code == 1009


async def half_a_message(server: Address) -> None:
    async with peer(server.url) as sinner:
        # A masked text frame of 4 kB, of which a few bytes come.
        sinner.connection.transport.write(b"\x81\xfe\x10\x00mask" + b"half of it")
        await asyncio.sleep(0.1)
        sinner.abort()
        await soon(sinner.gone.wait())


async def torn_handshake(server: Address) -> None:
    for request in (b"", b"GET / HT", b"\x16\x03\x01\x02\x00", b"GET / HTTP/1.1\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", server.port)) as raw:
            raw.sendall(request)


async def no_reading(server: Address) -> None:
    async with peer(server.url) as sinner:
        sinner.connection.transport.pause_reading()
        await sinner.subscribe("/local_cloud", "/scan", "/tf", "/imu/data", "/clock")
        await asyncio.sleep(1.0)
        sinner.abort()


# The command line: one line, and a status


BARE = ("--no-viewer",)


def one_line(text: str) -> str:
    (line,) = text.strip().splitlines()
    return line


INVALID = ("robot", "http://127.0.0.1:9090", "ws://", "ws://127.0.0.1:0x", "ws://[::1")


@pytest.mark.parametrize("url", INVALID)
def test_operate_rejects_an_invalid_address(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["operate", url, *BARE])
    out, err = capsys.readouterr()
    assert status == 2, err
    assert out.strip() == ""
    assert "ws://127.0.0.1:9090" in one_line(err)


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
@in_a_loop
async def test_operate_draws_no_map_of_another_hash_and_continues(
    other_map: Path,
    in_real_time: InRealTime,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The robot here serves no file, the operator's own is of another map, and it has downloaded none before."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    async with in_real_time() as server:
        words = ("operate", server.url, "--map", str(other_map), "--no-viewer", "--duration", "4")
        status, out, err = await command(*words, "--record", str(tmp_path / "drive.rrd"))
    assert (status, err.strip()) == (0, "")
    lines = [line.strip() for line in out.splitlines()]
    assert sum(line.startswith("no map is shown") for line in lines) == 1
    assert any(line.startswith("health: ") for line in lines), out


@pytest.mark.process
@pytest.mark.slow
def test_station_with_another_map_does_not_drive(other_map: Path, tmp_path: Path) -> None:
    scenario, _ = tour_scenario(TourOptions(duration=12.0))
    orders = {
        "speed": 0.6,
        "hint_stamp": SECOND,
        "recording": None,
        "camera": False,
        "hint_position": [0, 0, 0],
        "hint_quaternion_wxyz": [1, 0, 0, 0],
        "hint_covariance": [0.0] * 36,
    }
    told = f"FARSTEER_MAP={other_map} FARSTEER_STATION={shlex.quote(json.dumps(orders))}"
    outcome = run_scenario(scenario, tmp_path, client=f"{told} {COMMAND}", pace="lockstep")
    assert "both sides must have the same file" in outcome.ending
    assert "\n" not in outcome.ending
    assert outcome.figures["duration"] < 2.0
    assert outcome.status is ExitStatus.CLIENT_FAILED
