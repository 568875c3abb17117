"""Total station: measures a world's static surfaces from a tripod, along any rays, without error.

Panes are looked through and mirrors give no points, as if a surveyor removed them from the cloud; people,
carts and door leaves are absent during the survey.
"""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.raycasting import Hits, caster_for
from robot_sim.raycasting.ray_caster import static_geoms
from robot_sim.scene_objects.materials import material_named
from robot_sim.worlds.world import World

_STEP: Final = 1e-5
"""Distance behind a passed surface at which a ray continues [m]."""
_MOST_PASSED: Final = 8
"""Greatest number of panes that a ray passes."""
_PROBE: Final = 0.6
"""Height above the previous ground from which the ground is searched [m]."""
_STEEPEST: Final = 1.2
"""Depth below the previous ground to which it is searched [m]."""


class TotalStation:
    """Measures distances in a world."""

    def __init__(self, world: World) -> None:
        self._model = world.model
        data = mujoco.MjData(world.model)
        mujoco.mj_forward(world.model, data)
        self._caster = caster_for(world, data)
        n = world.model.ngeom
        materials = [material_named(_material(world.model, i)) for i in range(n)]
        # The last element is for rays without a hit.
        self._passed = np.zeros(n + 1, dtype=bool)
        self._passed[:n] = [m.transmittance > 0.0 for m in materials]
        self._passed[:n] |= ~static_geoms(world.model)
        self._mirrors = np.zeros(n + 1, dtype=bool)
        self._mirrors[:n] = [m.specular > 0.0 and m.transmittance == 0.0 for m in materials]

    def look(self, eyes: FloatArray, directions: FloatArray, reach: float) -> Hits:
        """Return the hits of rays that leave a point in a cloud.

        Args:
            eyes: (N, 3) origins of the rays in ``map`` [m].
            directions: (N, 3) unit vectors.
            reach: Greatest distance [m].
        """
        times = np.zeros(len(eyes), dtype=np.int64)
        hits = self._caster.hits(eyes, directions, times, reach)
        distances, geoms = hits.distances.copy(), hits.geoms.copy()
        cosines = hits.cosines.copy()
        for _ in range(_MOST_PASSED):
            through = np.flatnonzero(self._passed[geoms])
            if not len(through):
                break
            gone = distances[through] + _STEP
            more = self._caster.hits(
                eyes[through] + gone[:, None] * directions[through],
                directions[through],
                times[through],
                reach,
            )
            distances[through] = gone + more.distances
            geoms[through], cosines[through] = more.geoms, more.cosines
        nothing: BoolArray = self._passed[geoms] | self._mirrors[geoms] | (distances > reach)
        distances[nothing], geoms[nothing], cosines[nothing] = np.inf, -1, 0.0
        return Hits(distances, geoms, cosines)

    def ground(self, line: FloatArray, height: float) -> FloatArray:
        """Return the height (N,) of the ground [m] along a line (N, 2) of close points.

        It is followed from point to point, so that roofs and table tops are not taken for ground; where
        no ground is found it is assumed to continue level.

        Args:
            line: Points less than half a metre apart [m].
            height: Approximate height of the ground at the first point [m].
        """
        heights = np.empty(len(line))
        down = np.array([[0.0, 0.0, -1.0]])
        for i, (x, y) in enumerate(line):
            eye = np.array([[x, y, height + _PROBE]])
            below = float(self.look(eye, down, _PROBE + _STEEPEST).distances[0])
            if np.isfinite(below):
                height += _PROBE - below
            heights[i] = height
        return heights


def _material(model: mujoco.MjModel, geom: int) -> str:
    material = int(model.geom_matid[geom])
    return str(model.mat(material).name) if material >= 0 else ""
