"""Rows on driving straight, standing on slopes and following steps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.validation.drive_bench import BENCH, STEP, DriveBench, ramped
from robot_sim.validation.planar_model import PLANAR_STEP, step_response
from robot_sim.validation.row import Row, reported
from robot_sim.validation.turning_rows import WEIGHED, ballasted

STRONG = 15.0
"""Motor torque limit for the step responses [N m]."""


def straight() -> Iterator[Row]:
    """Yield how straight the robot drives, and the distance over what its wheels turn."""
    group, robot = "Straight", P3AT()
    rate = 0.7 / robot.rolling_radius
    run = DriveBench(robot).run(ramped(rate, rate, 30.0, ramp=1.0))
    aside = 1e3 * float(np.abs(run.positions[:, 1]).max())
    turned = math.degrees(float(np.abs(run.yaws).max()))
    yield Row(group, "sideways in 30 s at 0.7 m/s", 0.0, 1.0, aside, unit="mm", source="symmetry")
    yield Row(
        group,
        "turned in 30 s at 0.7 m/s",
        0.0,
        0.01,
        turned,
        unit="deg",
        source="symmetry",
        digits=4,
    )
    settled = run.after(2.0)
    rolled = float(settled.positions[-1, 0] - settled.positions[0, 0])
    angle = float((settled.wheel_angles[-1] - settled.wheel_angles[0]).mean())
    yield Row(
        group,
        "rolled over wheel angle x unloaded radius",
        0.9975,
        0.0025,
        rolled / (angle * robot.wheel_radius),
        source="0.995 to 1.000: the tyre is compressed by a millimetre",
        digits=4,
    )
    yield Row(
        group,
        "rolled over encoder distance",
        1.0,
        0.0005,
        rolled / (angle * robot.rolling_radius),
        source="the firmware uses the loaded radius",
        digits=5,
    )


def slopes() -> Iterator[Row]:
    """Yield the creep on slopes with the wheels held."""
    cases = (
        ("20 deg, facing up", math.radians(20.0), 0.0),
        ("20 deg, facing down", math.radians(-20.0), 0.0),
        ("15 deg to the side", 0.0, math.radians(15.0)),
    )
    for name, pitch, roll in cases:
        run = DriveBench(P3AT(), pitch=pitch, roll=roll).run(ramped(0.0, 0.0, 10.0)).after(2.0)
        moved = run.positions[-1, :2] - run.positions[0, :2]
        speed = 1e3 * float(np.hypot(*moved)) / float(run.times[-1] - run.times[0])
        source = "regularised friction always creeps; limit chosen"
        yield Row(
            "Slopes", f"creep, wheels held, {name}", 0.0, 1.0, speed, unit="mm/s", source=source
        )


def responses() -> Iterator[Row]:
    """Yield the responses to a step of speed and one of yaw rate, without the drivetrain's ramps."""
    robot = replace(ballasted(P3AT(), WEIGHED), wheel_torque=STRONG)
    speed = 0.5 / robot.rolling_radius
    turn = 0.5 * robot.effective_track / robot.rolling_radius
    yield from _response(robot, "speed step to 0.5 m/s", speed, speed, 0)
    yield from _response(robot, "yaw step to 1 rad/s", -turn, turn, 2)


def _response(robot: SkidSteer, name: str, left: float, right: float, column: int) -> Iterator[Row]:
    bench = DriveBench(robot)
    expected = step_response(robot, bench.inertia, BENCH.mu_long, left, right, 1.0)[:, column]
    values = bench.run(ramped(left, right, 2.0, ramp=0.0), fine=True).twists[:, column]
    final, late = float(values[-1]), values[-len(values) // 4 :]
    over = 100.0 * max(0.0, float(values.max()) / final - 1.0)
    ripple = 100.0 * float(np.ptp(late)) / final
    yield Row(
        "Steps",
        f"{name}, overshoot",
        0.0,
        1.0,
        over,
        unit="%",
        source="target 0, limit chosen",
        digits=2,
    )
    yield Row(
        "Steps",
        f"{name}, ripple after 1.5 s",
        0.0,
        1.0,
        ripple,
        unit="%",
        source="limit chosen",
        digits=4,
    )
    for share, title in ((0.632, "t63"), (0.9, "t90")):
        target = 1e3 * _reached(expected, share, PLANAR_STEP)
        found = 1e3 * _reached(values, share, STEP)
        source = "planar model without pitch; no log of a real robot was available"
        yield reported(
            "Steps", f"{name}, {title}", target, found, unit="ms", source=source, digits=0
        )


def _reached(values: FloatArray, share: float, step: float) -> float:
    """Return the time at which a response first reaches a share of its final value [s]."""
    return float(np.argmax(values >= share * values[-1])) * step
