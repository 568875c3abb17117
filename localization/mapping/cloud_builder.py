"""Build the global cloud from a drive: sweeps and where they were taken in, thinned cloud out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud, CloudError
from localization.maps.cloud_from_grid import WALL_BOTTOM, WALL_TOP
from localization.maps.open3d_import import import_open3d
from localization.types import IntArray, Pose, Sweep


@dataclass(frozen=True, slots=True)
class MappingConfig:
    """How raw points become a map."""

    raw_spacing: float = 0.02
    """Points nearer than this are averaged as they come [m]."""
    spacing: float = 0.08
    """Of the finished cloud [m]."""
    plane_radius: float = 0.09
    """Neighbourhood from which a normal is taken [m]: less than the thinnest wall, so that its two faces
    stay apart."""
    plane_points: int = 40
    """Neighbours at most."""
    lonely: int = 8
    """A point with fewer neighbours than this within the radius is dropped as noise."""
    most_curved: float = 0.10
    """Smallest over summed eigenvalues of a neighbourhood; beyond it there is no plane."""
    highest: float = float("inf")
    """Points above this are dropped as they come [m]."""
    upright: bool = False
    """Whether walls were seen at one height only: they are then taken to stand upright, as those of an
    occupancy grid are."""


class CloudBuilder:
    """Collects sweeps in ``map`` and turns them into a cloud with oriented normals.

    Raises:
        ImportError: on construction, if Open3D is missing or does not load; the message says what to
            install.
    """

    def __init__(self, config: MappingConfig = MappingConfig()) -> None:
        self.config = config
        self._open3d = import_open3d()
        self._points: list[FloatArray] = []
        self._views: list[FloatArray] = []

    def add(self, sweep: Sweep, map_from_base: Pose) -> None:
        """Take a sweep seen from a known pose."""
        points = map_from_base.apply(sweep.points)
        view = map_from_base.apply(sweep.origins) - points
        low = points[:, 2] <= self.config.highest
        points, view = points[low], view[low]
        if self.config.upright:
            points[:, 2] = view[:, 2] = 0.0
        self._points.append(points)
        self._views.append(view / np.linalg.norm(view, axis=1, keepdims=True))

    @property
    def count(self) -> int:
        """How many raw points were collected."""
        return sum(len(p) for p in self._points)

    def build(self, name: str) -> Cloud:
        """Return the finished cloud.

        Raises:
            CloudError: if too little was seen to make one.
        """
        c = self.config
        if self.count < 1000:
            raise CloudError(f"only {self.count} points were seen; a map needs 1000 at least")
        points, views = self._average(
            np.concatenate(self._points), np.concatenate(self._views), c.raw_spacing
        )
        if c.upright:
            points, views = _stood(points, views, 0.5 * c.plane_radius)
        points, normals = self._planes(points, views)
        if c.upright:
            points, normals = _levelled(points, normals)
        points = _smooth(points, normals, c)
        points, normals = self._thin(points, normals)
        return Cloud(points, normals, name=name)

    def _cloud(self, points: FloatArray, normals: FloatArray) -> Any:
        o3d = self._open3d
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        cloud.normals = o3d.utility.Vector3dVector(normals)
        return cloud

    def _average(
        self, points: FloatArray, vectors: FloatArray, spacing: float
    ) -> tuple[FloatArray, FloatArray]:
        """Average points and unit vectors per voxel."""
        thinned = self._cloud(points, vectors).voxel_down_sample(spacing)
        return np.array(thinned.points), np.array(thinned.normals)

    def _planes(self, points: FloatArray, views: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Drop points that lie on no plane; give the rest normals turned to where they were seen from."""
        c, o3d = self.config, self._open3d
        cloud, kept = self._cloud(points, views).remove_radius_outlier(
            nb_points=c.lonely, radius=c.plane_radius
        )
        near = o3d.geometry.KDTreeSearchParamHybrid(radius=c.plane_radius, max_nn=c.plane_points)
        cloud.estimate_covariances(near)
        spread, axes = np.linalg.eigh(np.array(cloud.covariances))
        normals: FloatArray = axes[:, :, 0]
        flat = spread[:, 0] < c.most_curved * spread.sum(axis=1)
        # A line of points has no plane either: its normal may turn about the line.
        flat &= spread[:, 1] > 0.05 * spread[:, 2]
        toward = np.einsum("ij,ij->i", normals, views[np.array(kept)])
        normals[toward < 0.0] *= -1.0
        return np.array(cloud.points)[flat], normals[flat]

    def _thin(self, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Average per voxel, apart for each of the six ways a normal can chiefly point.

        So neither a corner's two walls nor a board's two faces are ever averaged into one.
        """
        spacing = self.config.spacing
        axis = np.abs(normals).argmax(axis=1)
        up = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] > 0.0
        side = np.where(up, axis, axis + 3)
        parts = [
            self._average(points[side == k], normals[side == k], spacing)
            for k in range(6)
            if (side == k).any()
        ]
        thinned, mean = (np.concatenate(a) for a in zip(*parts, strict=True))
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        order = np.lexsort(np.round(thinned / spacing).astype(int).T)
        return thinned[order], (mean / length)[order]


def distances_to_mesh(points: FloatArray, vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return how far points (N, 3) are from the nearest of triangles (N,) [m].

    Args:
        points: (N, 3) [m].
        vertices: (V, 3) [m]; computed with in single precision, a micrometre at ten metres.
        faces: (F, 3) vertices of each triangle.

    Raises:
        ImportError: if Open3D is missing or does not load; the message says what to install.
    """
    o3d = import_open3d()
    scene = o3d.t.geometry.RaycastingScene()
    tensor = o3d.core.Tensor
    scene.add_triangles(
        tensor(np.ascontiguousarray(vertices, dtype=np.float32)),
        tensor(np.ascontiguousarray(faces, dtype=np.uint32)),
    )
    queries = tensor(np.ascontiguousarray(points, dtype=np.float32))
    distances: FloatArray = scene.compute_distance(queries).numpy().astype(float)
    return distances


def _stood(points: FloatArray, views: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return points and views (N, 3), each repeated from low to high every ``step`` [m]."""
    heights = np.arange(WALL_BOTTOM, WALL_TOP + 0.5 * step, step)
    stood = np.repeat(points, len(heights), axis=0)
    stood[:, 2] = np.tile(heights, len(points))
    return stood, np.repeat(views, len(heights), axis=0)


def _levelled(points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points of upright walls, their normals made level: the rest are ends of walls."""
    length = np.hypot(normals[:, 0], normals[:, 1])
    kept = length > 0.9
    level = normals[kept] / length[kept, None]
    level[:, 2] = 0.0
    return points[kept], level


_CHUNK = 50_000
"""Points smoothed at once: their neighbours' normals take a kilobyte each."""


def _smooth(points: FloatArray, normals: FloatArray, c: MappingConfig) -> FloatArray:
    """Move each point along its normal to the mean plane of its neighbours that face the same way."""
    tree = cKDTree(points)
    parts = [
        _smoothed(tree, points, normals, slice(start, start + _CHUNK), c)
        for start in range(0, len(points), _CHUNK)
    ]
    return np.concatenate(parts)


def _smoothed(
    tree: cKDTree, points: FloatArray, normals: FloatArray, part: slice, c: MappingConfig
) -> FloatArray:
    here, facing = points[part], normals[part]
    distance, index = tree.query(here, k=c.plane_points, distance_upper_bound=c.plane_radius)
    absent = ~np.isfinite(distance)
    index[absent] = 0
    alike = np.einsum("nki,ni->nk", normals[index], facing) > 0.8
    alike &= ~absent
    height = np.einsum("nki,ni->nk", points[index] - here[:, None, :], facing)
    mean = (height * alike).sum(axis=1) / np.maximum(alike.sum(axis=1), 1)
    smoothed: FloatArray = here + mean[:, None] * facing
    return smoothed
