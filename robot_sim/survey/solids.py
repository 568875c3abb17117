"""Solids of a world: which of them a point lies in."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.raycasting.ray_caster import static_geoms
from robot_sim.raycasting.shape_intersection import TypeArray
from robot_sim.robot.drivable_surfaces import drivable_names
from robot_sim.robot.mujoco_body import ROBOT_GROUP
from robot_sim.worlds.world import World

_HEIGHTS: Final = (0.05, 0.2, 0.4)
"""Heights above the ground at which a point is looked for in a solid [m]: up to that of the robot."""
_GEOM: Final = mujoco.mjtGeom


class Solids:
    """The static boxes, cylinders, capsules, spheres and ellipsoids of a world that the robot collides with."""

    def __init__(self, world: World) -> None:
        model = world.model
        solid = static_geoms(model) & (model.geom_group != ROBOT_GROUP)
        solid &= (model.geom_contype | model.geom_conaffinity) != 0
        solid[[model.geom(name).id for name in drivable_names(model)]] = False
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        self._geoms = np.flatnonzero(solid)
        self._names: list[str] = [model.geom(g).name for g in self._geoms]
        self._kinds = model.geom_type[self._geoms]
        self._sizes = model.geom_size[self._geoms]
        self._places = data.geom_xpos[self._geoms]
        self._axes = data.geom_xmat[self._geoms].reshape(-1, 3, 3)

    def around(self, x: float, y: float, ground: float) -> str:
        """Return the name of a solid at x, y on the ground [m] that is in the robot's way; empty without any."""
        for height in _HEIGHTS:
            offsets = np.array([x, y, ground + height]) - self._places
            local = np.einsum("gij,gi->gj", self._axes, offsets)
            inside = np.flatnonzero(_inside(self._kinds, self._sizes, local))
            if len(inside):
                return self._names[int(inside[0])]
        return ""


def _inside(kinds: TypeArray, sizes: FloatArray, points: FloatArray) -> BoolArray:
    """Return which shapes (G,) contain their points (G, 3), given in their frames; never a mesh."""
    a, b, c = sizes.T
    x, y, z = points.T
    across = np.hypot(x, y)
    beyond = np.maximum(np.abs(z) - b, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        tests = {
            _GEOM.mjGEOM_BOX: (np.abs(x) <= a) & (np.abs(y) <= b) & (np.abs(z) <= c),
            _GEOM.mjGEOM_CYLINDER: (across <= a) & (np.abs(z) <= b),
            _GEOM.mjGEOM_CAPSULE: np.hypot(across, beyond) <= a,
            _GEOM.mjGEOM_SPHERE: np.hypot(across, z) <= a,
            _GEOM.mjGEOM_ELLIPSOID: (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 <= 1.0,
        }
    inside = np.zeros(len(kinds), dtype=bool)
    for kind, test in tests.items():
        inside |= (kinds == int(kind)) & test
    return inside
