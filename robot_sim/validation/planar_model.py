"""Planar model of step responses, integrated independently of MuJoCo: body, sides, four contacts.

Motors, gears and tyres follow the robot's parameters; friction is Coulomb's with a narrow viscous core.
Each contact carries a quarter of the load: the body does not pitch.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.drive.tyres import GRAVITY
from robot_sim.drive.wheel_slip import contact_positions, contact_slip
from robot_sim.robot.mujoco_body import SERVO_DAMPING, SERVO_STIFFNESS
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.validation.drive_bench import Inertia

PLANAR_STEP: Final = 1e-4
"""Time step of the integration [s]."""
_CORE: Final = 0.01
"""Slip speed below which friction is viscous [m/s]."""


def step_response(
    robot: SkidSteer, inertia: Inertia, friction: float, left: float, right: float, seconds: float
) -> FloatArray:
    """Return twists (S, 3), forward, left and yaw, after a step of the commanded wheel rates.

    Args:
        robot: Radii, servos and contacts.
        inertia: Masses and inertias.
        friction: Coulomb coefficient in all directions.
        left: Commanded rate of the left wheels [rad/s].
        right: Commanded rate of the right wheels [rad/s].
        seconds: Duration [s]; one sample per ``PLANAR_STEP``.
    """
    x, y = contact_positions(robot)
    radius, grip = robot.rolling_radius, friction * inertia.mass * GRAVITY / 4.0
    commanded = np.array([left, right, left, right])
    lead, rates, twist = np.zeros(4), np.zeros(4), np.zeros(3)
    twists = np.empty((round(seconds / PLANAR_STEP), 3))
    for i in range(len(twists)):
        twists[i] = twist
        along, across = contact_slip(twist[0], twist[1], twist[2], radius * rates, x, y)
        size = np.hypot(along, across) + _CORE
        fx, fy = -grip * along / size, -grip * across / size
        lead += (commanded - rates) * PLANAR_STEP
        torque = SERVO_STIFFNESS * lead - SERVO_DAMPING * rates
        torque = np.clip(torque, -robot.wheel_torque, robot.wheel_torque)
        rates = rates + (torque - radius * fx) / inertia.wheel * PLANAR_STEP
        vx, vy, turn = twist
        twist = twist + PLANAR_STEP * np.array(
            [
                fx.sum() / inertia.mass + turn * vy,
                fy.sum() / inertia.mass - turn * vx,
                (x * fy - y * fx).sum() / inertia.yaw,
            ]
        )
    return twists
