"""Footprints: the area of the floor that walls and furniture cover, for route planning."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.floorplan.plan import Plan, Wall
from robot_sim.scene_objects.furniture import size_of


@dataclass(frozen=True, slots=True)
class Footprint:
    """Area of the floor that an obstacle covers: a rectangle."""

    x: float
    """x of the centre [m]."""
    y: float
    """y of the centre [m]."""
    half: tuple[float, float]
    """Half extents [m]."""
    yaw: float = 0.0
    """Yaw of the rectangle [rad]."""

    def distance(self, points: FloatArray) -> FloatArray:
        """Return distances (...,) [m] of points (..., 2) from the edge; 0 inside."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        offset = points - (self.x, self.y)
        along = np.abs(offset[..., 0] * c + offset[..., 1] * s) - self.half[0]
        across = np.abs(offset[..., 1] * c - offset[..., 0] * s) - self.half[1]
        gap: FloatArray = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
        return gap


def footprints(plan: Plan) -> Iterator[Footprint]:
    """Yield the outlines of walls, without their doors, and of furniture.

    A desk covers the area beneath its top: a robot could drive under some desks, but is not meant to.
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
