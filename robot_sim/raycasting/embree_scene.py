"""Static geometry as an Embree scene: triangles in single precision, distances in double."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from localization.types import IntArray
from robot_sim.array_types import FloatArray
from robot_sim.raycasting.ray_caster import NO_GEOM, GeomArray, static_geoms, visible_geoms
from robot_sim.raycasting.shape_intersection import ROUND, shape_cosines, shape_distances, to_frames
from robot_sim.raycasting.triangle_mesh import triangles_of

_STEP: Final = 2e-5
"""How far behind a hit a ray begins anew [m]: more than single precision takes away at 100 m."""
_SLACK: Final = 5e-5
"""Half of what a distance may be off [m]: a round surface this near behind its triangle needs no look
at the shape, and hides nothing in between that would matter."""
_RETRIES: Final = 64
"""A ray that grazes so many round things in a row is taken to have met nothing more."""
_FLAT, _ROUND, _ONE_SIDED = np.uint8(0), np.uint8(1), np.uint8(2)
_OFFSET, _TRUST = 3, 4
PrimArray = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class StaticHits:
    """What rays met among the static geometry."""

    distances: FloatArray
    """(N,) [m], ``inf`` for nothing."""
    prims: PrimArray
    """(N,) triangle."""
    slopes: FloatArray
    """(N,) cosine of incidence on the triangle, of either sign."""

    @classmethod
    def nothing(cls, rays: int) -> StaticHits:
        """Return that ``rays`` rays met nothing."""
        return cls(np.full(rays, np.inf), np.full(rays, -1, dtype=np.int32), np.zeros(rays))


class StaticGeometry:
    """What never moves, as one Embree scene; built once per world and shared by its simulations.

    Of a flat face the distance follows from its plane; so it does from a round shape's triangle
    where that is within 0.05 mm of the shape along the ray, and else from the shape itself. These
    triangles stand just outside of the shape: a ray that meets the triangle but not the shape, or
    might meet something else in between, is cast on from there.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        """Triangulate the static geoms of a model; those do not depend on its state."""
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        geoms = np.flatnonzero(visible_geoms(model) & static_geoms(model))
        triangles = triangles_of(model, data, geoms)
        self._centre = _centre(triangles.vertices)
        # Of each triangle: its plane's normal and offset, and the signed cosine of incidence up to
        # which the plane is all there is to know. Rays that meet nothing index the last column.
        self._planes = np.zeros((5, len(triangles.faces) + 1))
        self._planes[:4, :-1] = triangles.planes.T
        self._planes[_OFFSET, -1] = np.inf
        self._geom_of = np.append(triangles.geoms, NO_GEOM).astype(np.int32)
        kinds = model.geom_type[triangles.geoms]
        shapes = np.full(len(self._geom_of), _FLAT)
        shapes[:-1][np.isin(kinds, list(ROUND))] = _ROUND
        shapes[:-1][kinds == mujoco.mjtGeom.mjGEOM_PLANE] = _ONE_SIDED
        self._shapes = shapes
        # Seen at cosine c, a surface is bulge / c behind its triangle.
        self._planes[_TRUST] = np.array([2.0, -2.0, 0.0])[shapes]
        thin = np.flatnonzero((triangles.bulges > 0.0) & (triangles.bulges < _SLACK))
        self._planes[_TRUST, thin] = -triangles.bulges[thin] / _SLACK
        self._types = model.geom_type.copy()
        self._sizes = model.geom_size.copy()
        self._positions = data.geom_xpos.copy()
        self._matrices = data.geom_xmat.reshape(-1, 3, 3).copy()
        # Robust traversal costs a third more. Without it one ray in 1e6 of those aimed within 10 um of
        # an edge slips through (measured), and next to no ray is.
        self._scene: Any = EmbreeScene()
        if len(triangles.faces):
            vertices = (triangles.vertices - self._centre).astype(np.float32)
            TriangleMesh(self._scene, vertices, triangles.faces.astype(np.int32))

    def cast(self, origins: FloatArray, directions: FloatArray, max_range: float) -> StaticHits:
        """Return what the rays (N, 3) meet within ``max_range`` [m]."""
        if len(self._geom_of) == 1:
            return StaticHits.nothing(len(origins))
        prims: PrimArray = self._scene.run(
            (origins - self._centre).astype(np.float32),
            directions.astype(np.float32),
            dists=_just_beyond(max_range),
        )
        planes = self._planes.take(prims, axis=1)
        distances, slopes = _on_planes(planes, origins, directions)
        met = StaticHits(distances, prims, slopes)
        rows = np.flatnonzero(slopes > planes[_TRUST])
        if len(rows):
            self._look_closer(met, rows, origins[rows], directions[rows], max_range)
        # Not ">": a ray in the very plane of a face has no distance, and meets nothing.
        np.putmask(distances, ~(distances <= max_range), np.inf)
        return met

    def geoms(self, met: StaticHits) -> GeomArray:
        """Return the geom (N,) of each ray that met something, -1 of the others."""
        geoms = self._geom_of.take(met.prims)
        geoms[np.isinf(met.distances)] = NO_GEOM
        return geoms

    def cosines(self, met: StaticHits, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """Return absolute cosines of incidence (N,) where something was met, 0 elsewhere."""
        cosines = np.abs(met.slopes)
        cosines[np.isinf(met.distances)] = 0.0
        rows = np.flatnonzero((self._shapes[met.prims] == _ROUND) & np.isfinite(met.distances))
        if len(rows):
            geoms = self._geom_of[met.prims[rows]]
            o, d = self._in_frames(geoms, origins[rows], directions[rows])
            points = o + met.distances[rows, None] * d
            cosines[rows] = shape_cosines(self._types[geoms], self._sizes[geoms], points, d)
        return cosines

    def _look_closer(
        self,
        met: StaticHits,
        rows: IntArray,
        origins: FloatArray,
        directions: FloatArray,
        max_range: float,
    ) -> None:
        """Find what the rays ``rows`` (K,) of ``met`` really meet, and write it there.

        Args:
            met: What all rays met so far.
            rows: (K,) rays that met a round shape's triangle, or a plane from behind.
            origins: (K, 3) of those rays.
            directions: (K, 3) of those rays.
            max_range: [m].
        """
        prims, distances, slopes = met.prims[rows], met.distances[rows], met.slopes[rows]
        hulls = distances
        best = self._on_shapes(prims, distances, slopes, origins, directions)
        met.distances[rows] = best
        for _ in range(_RETRIES):
            # Whatever has not been found yet lies behind the hull.
            unsure = (best > hulls + _SLACK) & (hulls <= max_range)
            if not unsure.any():
                return
            rows, hulls = rows[unsure], hulls[unsure] + _STEP
            origins, directions = origins[unsure], directions[unsure]
            begin = origins + hulls[:, None] * directions - self._centre
            found = self._scene.run(
                begin.astype(np.float32),
                directions.astype(np.float32),
                dists=_just_beyond(max_range),
                output=True,
            )
            prims = found["primID"]
            hulls += found["tfar"]
            planes = self._planes.take(prims, axis=1)
            distances, slopes = _on_planes(planes, origins, directions)
            at = self._on_shapes(prims, distances, slopes, origins, directions)
            nearer = at < met.distances[rows]
            won = rows[nearer]
            met.distances[won], met.prims[won] = at[nearer], prims[nearer]
            met.slopes[won] = slopes[nearer]
            best = met.distances[rows]

    def _on_shapes(
        self,
        prims: PrimArray,
        distances: FloatArray,
        slopes: FloatArray,
        origins: FloatArray,
        directions: FloatArray,
    ) -> FloatArray:
        """Return distances (K,) to the surfaces that triangles stand for, ``inf`` for a miss.

        Args:
            prims: (K,) triangles met.
            distances: (K,) to their planes [m].
            slopes: (K,) signed cosines of incidence there.
            origins: (K, 3).
            directions: (K, 3).
        """
        shapes = self._shapes[prims]
        is_round = shapes == _ROUND
        if is_round.all():
            geoms = self._geom_of[prims]
            o, d = self._in_frames(geoms, origins, directions)
            return shape_distances(self._types[geoms], self._sizes[geoms], o, d)
        at = np.where((shapes == _ONE_SIDED) & (slopes > 0.0), np.inf, distances)
        if is_round.any():
            at[is_round] = self._on_shapes(
                prims[is_round],
                distances[is_round],
                slopes[is_round],
                origins[is_round],
                directions[is_round],
            )
        return at

    def _in_frames(
        self, geoms: GeomArray, origins: FloatArray, directions: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return rays (K, 3) in the frames of one geom (K,) each."""
        return to_frames(
            self._positions.take(geoms, axis=0),
            self._matrices.take(geoms, axis=0),
            origins,
            directions,
        )


def _on_planes(
    planes: FloatArray, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return distances (N,) to planes (4 or more, N), and signed cosines (N,) of incidence."""
    # Sums of long rows take a third of the time of sums of three.
    normals = planes[:3]
    slopes = _dot(normals, directions)
    heights = _dot(normals, origins)
    np.subtract(planes[_OFFSET], heights, out=heights)
    with np.errstate(divide="ignore", invalid="ignore"):
        heights /= slopes
    # An origin on the very surface may come out behind it by a rounding error.
    return np.abs(heights, out=heights), slopes


def _dot(rows: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return the products (N,) of vectors (3, N) with vectors (N, 3)."""
    total: FloatArray = rows[0] * vectors[:, 0]
    total += rows[1] * vectors[:, 1]
    total += rows[2] * vectors[:, 2]
    return total


def _just_beyond(max_range: float) -> float:
    """Return a range that single precision does not round to less than ``max_range`` [m]."""
    return max_range * (1.0 + 1e-6)


def _centre(vertices: FloatArray) -> FloatArray:
    """Return the middle of the box around vertices (V, 3): coordinates near zero keep more digits."""
    if not len(vertices):
        return np.zeros(3)
    return np.asarray(0.5 * (vertices.min(axis=0) + vertices.max(axis=0)))
