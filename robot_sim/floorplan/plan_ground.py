"""Ground of a floor plan: its height at any point, and the pose of the robot standing on it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias

import numpy as np

from localization.types import Pose
from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import NO_FLOOR, Placement, Plan
from robot_sim.scene_objects.terrain import Terrain, grid_heights

Heights: TypeAlias = Callable[[FloatArray], FloatArray]
"""Returns the height (N,) [m] of the ground at points (N, 2) [m]; -inf where there is none."""


class PlanGround:
    """Height of the highest drivable surface at any point of a plan: floor, slabs and terrains."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._level = -np.inf if plan.floor == NO_FLOOR else 0.0
        self.grids: tuple[tuple[Terrain, FloatArray], ...] = tuple(
            (terrain, terrain.grid()) for terrain in plan.terrains
        )

    @property
    def flat(self) -> bool:
        """Whether the floor is the only drivable surface."""
        return not (self.grids or self._plan.slabs)

    def heights(self, points: FloatArray) -> FloatArray:
        """Return the height (N,) [m] at (N, 2) ``points`` [m]; -inf where there is no ground."""
        height = np.full(len(points), self._level)
        for slab in self._plan.slabs:
            height = np.maximum(height, slab.heights(points))
        for terrain, grid in self.grids:
            height = np.maximum(height, grid_heights(terrain, grid, points))
        return height

    def lowest(self, points: Iterable[tuple[float, float]]) -> float:
        """Return the lowest height [m] of the ground under an object's points; 0 without ground."""
        if self.flat:
            return 0.0
        low = float(self.heights(np.array(list(points))).min())
        return low if np.isfinite(low) else 0.0


def height_at(heights: Heights, x: float, y: float) -> float:
    """Return the height of the ground at a point [m]; 0 where there is none."""
    height = float(heights(np.array([[x, y]]))[0])
    return height if np.isfinite(height) else 0.0


def stand_on(
    heights: Heights,
    placement: Placement,
    wheelbase: float,
    track: float,
) -> Pose:
    """Return ``map_from_base`` of a robot that stands on its four wheels at a placement.

    Its floor plane is fitted to the ground under the wheels and raised until no wheel is below ground.

    Args:
        heights: Function from (N, 2) points [m] to ground heights (N,) [m]; -inf without ground.
        placement: Position and yaw.
        wheelbase: Distance of the front from the rear wheels [m].
        track: Distance of the left from the right wheels [m].

    Raises:
        WorldError: there is no ground under a wheel.
    """
    here = Pose.planar(placement.x, placement.y, placement.yaw)
    wheels = 0.5 * np.array([[sx * wheelbase, sy * track, 0.0] for sx in (1, -1) for sy in (1, -1)])
    height = heights(here.apply(wheels)[:, :2])
    if not np.isfinite(height).all():
        raise WorldError(f"at x {placement.x:.2f}, y {placement.y:.2f} there is no ground")
    if not height.any():
        return here
    plane = np.column_stack([wheels[:, :2], np.ones(4)])
    (along, across, middle), *_ = np.linalg.lstsq(plane, height, rcond=None)
    middle += (height - plane @ (along, across, middle)).max()
    return Pose.from_euler(
        (placement.x, placement.y, middle),
        roll=float(np.arctan(across * np.cos(np.arctan(along)))),
        pitch=-float(np.arctan(along)),
        yaw=placement.yaw,
    )
