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
"""Distance behind a hit at which a ray is cast on [m]: more than single precision loses at 100 m."""
_SLACK: Final = 5e-5
"""Half of the allowed error of a distance [m]: a round surface this close behind its triangle needs
no exact intersection, and hides nothing relevant in between."""
_RETRIES: Final = 64
"""Number of round shapes in a row that a ray may graze before it is taken to hit nothing."""
_FLAT, _ROUND, _ONE_SIDED = np.uint8(0), np.uint8(1), np.uint8(2)
_OFFSET, _TRUST = 3, 4
PrimArray = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class StaticHits:
    """Hits of rays on the static geometry."""

    distances: FloatArray
    """Distances (N,) [m], ``inf`` without a hit."""
    prims: PrimArray
    """Triangles (N,) that were hit."""
    slopes: FloatArray
    """Signed cosines of incidence on the triangles, (N,)."""

    @classmethod
    def nothing(cls, rays: int) -> StaticHits:
        """Return that ``rays`` rays hit nothing."""
        return cls(np.full(rays, np.inf), np.full(rays, -1, dtype=np.int32), np.zeros(rays))


class StaticGeometry:
    """Static geometry as one Embree scene; built once per world and shared by its simulations.

    Distances to flat faces are computed from their planes; those to round shapes from the triangle where
    it is within 0.05 mm of the shape along the ray, and otherwise from the shape itself. The triangles
    of round shapes lie just outside of them: a ray that hits the triangle but not the shape, or might
    hit something else in between, is cast on from there.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        """Triangulate the static geoms of a model; those do not depend on its state."""
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        geoms = np.flatnonzero(visible_geoms(model) & static_geoms(model))
        triangles = triangles_of(model, data, geoms)
        self._centre = _centre(triangles.vertices)
        # For each triangle: its plane's normal and offset, and the signed cosine of incidence up to
        # which the plane gives the distance. Rays without a hit index the last column.
        self._planes = np.zeros((5, len(triangles.faces) + 1))
        self._planes[:4, :-1] = triangles.planes.T
        self._planes[_OFFSET, -1] = np.inf
        self._geom_of = np.append(triangles.geoms, NO_GEOM).astype(np.int32)
        kinds = model.geom_type[triangles.geoms]
        shapes = np.full(len(self._geom_of), _FLAT)
        shapes[:-1][np.isin(kinds, list(ROUND))] = _ROUND
        shapes[:-1][kinds == mujoco.mjtGeom.mjGEOM_PLANE] = _ONE_SIDED
        self._shapes = shapes
        # At cosine of incidence c, a surface is bulge / c behind its triangle.
        self._planes[_TRUST] = np.array([2.0, -2.0, 0.0])[shapes]
        thin = np.flatnonzero((triangles.bulges > 0.0) & (triangles.bulges < _SLACK))
        self._planes[_TRUST, thin] = -triangles.bulges[thin] / _SLACK
        self._types = model.geom_type.copy()
        self._sizes = model.geom_size.copy()
        self._positions = data.geom_xpos.copy()
        self._matrices = data.geom_xmat.reshape(-1, 3, 3).copy()
        # Robust traversal costs a third more. Without it one ray in 1e6 of those aimed within 10 um of
        # an edge passes through (measured), and hardly any ray is aimed so.
        self._scene: Any = EmbreeScene()
        if len(triangles.faces):
            vertices = (triangles.vertices - self._centre).astype(np.float32)
            TriangleMesh(self._scene, vertices, triangles.faces.astype(np.int32))

    def cast(self, origins: FloatArray, directions: FloatArray, max_range: float) -> StaticHits:
        """Return the hits of rays (N, 3) within ``max_range`` [m]."""
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
        # Not ">": a ray in the plane of a face has distance NaN, and hits nothing.
        np.putmask(distances, ~(distances <= max_range), np.inf)
        return met

    def geoms(self, met: StaticHits) -> GeomArray:
        """Return the geom (N,) of each ray, -1 without a hit."""
        geoms = self._geom_of.take(met.prims)
        geoms[np.isinf(met.distances)] = NO_GEOM
        return geoms

    def cosines(self, met: StaticHits, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """Return absolute cosines of incidence (N,), 0 without a hit."""
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
        """Compute the exact hits of the rays ``rows`` (K,) of ``met``, in place.

        Args:
            met: Hits of all rays so far.
            rows: (K,) rays that hit a round shape's triangle, or a plane from behind.
            origins: (K, 3) origins of those rays [m].
            directions: (K, 3) unit directions of those rays.
            max_range: Greatest distance [m].
        """
        prims, distances, slopes = met.prims[rows], met.distances[rows], met.slopes[rows]
        hulls = distances
        best = self._on_shapes(prims, distances, slopes, origins, directions)
        met.distances[rows] = best
        for _ in range(_RETRIES):
            # Any hit that has not been found yet lies behind the hull.
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
        """Return distances (K,) to the surfaces that triangles represent, ``inf`` for a miss.

        Args:
            prims: (K,) triangles that were hit.
            distances: (K,) distances to their planes [m].
            slopes: (K,) signed cosines of incidence there.
            origins: (K, 3) origins of the rays [m].
            directions: (K, 3) unit directions of the rays.
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
    # An origin on the surface may be behind it by a rounding error.
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
    """Return the centre of the vertices' (V, 3) bounding box."""
    if not len(vertices):
        return np.zeros(3)
    return np.asarray(0.5 * (vertices.min(axis=0) + vertices.max(axis=0)))
