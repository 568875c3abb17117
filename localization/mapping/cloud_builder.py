"""Builder of the global cloud from the sweeps of a drive and their poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.cloud_smoothing import smoothed_points
from localization.mapping.wall_faces import edge_points, facing_classes, lost_faces, quadrants
from localization.maps.cloud import Cloud, CloudError
from localization.maps.cloud_from_grid import WALL_BOTTOM, WALL_TOP
from localization.maps.open3d_import import import_open3d
from localization.types import IntArray, Pose, Sweep


@dataclass(frozen=True, slots=True)
class MappingConfig:
    """Settings of the builder."""

    raw_spacing: float = 0.02
    """Edge of the voxels in which raw points are averaged [m]."""
    spacing: float = 0.08
    """Spacing of the finished cloud [m]."""
    plane_radius: float = 0.09
    """Neighbourhood of a normal [m]. Only points seen from the same side take part, so that both faces of thinner
    walls stay in the map."""
    plane_points: int = 40
    """Number of neighbours for a normal at most."""
    lonely: int = 8
    """A point with fewer neighbours within the radius is dropped as noise."""
    most_curved: float = 0.10
    """Greatest ratio of the smallest to the summed eigenvalues of a neighbourhood; beyond it there is no plane."""
    highest: float = float("inf")
    """Height above which points are dropped [m]."""
    upright: bool = False
    """Whether walls were seen at one height only; they are then extruded upright, like those of an occupancy
    grid."""


class CloudBuilder:
    """Collects sweeps in ``map`` and builds a cloud with oriented normals.

    Raises:
        ImportError: On construction, if Open3D is missing or does not load; the message names the package to
            install.
    """

    def __init__(self, config: MappingConfig = MappingConfig()) -> None:
        self.config = config
        self._open3d = import_open3d()
        self._points: list[FloatArray] = []
        self._views: list[FloatArray] = []
        self.lost_faces: FloatArray = np.zeros((0, 3))
        """Places (M, 3) [m] where the cloud built last lacks one face of a wall that was seen from both sides."""

    def add(self, sweep: Sweep, map_from_base: Pose) -> None:
        """Add a sweep that was measured at a known pose."""
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
        """Number of raw points collected."""
        return sum(len(p) for p in self._points)

    def build(self, name: str) -> Cloud:
        """Return the finished cloud.

        Raises:
            CloudError: If there are fewer than 1000 points.
        """
        c = self.config
        if self.count < 1000:
            raise CloudError(f"only {self.count} points were collected; a map needs at least 1000")
        points, views = np.concatenate(self._points), np.concatenate(self._views)
        # Apart by the direction of view: a voxel may reach through a board.
        points, views = self._averaged_apart(points, views, quadrants(views), c.raw_spacing)
        seen = points, views
        if c.upright:
            # One height would do for lines, but normals are those of planes.
            points, normals = _levelled(*self._planes(*_stood(points, views, 0.5 * c.plane_radius)))
        else:
            points, normals = self._planes(points, views)
        self.lost_faces = lost_faces(*seen, points, normals, c.plane_radius)
        points = smoothed_points(points, normals, c.plane_radius, c.plane_points)
        points, normals = self._thin(points, normals)
        if c.upright:
            points, normals = _raised(points, normals, c.spacing)
        return Cloud(points, normals, name=name)

    def _cloud(self, points: FloatArray, normals: FloatArray) -> Any:
        o3d = self._open3d
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        cloud.normals = o3d.utility.Vector3dVector(normals)
        return cloud

    def _average(
        self, points: FloatArray, vectors: FloatArray, spacing: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return points and unit vectors averaged per voxel."""
        thinned = self._cloud(points, vectors).voxel_down_sample(spacing)
        return np.array(thinned.points), np.array(thinned.normals)

    def _averaged_apart(
        self, points: FloatArray, vectors: FloatArray, part: IntArray, spacing: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return points and unit vectors averaged per voxel, separately for each part (N,) of the points."""
        parts = [
            self._average(points[part == k], vectors[part == k], spacing)
            for k in np.unique(part).tolist()
        ]
        averaged, mean = (np.concatenate(a) for a in zip(*parts, strict=True))
        return averaged, mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)

    def _planes(self, points: FloatArray, views: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points that lie on a plane, with normals towards the scanner that saw them."""
        # Wider: the direction of a thin wall is needed here, by which its faces are distinguished.
        axes, _, kept = self._fitted(points, views, 1.5)
        points, views = points[kept], views[kept]
        facing = facing_classes(axes, views)
        found, rest = [], np.ones(len(points), dtype=bool)
        for k in np.unique(facing).tolist():
            own = np.flatnonzero(facing == k)
            part, seen = points[own], views[own]
            normals, spread, kept = self._fitted(part, seen)
            flat = spread[:, 0] < self.config.most_curved * spread.sum(axis=1)
            # Points on a line have no normal: it could have any direction around the line.
            flat &= spread[:, 1] > 0.05 * spread[:, 2]
            toward = np.einsum("ij,ij->i", normals, seen[kept])
            normals[toward < 0.0] *= -1.0
            found.append((part[kept][flat], normals[flat]))
            rest[own[kept][flat]] = False
        if not found:
            return points, views
        planar, normals = (np.concatenate(a) for a in zip(*found, strict=True))
        edges = edge_points(points[rest], views[rest], planar, normals, self.config.plane_radius)
        return np.concatenate([planar, edges[0]]), np.concatenate([normals, edges[1]])

    def _fitted(
        self, points: FloatArray, views: FloatArray, wider: float = 1.0
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return axes of least spread (M, 3) and spreads (M, 3), and the numbers (M,) of points with neighbours."""
        c, o3d = self.config, self._open3d
        cloud, kept = self._cloud(points, views).remove_radius_outlier(
            nb_points=c.lonely, radius=c.plane_radius
        )
        near = o3d.geometry.KDTreeSearchParamHybrid(
            radius=wider * c.plane_radius, max_nn=round(wider**2 * c.plane_points)
        )
        if not len(kept):
            return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=np.int64)
        cloud.estimate_covariances(near)
        spread, axes = np.linalg.eigh(np.array(cloud.covariances))
        return np.array(axes[:, :, 0]), spread, np.array(kept, dtype=np.int64)

    def _thin(self, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points averaged per voxel, separately for each of the six main directions of normals.

        Therefore neither the two walls of a corner nor the two faces of a board are averaged into one.
        """
        spacing = self.config.spacing
        thinned, mean = self._averaged_apart(
            points, normals, facing_classes(normals, normals), spacing
        )
        order = np.lexsort(np.round(thinned / spacing).astype(int).T)
        return thinned[order], mean[order]


_LAYERS = 7
"""Number of heights at which the lines of upright walls are repeated for a normal: as many as a neighbourhood holds."""


def _stood(points: FloatArray, views: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return points and views (N, 3) at height zero, repeated at some heights about it with a spacing [m]."""
    heights = step * np.arange(-(_LAYERS // 2), _LAYERS // 2 + 1, dtype=np.float64)
    return _repeated(points, heights), np.repeat(views, _LAYERS, axis=0)


def _levelled(points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points of upright walls at height zero, normals levelled; other points are ends of walls."""
    length = np.hypot(normals[:, 0], normals[:, 1])
    kept = (length > 0.9) & (np.abs(points[:, 2]) < 1e-6)
    level = normals[kept] / length[kept, None]
    level[:, 2] = 0.0
    return points[kept], level


def _raised(
    points: FloatArray, normals: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Return the points (N, 3) of walls at height zero, and their normals, over the whole height of the walls."""
    heights = np.arange(WALL_BOTTOM, WALL_TOP + 0.5 * spacing, spacing)
    return _repeated(points, heights), np.repeat(normals, len(heights), axis=0)


def _repeated(points: FloatArray, heights: FloatArray) -> FloatArray:
    raised = np.repeat(points, len(heights), axis=0)
    raised[:, 2] = np.tile(heights, len(points))
    return raised
