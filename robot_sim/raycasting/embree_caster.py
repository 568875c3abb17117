"""Ray caster with Embree for static geometry and closed forms for moving geometry."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.actors.movers import Mover
from robot_sim.array_types import FloatArray
from robot_sim.raycasting.embree_scene import StaticGeometry
from robot_sim.raycasting.moving_geoms import MovingGeoms
from robot_sim.raycasting.ray_caster import Hits


class EmbreeRayCaster:
    """Casts static geometry with Embree, and moving geometry in closed form at each ray's own time."""

    def __init__(
        self,
        static: StaticGeometry,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        movers: Sequence[Mover] = (),
    ) -> None:
        """Cast against the static geometry of ``model``, and moving geometry at its poses in time."""
        self._static = static
        self._moving = MovingGeoms(model, data, movers)

    def distances(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> FloatArray:
        """See ``RayCaster.distances``."""
        distances = self._static.cast(origins, directions, max_range).distances
        if len(self._moving):
            # What is behind static geometry needs no closed form.
            limits = np.minimum(distances, max_range)
            rays, at, _, _ = self._moving.cast(origins, directions, times, limits)
            distances[rays] = at
        return distances

    def hits(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> Hits:
        """See ``RayCaster.hits``."""
        met = self._static.cast(origins, directions, max_range)
        distances, geoms = met.distances, self._static.geoms(met)
        cosines = self._static.cosines(met, origins, directions)
        if len(self._moving):
            limits = np.minimum(distances, max_range)
            rays, at, owners, slopes = self._moving.cast(origins, directions, times, limits)
            distances[rays], geoms[rays], cosines[rays] = at, owners, slopes
        return Hits(distances, geoms, cosines)
