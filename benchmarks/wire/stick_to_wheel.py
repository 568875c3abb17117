"""From the stick to the wheel in real time, through a robot that ``farsteer serve`` serves.

Clouds, scans and garbage, beside other servers, are in ``rosbridge``.
"""

from __future__ import annotations

import asyncio
import os
import platform
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.wire.served_robot import served_robot
from localization.types import Twist, WheelSpeeds
from robot_sim import P3AT, Simulation, load_world
from teleop.joystick import write_joy
from teleop.ros_types import registry
from teleop.rosbridge.client.client import Client

STARTS = 60
"""Times the stick is pushed from a standstill."""
TURNING = 0.15
"""Wheels turn for certain beyond this [rad/s]; their encoders make up to 0.1 of noise."""
MOVING = 0.0005
"""The robot moves in truth beyond this [m/s]: it takes one tick."""


@dataclass
class Starts:
    """What an operator sees after pushing the stick, each [s] after it."""

    moving: list[float] = field(default_factory=list)
    """The first /ground_truth/odom (25 Hz) that shows any motion."""
    turning: list[float] = field(default_factory=list)
    """The first /joint_states (50 Hz) whose wheels turn beyond the encoders' noise."""


def ramp() -> tuple[float, float]:
    """Return how long the robot itself takes for the same, in its own time [s]."""
    simulation = Simulation(load_world("office"), seed=0)
    for _ in range(50):
        simulation.step()
    simulation.command(Twist.planar(0.7, 0.0))
    moving = turning = 0.0
    for tick in range(1, 50):
        wheels = [r.left for r in simulation.step() if isinstance(r, WheelSpeeds)]
        if not moving and simulation.truth().twist.linear[0] > MOVING:
            moving = tick * 0.02
        if not turning and wheels and wheels[-1] > TURNING * P3AT().rolling_radius:
            turning = tick * 0.02
    return moving, turning


async def stick_to_wheel() -> Starts:
    """Push the stick again and again, on a robot that ``farsteer serve`` serves."""
    async with served_robot() as (url, _), Client(url, registry=registry()) as client:
        return await _starts(client)


async def _starts(client: Client) -> Starts:
    rng = np.random.default_rng(0)
    speed, seen = 1.0, {"moving": 0, "turning": 0}

    def odometry(message: dict[str, Any]) -> None:
        nonlocal speed
        speed = abs(message["twist"]["twist"]["linear"]["x"])
        if speed > MOVING:
            seen["moving"] = seen["moving"] or time.monotonic_ns()

    def wheels(message: dict[str, Any]) -> None:
        if np.abs(message["velocity"]).min() > TURNING:
            seen["turning"] = seen["turning"] or time.monotonic_ns()

    async def joy(speed: float) -> None:
        axes, buttons = write_joy(Twist.planar(speed, 0.0))
        await client.publish("/joy", {"axes": axes, "buttons": buttons})

    await client.advertise("/joy", "sensor_msgs/msg/Joy")
    await client.subscribe("/joint_states", "sensor_msgs/msg/JointState", wheels)
    await client.subscribe("/ground_truth/odom", "nav_msgs/msg/Odometry", odometry)
    starts = Starts()
    for n in range(STARTS):
        still = 0
        while still < 5:  # at rest; the operator keeps no step with the robot's ticks
            await joy(0.0)
            await asyncio.sleep(0.1 + rng.uniform(0.0, 0.02))
            still = still + 1 if speed < MOVING / 5 else 0
        seen.update(moving=0, turning=0)
        begun = time.monotonic_ns()
        await joy(0.7 if n % 2 else -0.7)
        async with asyncio.timeout(5.0):
            while not (seen["moving"] and seen["turning"]):  # noqa: ASYNC110
                await asyncio.sleep(0.005)
        starts.moving.append((seen["moving"] - begun) / 1e9)
        starts.turning.append((seen["turning"] - begun) / 1e9)
    await joy(0.0)
    return starts


def main() -> None:
    """Print the tables."""
    lines = [f"{platform.system()} loopback, {os.cpu_count()} cores"]
    starts, (moving, turning) = asyncio.run(stick_to_wheel()), ramp()
    lines += [
        f"  stick to wheel, `farsteer serve` in the office, {STARTS} starts; of which the robot itself takes:",
        "                                             p50 ms   p95 ms   p99 ms   itself ms",
    ]
    for name, times, own in (
        (f"moves ({1e3 * MOVING:.1f} mm/s), by 25 Hz odometry", starts.moving, moving),
        (f"turns ({TURNING} rad/s), by 50 Hz encoders", starts.turning, turning),
    ):
        p50, p95, p99 = np.percentile(np.array(times) * 1e3, [50, 95, 99])
        lines.append(f"  {name:40s} {p50:8.1f} {p95:8.1f} {p99:8.1f} {own * 1e3:11.0f}")
    sys.stdout.write("\n".join(lines) + "\n")
