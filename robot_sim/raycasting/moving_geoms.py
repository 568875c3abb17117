"""Ray casting against moving geometry, at each beam's own time for movers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.actors.movers import Mover
from robot_sim.actors.schedules import PARKED
from robot_sim.array_types import FloatArray
from robot_sim.raycasting.pose_interpolation import PoseInterpolator
from robot_sim.raycasting.ray_caster import GeomArray, static_geoms, visible_geoms
from robot_sim.raycasting.shape_intersection import (
    CONVEX,
    shape_cosines,
    shape_distances,
    to_frames,
)

MAX_MOVER_SPEED: Final = 6.0
"""Greatest speed of any part of a mover [m/s], a leg at a run of 3 m/s; sets the bounding spheres."""


class MovingGeoms:
    """All visible geoms of bodies that can move.

    A ray is tested against the few geoms whose bounding spheres it intersects. Bodies with a mover are
    placed where they were at the ray's time; others (a box that can be pushed, a door on a hinge) are at
    their poses in ``data``, which are those at the beginning of the tick's last step.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, movers: Sequence[Mover]) -> None:
        self._model, self._data = model, data
        self._geoms = np.flatnonzero(visible_geoms(model) & ~static_geoms(model)).astype(np.int32)
        bodies = model.geom_bodyid[self._geoms]
        by_body = {model.body(m.name).id: i for i, m in enumerate(movers)}
        self._timetable = PoseInterpolator(movers)
        self._mover_of = np.array([by_body.get(int(b), -1) for b in bodies], dtype=np.int64)
        self._reach = model.geom_rbound[self._geoms].copy()
        # Planes have no bounding sphere.
        planes = model.geom_type[self._geoms] == mujoco.mjtGeom.mjGEOM_PLANE
        self._reach[planes] = np.inf
        self._in_body = _matrices(model.geom_quat[self._geoms])
        self._timed = np.flatnonzero(self._mover_of >= 0)
        kinds = model.geom_type[self._geoms]
        self._known = np.array([int(kind) in CONVEX for kind in kinds], dtype=bool)
        # State in which single geoms are placed for the shapes that only MuJoCo can cast against.
        self._scratch = None if self._known.all() else mujoco.MjData(model)

    def __len__(self) -> int:
        return len(self._geoms)

    def cast(
        self,
        origins: FloatArray,
        directions: FloatArray,
        times: IntArray,
        limits: FloatArray,
    ) -> tuple[IntArray, FloatArray, GeomArray, FloatArray]:
        """Return the hits of the rays before their limits.

        Args:
            origins: (N, 3) in ``map`` [m].
            directions: (N, 3) unit vectors in ``map``.
            times: (N,) times of the rays [ns].
            limits: (N,) distance at which each ray ends [m], ``inf`` for never.

        Returns:
            Index, distance [m], geom and absolute cosine of incidence of the M rays with a hit.
        """
        rays, columns = self._candidates(origins, directions, times, limits)
        if not len(rays):
            return _nothing()
        positions, matrices = self._poses(columns, times[rays])
        o, d = to_frames(positions, matrices, origins[rays], directions[rays])
        geoms = self._geoms[columns]
        kinds, sizes = self._model.geom_type[geoms], self._model.geom_size[geoms]
        known = self._known[columns]
        distances, cosines = np.full(len(rays), np.inf), np.zeros(len(rays))
        at = shape_distances(kinds[known], sizes[known], o[known], d[known])
        distances[known] = at
        met = np.flatnonzero(known)[np.isfinite(at)]
        points = o[met] + distances[met, None] * d[met]
        cosines[met] = shape_cosines(kinds[met], sizes[met], points, d[met])
        for i in np.flatnonzero(~known):
            distances[i], cosines[i] = self._cast_natively(
                int(geoms[i]), positions[i], matrices[i], origins[rays[i]], directions[rays[i]]
            )
        return _nearest(rays, distances, geoms, cosines, limits)

    def _candidates(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, limits: FloatArray
    ) -> tuple[IntArray, IntArray]:
        """Return pairs of a ray and a column of ``self._geoms`` whose bounding sphere it intersects."""
        centres, reach = self._spheres(times)
        # First the geoms that are near any ray, then each ray with each of those.
        middle = origins.mean(axis=0)
        # A vector is at most sqrt(3) < 1.75 times as long as its largest component.
        spread = float(np.abs(origins - middle).max()) * 1.75
        apart = np.linalg.norm(centres - middle, axis=1)
        farthest = float(limits.max())
        near = np.flatnonzero(apart <= farthest + reach + spread)
        if not len(near):
            empty = np.zeros(0, dtype=np.int64)
            return empty, empty
        # |o + t d - c|^2 for all rays and spheres at once, expanded to matrix products.
        c, r = centres[near] - middle, reach[near]
        o = origins - middle
        along = directions @ c.T
        along -= np.einsum("nd,nd->n", o, directions)[:, None]
        square = o @ c.T
        # In place, because these are the largest arrays of a sweep.
        square *= -2.0
        square += np.einsum("nd,nd->n", o, o)[:, None]
        square += np.einsum("gd,gd->g", c, c)
        # The ray's place t that is nearest to a centre has the square |o - c|^2 - t (2 along - t).
        t = np.clip(along, 0.0, limits[:, None])
        along *= 2.0
        along -= t
        along *= t
        square -= along
        met = square <= r * r + 1e-9
        rays, columns = np.nonzero(met)
        return rays, near[columns]

    def _spheres(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return centres (G, 3) and radii (G,) of spheres that contain the geoms at all ``times``."""
        if not len(self._timed):
            return self._data.geom_xpos[self._geoms], self._reach
        first, last = int(times.min()), int(times.max())
        here = np.arange(len(self._geoms))
        centres = np.full((len(here), 3), PARKED)
        if parked := self._timetable.parked(first, last):
            here = here[~np.isin(self._mover_of, parked)]
        if len(here):
            centres[here] = self._poses(here, np.full(len(here), (first + last) // 2))[0]
        reach = self._reach.copy()
        # From where it is in the middle of the time, a body comes this far either way.
        reach[self._timed] += MAX_MOVER_SPEED * 1e-9 * (last - first) / 2
        for number in self._timetable.jumping(first, last):
            reach[self._mover_of == number] = np.inf
        return centres, reach

    def _poses(self, columns: IntArray, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (M, 3) and matrices (M, 3, 3) of geoms at ``times`` (M,) [ns]."""
        geoms, numbers = self._geoms[columns], self._mover_of[columns]
        positions = self._data.geom_xpos[geoms]
        matrices = self._data.geom_xmat[geoms].reshape(-1, 3, 3)
        rows = np.flatnonzero(numbers >= 0)
        if not len(rows):
            return positions, matrices
        places, yaws = self._timetable.poses(numbers[rows], times[rows])
        c, s = np.cos(yaws), np.sin(yaws)
        x, y, z = self._model.geom_pos[geoms[rows]].T
        places += np.stack([c * x - s * y, s * x + c * y, z], axis=1)
        positions[rows] = places
        tilted = self._in_body[columns[rows]]
        turned = tilted.copy()
        turned[:, 0] = c[:, None] * tilted[:, 0] - s[:, None] * tilted[:, 1]
        turned[:, 1] = s[:, None] * tilted[:, 0] + c[:, None] * tilted[:, 1]
        matrices[rows] = turned
        return positions, matrices

    def _cast_natively(
        self, geom: int, position: FloatArray, matrix: FloatArray, o: FloatArray, d: FloatArray
    ) -> tuple[float, float]:
        """Cast one ray against a moving mesh, plane or heightfield."""
        assert self._scratch is not None
        model, scratch, normal = self._model, self._scratch, np.zeros(3)
        kind = model.geom_type[geom]
        if kind == mujoco.mjtGeom.mjGEOM_MESH:
            scratch.geom_xpos[geom], scratch.geom_xmat[geom] = position, matrix.ravel()
            distance = mujoco.mj_rayMesh(model, scratch, geom, o, d, normal)
        elif kind == mujoco.mjtGeom.mjGEOM_HFIELD:
            scratch.geom_xpos[geom], scratch.geom_xmat[geom] = position, matrix.ravel()
            distance = mujoco.mj_rayHfield(model, scratch, geom, o, d, normal)
        else:
            size = model.geom_size[geom]
            distance = mujoco.mju_rayGeom(position, matrix.ravel(), size, o, d, kind, normal)
        return (distance, abs(float(normal @ d))) if distance >= 0.0 else (np.inf, 0.0)


def _nearest(
    rays: IntArray, distances: FloatArray, geoms: GeomArray, cosines: FloatArray, limits: FloatArray
) -> tuple[IntArray, FloatArray, GeomArray, FloatArray]:
    """Keep the nearest candidate of each ray that lies before its limit."""
    good = np.flatnonzero(distances <= limits[rays])
    # Sorted by ray, then by distance; the first of each ray is its hit.
    order = good[np.lexsort((distances[good], rays[good]))]
    ordered = rays[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = ordered[1:] != ordered[:-1]
    kept = order[first]
    return rays[kept], distances[kept], geoms[kept], cosines[kept]


def _nothing() -> tuple[IntArray, FloatArray, GeomArray, FloatArray]:
    return (
        np.zeros(0, dtype=np.int64),
        np.zeros(0),
        np.zeros(0, dtype=np.int32),
        np.zeros(0),
    )


def _matrices(quaternions_wxyz: FloatArray) -> FloatArray:
    matrices = np.empty((len(quaternions_wxyz), 9))
    for row, quaternion in zip(matrices, quaternions_wxyz, strict=True):
        mujoco.mju_quat2Mat(row, quaternion)
    return matrices.reshape(-1, 3, 3)
