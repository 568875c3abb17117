"""Ray caster with MuJoCo alone: slower, but without further dependencies."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.actors.movers import Mover
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.raycasting.moving_geoms import MovingGeoms
from robot_sim.raycasting.ray_caster import Hits, no_hits, static_geoms, visible_geoms

_SHOWN, _HIDDEN = 0, 1


class MujocoRayCaster:
    """Casts each ray from its own origin with ``mj_ray``.

    ``mj_multiRay`` takes one origin and one time per call and tests every geom in each, which costs ten
    times more for a moving scanner. ``mj_ray`` alone tests every geom for every ray; but the rays of a
    planar scanner stay near one plane, and most geoms are far from it, in particular for a vertical
    plane. Those are hidden first, by a bound that is conservative for any set of rays. Moving geometry
    is handled as in ``EmbreeRayCaster``.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, movers: Sequence[Mover] = ()
    ) -> None:
        """Cast against the geometry of ``model`` at its poses in ``data`` and those of the movers."""
        self._data = data
        # A copy, because the groups of its geoms are rewritten before each cast.
        self._model = copy.copy(model)
        self._static = visible_geoms(model) & static_geoms(model)
        self._half, self._bounded = _half_extents(model)
        self._groups = np.zeros(mujoco.mjNGROUP, dtype=np.uint8)
        self._groups[_SHOWN] = 1
        self._moving = MovingGeoms(model, data, movers)

    def distances(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> FloatArray:
        """See ``RayCaster.distances``."""
        return self.hits(origins, directions, times, max_range).distances

    def hits(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> Hits:
        """See ``RayCaster.hits``."""
        hits = self._static_hits(origins, directions, max_range)
        if len(self._moving):
            limits = np.minimum(hits.distances, max_range)
            rays, at, geoms, cosines = self._moving.cast(origins, directions, times, limits)
            hits.distances[rays], hits.geoms[rays], hits.cosines[rays] = at, geoms, cosines
        return hits

    def _static_hits(self, origins: FloatArray, directions: FloatArray, max_range: float) -> Hits:
        hits = no_hits(len(origins))
        if not len(origins):
            return hits
        shown = self._static & self._near(origins, directions, max_range)
        self._model.geom_group[:] = np.where(shown, _SHOWN, _HIDDEN)
        model, data, groups = self._model, self._data, self._groups
        geom, normal, ray = np.zeros(1, np.int32), np.zeros(3), mujoco.mj_ray
        for i, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
            distance = ray(model, data, origin, direction, groups, True, -1, geom, normal)
            if 0.0 <= distance <= max_range:
                hits.distances[i], hits.geoms[i] = distance, geom[0]
                hits.cosines[i] = abs(float(normal @ direction))
        return hits

    def _near(self, origins: FloatArray, directions: FloatArray, max_range: float) -> BoolArray:
        """Return which geoms (G,) may be near the plane that fits the rays best."""
        centre = origins.mean(axis=0)
        normal = np.linalg.eigh(directions.T @ directions)[1][:, 0]
        # A point of a ray is off the plane by at most the origin's offset plus range times slope.
        offset = float(np.abs((origins - centre) @ normal).max())
        slope = float(np.abs(directions @ normal).max())
        axes = self._data.geom_xmat.reshape(-1, 3, 3)
        thickness = np.einsum("gi,gi->g", np.abs(np.einsum("gji,j->gi", axes, normal)), self._half)
        height = np.abs((self._data.geom_xpos - centre) @ normal)
        near: BoolArray = height <= thickness + offset + slope * max_range
        return near | ~self._bounded


def _half_extents(model: mujoco.MjModel) -> tuple[FloatArray, BoolArray]:
    """Return half extents (G, 3) [m] of boxes around the geoms in their frames, and which have one."""
    kind, size = model.geom_type, model.geom_size
    half = np.repeat(model.geom_rbound[:, None], 3, axis=1)
    is_box = kind == mujoco.mjtGeom.mjGEOM_BOX
    half[is_box] = size[is_box]
    is_cylinder = kind == mujoco.mjtGeom.mjGEOM_CYLINDER
    half[is_cylinder] = size[is_cylinder][:, [0, 0, 1]]
    return half, np.asarray(kind != mujoco.mjtGeom.mjGEOM_PLANE)
