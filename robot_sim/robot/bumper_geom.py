"""What movers shove: a box round the robot, and how softly they meet it."""

from __future__ import annotations

from typing import Final

import mujoco

from robot_sim.robot.mujoco_body import ROBOT_GROUP
from robot_sim.robot.skid_steer_parameters import SkidSteer

MOVER_BIT: Final = 4
"""Collision bit of movers: they meet the robot's fender and nothing else."""
BUMPER: Final = "fender"
"""A box round the robot, wheels included, that movers shove; with single parts they would get
stuck between wheel and chassis."""
YIELDING: Final = (0.15, 1.0)
"""Time constant [s] and damping ratio of contacts with movers. As hard as walls are (0.02 s), a mover
would drive a robot it has cornered through the wall. With these the push grows by 2.4 kN per metre of
overlap: 8 cm shove 30 kg off their tyres, and no wall feels it."""
_GIVE: Final = (0.1, 0.1, 0.001, 0.5, 2.0)
"""Impedance of those contacts: low, so that movers which squeeze the robot from two sides push no
harder than one that pushes from one side."""


def add_bumper(spec: mujoco.MjSpec, robot: SkidSteer) -> None:
    """Give the robot in a specification what movers shove."""
    bottom, top = robot.clearance, robot.height
    half_width = 0.5 * robot.track + robot.wheel_half_width
    spec.body("base_link").add_geom(
        name=BUMPER,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=(0.0, 0.0, 0.5 * (bottom + top)),
        size=(0.5 * robot.length, half_width, 0.5 * (top - bottom)),
        mass=0.0,
        group=ROBOT_GROUP,
        contype=0,
        conaffinity=MOVER_BIT,
        rgba=(0.0, 0.0, 0.0, 0.0),
    )


def make_yielding(geom: mujoco.MjsGeom) -> None:
    """Let a mover's geom meet the fender and nothing else, softly."""
    geom.contype, geom.conaffinity = MOVER_BIT, 0
    # Priority makes the mover's contact parameters hold.
    geom.priority = 1
    geom.solref = YIELDING
    geom.solimp = _GIVE
