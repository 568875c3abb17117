"""Triangle mesh of a world's static surfaces: the ground truth for judging a map."""

from __future__ import annotations

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.array_types import FloatArray
from robot_sim.raycasting.ray_caster import static_geoms, visible_geoms
from robot_sim.raycasting.triangle_mesh import triangles_of
from robot_sim.worlds.world import World


def static_mesh(world: World) -> tuple[FloatArray, IntArray]:
    """Return vertices (V, 3) in ``map`` [m] and triangles (F, 3) of all visible static geoms.

    Round geoms are polygons that are off by at most 0.02 mm, unless they are very large.
    """
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    geoms = np.flatnonzero(visible_geoms(world.model) & static_geoms(world.model))
    triangles = triangles_of(world.model, data, geoms)
    return triangles.vertices, triangles.faces
