"""The pose in which the robot stands on the ground at a given place, whatever the ground's height and slope."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

from localization.types import Pose
from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError
from robot_sim.robot.mujoco_body import FLOOR_BIT, WHEELS
from robot_sim.worlds.world import World

_ABOVE: Final = 2.0
"""Height above the ground at the spawn from which ground is looked for [m]: below ceilings."""
_BEYOND: Final = 1e-4
"""Distance behind a surface at which a ray continues [m]."""
_MOST_PASSED: Final = 100
"""Greatest number of surfaces that a ray passes."""
_DOWN: Final = np.array([0.0, 0.0, -1.0])


def standing_pose(world: World, x: float, y: float, heading: float) -> Pose:
    """Return ``map_from_base`` of a robot that stands on the ground.

    Args:
        world: The world, as it is at time zero.
        x: Position in ``map`` [m].
        y: Position in ``map`` [m].
        heading: Yaw in ``map`` [rad].

    Raises:
        WorldError: There is no ground under a wheel.
    """
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    # base_link is on the ground between the wheels (REP 105's base_footprint, for a robot on level ground).
    cos, sin = math.cos(heading), math.sin(heading)
    feet = np.array([world.model.body(name).pos[:2] for name in WHEELS])
    turned = feet @ np.array([[cos, sin], [-sin, cos]]) + (x, y)
    top = float(world.spawn.position[2]) + _ABOVE
    heights = np.array([_ground(world.model, data, foot, top) for foot in turned])
    if not np.isfinite(heights).all():
        raise WorldError(f"there is no ground for the robot at x {x:.6g}, y {y:.6g}")
    # The plane of least squares through the feet, in the robot's own directions: z = a + b forward + c left.
    plane = np.column_stack((np.ones(len(feet)), feet))
    a, b, c = np.linalg.lstsq(plane, heights, rcond=None)[0].tolist()
    return Pose.from_euler((x, y, a), roll=math.atan(c), pitch=-math.atan(b), yaw=heading)


def _ground(model: mujoco.MjModel, data: mujoco.MjData, foot: FloatArray, top: float) -> float:
    """Return the height of the highest drivable surface below ``top`` [m]; NaN without one."""
    start = np.array([foot[0], foot[1], top])
    geom = np.zeros(1, dtype=np.int32)
    for _ in range(_MOST_PASSED):
        distance = mujoco.mj_ray(model, data, start, _DOWN, None, 1, -1, geom, None)
        if geom[0] < 0:
            break
        if model.geom_contype[geom[0]] == FLOOR_BIT:
            return float(start[2] - distance)
        start[2] -= distance + _BEYOND
    return math.nan
