"""What the things of a plan cover of the floor, for whoever plans ways between them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from robot_sim.floorplan.plan import Plan, Wall
from robot_sim.layout.route_planning import Footprint
from robot_sim.scene_objects.furniture import size_of


def footprints(plan: Plan) -> Iterator[Footprint]:
    """Yield the outlines of walls, without their doors, and of furniture.

    A desk covers all that is beneath its top: a robot could drive under some, but has no business there.
    """
    for wall in plan.walls:
        yield from _solid_parts(wall)
    for piece in plan.furniture:
        width, depth, _ = size_of(piece)
        yield Footprint(piece.x, piece.y, (0.5 * width, 0.5 * depth), piece.yaw)


def _solid_parts(wall: Wall) -> Iterator[Footprint]:
    marks = [0.0]
    for door in sorted(wall.doors, key=lambda d: d.at):
        marks += [door.at - 0.5 * door.width, door.at + 0.5 * door.width]
    marks.append(wall.length)
    c, s = math.cos(wall.yaw), math.sin(wall.yaw)
    for low, high in zip(marks[::2], marks[1::2], strict=True):
        if high > low:
            middle = 0.5 * (low + high)
            yield Footprint(
                wall.start[0] + c * middle,
                wall.start[1] + s * middle,
                (0.5 * (high - low), 0.5 * wall.thickness),
                wall.yaw,
            )
