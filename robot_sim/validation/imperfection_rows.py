"""Rows on imperfections: each must change the motion as theory predicts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from robot_sim.robot.imperfections import MANDOW_2007, Imperfections
from robot_sim.robot.mujoco_body import SERVO_DAMPING
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.validation import friction_theory
from robot_sim.validation.drive_bench import BENCH, DriveBench, ramped
from robot_sim.validation.row import Row, within

_GROUP = "Imperfections"
STICTION = 1.5
"""Dry friction for the dead band [N m]."""


def radii() -> Iterator[Row]:
    """Yield distance and curvature of a robot with uneven tyres that is commanded straight ahead."""
    robot = replace(P3AT(), imperfections=MANDOW_2007)
    rate = 0.4 / robot.rolling_radius
    run = DriveBench(robot).run(ramped(rate, rate, 14.0)).after(2.0)
    believed = float((run.wheel_angles[-1] - run.wheel_angles[0]).mean()) * robot.rolling_radius
    steps = np.diff(run.positions[:, :2], axis=0)
    driven = float(np.hypot(*steps.T).sum())
    left, right = robot.true_rolling_radius("left"), robot.true_rolling_radius("right")
    source = "rolling radii 0.9464 and 0.9253 (Mandow et al., IROS 2007, attributed)"
    expected = 0.5 * (left + right) / robot.rolling_radius
    name = "path over encoder distance, uneven tyres"
    yield within(_GROUP, name, expected, 0.005, driven / believed, source=source, digits=4)
    ratio = friction_theory.published_chi((left + right) / (right - left))
    bend = (right - left) / (0.5 * (left + right)) / (ratio * robot.track)
    value = float(run.yaws[-1] - run.yaws[0]) / driven
    name = "curvature when commanded straight, uneven tyres"
    source = "the same radii, with chi of Wang's curve"
    yield within(_GROUP, name, bend, 0.05, value, unit="1/m", source=source, digits=4)


def dead_band() -> Iterator[Row]:
    """Yield the response to small commands in place with sticky gears and no integral control."""
    sticky = Imperfections(stiction=STICTION, integral_control=False)
    robot = replace(P3AT(), imperfections=sticky)
    threshold = (friction_theory.spin_torque(robot, BENCH.mu_long) + STICTION) / SERVO_DAMPING
    source = "(spin torque + stiction) / servo gain"
    for share, expected in ((0.25, 0.0), (0.5, 0.0), (2.0, 0.5), (4.0, 0.75)):
        value = _obeyed(robot, share * threshold)
        name = f"yaw rate over commanded in place, at {share:g} of the dead band"
        yield Row(_GROUP, name, expected, 0.05, value, source=source)
    value = _obeyed(replace(robot, imperfections=Imperfections()), 0.5 * threshold)
    yield Row(
        _GROUP,
        "the same at 0.5, without imperfections",
        1.0,
        0.05,
        value,
        source="integral control",
    )


def _obeyed(robot: SkidSteer, rate: float) -> float:
    run = DriveBench(robot).run(ramped(-rate, rate, 4.0)).after(2.0)
    commanded = 2.0 * rate * robot.rolling_radius / robot.effective_track
    turned = float(run.yaws[-1] - run.yaws[0]) / float(run.times[-1] - run.times[0])
    return turned / commanded
