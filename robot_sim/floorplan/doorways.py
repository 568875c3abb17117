"""Doorways of a floor plan by name: where they are, and how large a leaf closes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from robot_sim.floorplan.plan import Plan, Wall
from robot_sim.scene_objects.glazing import Glazing


@dataclass(frozen=True, slots=True)
class Doorway:
    """An opening in a wall or a glass wall."""

    name: str
    """Name of the wall; if it has several doors, with the door's number from the wall's start on: ``north/2``."""
    x: float
    """x of its middle [m]."""
    y: float
    """y of its middle [m]."""
    yaw: float
    """Direction of the wall [rad]."""
    width: float
    """Width of the opening [m]."""
    height: float
    """Height of the opening [m]."""


def doorways(plan: Plan) -> Mapping[str, Doorway]:
    """Return the doorways of a plan by their names."""
    found: dict[str, Doorway] = {}
    walls: tuple[Wall | Glazing, ...] = (*plan.walls, *plan.glazings)
    for wall in walls:
        along = wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]
        yaw = math.atan2(along[1], along[0])
        for number, door in enumerate(sorted(wall.doors, key=lambda d: d.at), 1):
            name = wall.name if len(wall.doors) == 1 else f"{wall.name}/{number}"
            x, y = wall.start[0] + math.cos(yaw) * door.at, wall.start[1] + math.sin(yaw) * door.at
            found[name] = Doorway(name, x, y, yaw, door.width, door.height)
    return MappingProxyType(found)
