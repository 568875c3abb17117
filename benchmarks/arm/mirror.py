"""A second arm of servos beside the robot's: error at rest and delay, in lockstep and over a real serial line."""

from __future__ import annotations

import asyncio
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from benchmarks.common.figures import Figure
from localization.types import SECOND
from robot_sim import TICK_NS, Simulation, WorldOptions, load_world
from robot_sim.arm.arm_table import ArmTable, load_arm
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.servo import Resolution
from robot_sim.arm.servo_board import ServoBoard
from robot_sim.array_types import FloatArray
from teleop.bridges.servos.bridge import ARRAY, JOINT_DEGREES, MIRROR_DEGREES
from teleop.bridges.servos.servo_lines import Angles, LineReader, joint_line
from teleop.clock import monotonic
from teleop.robot.arm.mirror import ArmMirror
from teleop.ros_types import registry
from teleop.rosbridge import Client, Protocol, Server

POSES: Final = 200
"""Poses that the arm takes in lockstep."""
REAL_POSES: Final = 25
"""Poses over the real line."""
REST: Final = 1.5
"""Time in each pose [s]; the last half second counts as rest."""
STEP: Final = TICK_NS // 10
"""Steps in which time passes at the board [ns]; its answers are taken at their ends."""


@dataclass
class Found:
    """What a drive of poses has shown."""

    said: list[FloatArray] = field(default_factory=list)
    """Errors of the angles that came back, at rest, each (5,) [deg]."""
    true: list[FloatArray] = field(default_factory=list)
    """Errors of where the second arm's joints are, at rest, each (5,) [deg]."""
    tips: list[float] = field(default_factory=list)
    """Distances of the two tips, at rest [mm]."""
    behind: list[float] = field(default_factory=list)
    """Delays while it moves [s]."""
    states: dict[str, int] = field(default_factory=dict)
    """Ticks in each state."""


def mirror() -> Iterator[Figure]:
    """Yield errors and delays of a board with whole degrees and with microseconds, and over a real serial line."""
    for resolution in ("degree", "microsecond"):
        yield from _figures(f"lockstep, pulses of whole {resolution}s", _lockstep(resolution))
    yield from _figures("two programs, whole degrees", asyncio.run(_real()))


def _figures(case: str, found: Found) -> Iterator[Figure]:
    method, n = "second arm", len(found.said)
    said, true = np.abs(found.said), np.abs(found.true)
    for name, errors, goal in (("angles that came back", said, 1.5), ("its joints", true, None)):
        if errors.size:
            most, p95 = float(errors.max()), float(np.percentile(errors, 95))
            yield Figure(case, method, f"at rest, {name}: p95", p95, "deg", n, most=goal)
            yield Figure(case, method, f"at rest, {name}: max", most, "deg", n)
    if found.tips:
        rms = float(np.sqrt(np.mean(np.square(found.tips))))
        yield Figure(case, method, "at rest, tips apart: rms", rms, "mm", n)
    delays = 1e3 * np.array(found.behind)
    for q in (50, 95):
        value = float(np.percentile(delays, q))
        yield Figure(case, method, f"behind: p{q}", value, "ms", len(delays), most=60.0)
    for state, count in sorted(found.states.items()):
        share = 100.0 * count / sum(found.states.values())
        yield Figure(case, method, f"ticks `{state}`", share, "%", sum(found.states.values()))


def motion(table: ArmTable, poses: int, seed: int) -> Iterator[tuple[FloatArray, bool]]:
    """Yield wanted angles tick by tick, and whether the arm has been at rest for a second.

    Minimum-jerk motions to random poses ahead of the vehicle, as fast as the joints may or up to three times slower.
    """
    rng, kinematics = np.random.default_rng(seed), Kinematics(table)
    at = np.array(table.poses["stow"])
    for _ in range(poses):
        to = _pose(rng, table, kinematics)
        way = float(np.max(np.abs(to - at)))
        # Peaks of a minimum-jerk motion: 1.875 way/T and 5.774 way/T^2.
        least = max(
            1.875 * way / table.motion.speed, (5.774 * way / table.motion.acceleration) ** 0.5
        )
        ticks = round(least * rng.uniform(1.0, 3.0) / 0.02) + 1
        for n in range(1, ticks + 1):
            s = n / ticks
            yield at + (to - at) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2), False
        for n in range(round(REST / 0.02)):
            yield to, n * 0.02 >= REST - 0.5
        at = to


def _pose(rng: np.random.Generator, table: ArmTable, kinematics: Kinematics) -> FloatArray:
    base = table.mounts["bracket"].position
    while True:
        angles: FloatArray = rng.uniform(table.lower, table.upper)
        frames = kinematics.frames(angles)[2:, :3, 3] + base
        if frames[:, 2].min() > 0.08 and frames[:, 0].min() > base[0] - 0.02:
            return angles


def _lockstep(resolution: Resolution) -> Found:
    table, found = load_arm(), Found()
    simulation = Simulation(load_world("courtyard", options=WorldOptions(arm="s2")), seed=0)
    arm = simulation.arm
    assert arm is not None
    mirror, board, reader = ArmMirror(table), ServoBoard(table, resolution), LineReader()
    kinematics, stamp, touched = Kinematics(table), 0, False
    for wanted, rest in motion(table, POSES, seed=1):
        arm.command(wanted, 0.0)
        simulation.step()
        stamp += TICK_NS
        touched = (touched and not rest) or bool(arm.reading.touching)
        mirror.moved(stamp, arm.reading.angles)
        board.take(joint_line([*np.degrees(wanted), 0.0]))
        for after in range(STEP, TICK_NS + 1, STEP):
            for answer in reader.take(board.advance(STEP)):
                if isinstance(answer, Angles):
                    assert not mirror.take(stamp + after, answer.degrees, source="")
        _note(found, mirror, stamp, rest and not touched)
        if rest and not touched:
            own = arm.reading.angles
            found.true.append(np.degrees(board.angles - own))
            apart = kinematics.tip(board.angles) - kinematics.tip(own)
            found.tips.append(1e3 * float(np.linalg.norm(apart[:3, 3])))
    return found


def _note(found: Found, mirror: ArmMirror, now: int, rest: bool) -> None:
    state = mirror.state(now)
    if state is None:
        return
    found.states[state.status] = found.states.get(state.status, 0) + 1
    if rest:
        found.said.append(np.degrees(state.error))
    if state.behind and (not found.behind or found.behind[-1] != state.behind):
        found.behind.append(state.behind)


async def _real() -> Found:
    """Run the board and the bridge as programs of their own, at the pace of the clock."""
    table, found = load_arm(), Found()
    simulation = Simulation(load_world("courtyard", options=WorldOptions(arm="s2")), seed=0)
    arm = simulation.arm
    assert arm is not None
    mirror, touched = ArmMirror(table), False
    with tempfile.TemporaryDirectory() as folder:
        async with (
            Server(Protocol(registry()), port=0) as server,
            _program("servo-board", "--link", f"{folder}/board"),
            _program("servo-bridge", server.url, "--port", f"{folder}/board"),
            Client(server.url) as client,
        ):
            server.protocol.topics.advertise(JOINT_DEGREES, ARRAY)

            def back(message: dict[str, Any]) -> None:
                mirror.take(monotonic(), message["data"], source="")

            await client.subscribe(MIRROR_DEGREES, ARRAY, back)
            due = monotonic()
            for wanted, rest in motion(table, REAL_POSES, seed=2):
                arm.command(wanted, 0.0)
                simulation.step()
                degrees = np.array([*np.degrees(wanted), 0.0])
                server.protocol.topics.publish(JOINT_DEGREES, {"data": degrees}, server.now)
                mirror.moved(monotonic(), arm.reading.angles)
                touched = (touched and not rest) or bool(arm.reading.touching)
                if found.states or mirror.state(monotonic()) is not None:
                    _note(found, mirror, monotonic(), rest and not touched)
                due += TICK_NS
                await asyncio.sleep(max(0.0, (due - monotonic()) / SECOND))
    return found


@asynccontextmanager
async def _program(*words: str) -> AsyncIterator[None]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "teleop", *words, stdout=subprocess.PIPE, env={**os.environ}
    )
    assert process.stdout is not None
    while not re.search(rb"is at|sends angles|is connected", await process.stdout.readline()):
        assert process.returncode is None
    try:
        yield
    finally:
        process.terminate()
        await process.wait()
