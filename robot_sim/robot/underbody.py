"""Underside of the robot: collision shapes that touch the ground when it bottoms out, tips or falls.

Two massless shapes, which collide with drivable surfaces only, model the underside. On level ground
they are near nothing and cost next to nothing. The chassis that collides with furniture is a plain box;
against a kerb that would be wrong, because its lower edge is ahead of the wheels.
"""

from __future__ import annotations

from typing import Final

import mujoco

from robot_sim.robot.skid_steer_parameters import SkidSteer

HULL_FRICTION: Final = (0.4, 0.002, 0.0001)
"""Friction of metal and of the tyres' sides on walls, furniture and ground: sliding; spinning and
rolling [m]. Chosen from handbooks' 0.3 to 0.6 for metal on stone; with 0.5 and more a wheel that
meets a wall at 45 degrees climbs it until the robot falls over."""
_BELLY_REACH: Final = 0.5
"""Length of the belly beyond each axle, in wheel radii: the wheels meet a step first. Chosen from
photographs."""
_NOSE_HEIGHT: Final = 1.25
"""Height above which the chassis has its full length, in wheel radii. Chosen from photographs."""

BELLY: Final = "belly"
"""Name of the shape between the wheels."""
NOSE: Final = "nose"
"""Name of the shape above the belly that overhangs at both ends."""


def add_underbody(base: mujoco.MjsBody, robot: SkidSteer, *, group: int, floor_bit: int) -> None:
    """Add the belly between the wheels and the nose above it, which overhangs at both ends."""
    reach = 0.5 * robot.wheelbase + _BELLY_REACH * robot.wheel_radius
    nose = min(_NOSE_HEIGHT * robot.wheel_radius, 0.5 * (robot.clearance + robot.height))
    shapes = (
        (BELLY, robot.clearance, min(reach, 0.5 * robot.length)),
        (NOSE, nose, 0.5 * robot.length),
    )
    for name, bottom, half_length in shapes:
        base.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=(0.0, 0.0, 0.5 * (bottom + robot.height)),
            size=(half_length, robot.inner_half_width, 0.5 * (robot.height - bottom)),
            mass=0.0,
            group=group,
            contype=floor_bit,
            conaffinity=floor_bit,
            # With priority its own friction is used, not the greater one of surface and hull.
            priority=1,
            friction=HULL_FRICTION,
            rgba=(0.0, 0.0, 0.0, 0.0),
        )
