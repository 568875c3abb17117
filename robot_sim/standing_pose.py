"""The pose in which the robot stands on the ground at a given place, whatever the ground's height and slope."""

from __future__ import annotations

from typing import Final

from localization.types import Pose
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan_ground import stand_on
from robot_sim.robot.drivable_surfaces import drivable_heights
from robot_sim.scene_objects.plan_elements import Placement
from robot_sim.worlds.world import World

_ABOVE: Final = 2.0
"""Height above the ground at the spawn from which ground is looked for [m]: below ceilings."""


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
    heights = drivable_heights(world.model, float(world.spawn.position[2]) + _ABOVE)
    robot = world.robot
    try:
        return stand_on(heights, Placement(x, y, heading), robot.wheelbase, robot.track)
    except WorldError:
        raise WorldError(f"there is no ground for the robot at x {x:.6g}, y {y:.6g}") from None
