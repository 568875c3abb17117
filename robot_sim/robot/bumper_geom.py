"""Bumper geom: the box around the robot that actors push, and how soft their contacts are."""

from __future__ import annotations

from typing import Final

import mujoco

from robot_sim.collision_bits import MOVER_BIT as MOVER_BIT, ROBOT_GROUP
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.robot.underbody import HULL_FRICTION

BUMPER: Final = "bumper"
"""Name of the box around the robot, wheels included, that movers push; between single parts of the
robot they would get stuck."""
YIELDING: Final = (0.15, 1.0)
"""Time constant [s] and damping ratio of contacts with movers. As hard as walls (0.02 s), a mover
would push a cornered robot through the wall. With these the force grows by 2.4 kN per metre of
overlap: 8 cm push 30 kg off their tyres, and no wall is affected."""
_GIVE: Final = (0.1, 0.1, 0.001, 0.5, 2.0)
"""Impedance of those contacts: low, so that movers that squeeze the robot from two sides push no
harder than one from one side."""
FIRM: Final = (0.05, 1.0)
"""Time constant [s] and damping ratio of contacts with boxes and doors that come at their time. The robot's motors
press it 1 cm into them."""


def add_bumper(spec: mujoco.MjSpec, robot: SkidSteer) -> None:
    """Add the box that movers push to the robot in a specification."""
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


def make_firm(geom: mujoco.MjsGeom) -> None:
    """Let a geom of a body that comes at its time collide as furniture does, but less hard."""
    geom.priority = 2  # above that of the hull, whose contact parameters would be used
    geom.friction = HULL_FRICTION
    geom.solref = FIRM


def make_yielding(geom: mujoco.MjsGeom) -> None:
    """Let a mover's geom collide with the bumper geom and an arm only, softly."""
    geom.contype, geom.conaffinity = MOVER_BIT, 0
    # With priority the mover's contact parameters are used.
    geom.priority = 1
    geom.solref = YIELDING
    geom.solimp = _GIVE
