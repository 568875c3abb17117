"""Builder of the global cloud from the sweeps of a drive and their poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.mapping.cloud_smoothing import smoothed_points
from localization.mapping.wall_faces import edge_points, facing_classes, lost_faces, quadrants
from localization.maps.cloud import Cloud, CloudError
from localization.maps.cloud_from_grid import WALL_BOTTOM, WALL_TOP
from localization.maps.open3d_import import import_open3d
from localization.types import BoolArray, IntArray, Pose, Sweep


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
        self._level: list[BoolArray] = []
        self.lost_faces: FloatArray = np.zeros((0, 3))
        """Places (M, 3) [m] where the cloud built last lacks one face of a wall that was seen from both sides."""

    def add(self, sweep: Sweep, map_from_base: Pose) -> None:
        """Add a sweep that was measured at a known pose."""
        points = map_from_base.apply(sweep.points)
        view = map_from_base.apply(sweep.origins) - points
        low = points[:, 2] <= self.config.highest
        points, view = points[low], view[low]
        self._level.append(np.abs(view[:, 2]) < _BESIDE)
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
        # Apart by the direction of view, for a voxel may reach through a board, and by the scanner's height.
        part = quadrants(views) + 4 * np.concatenate(self._level)
        points, views, part = self._averaged_apart(points, views, part, c.raw_spacing)
        seen, level = (points, views), _met_level(points, part >= 4, c.plane_radius)
        if c.upright:
            # One height would do for lines, but normals are those of planes.
            stood = _stood(points, views, 0.5 * c.plane_radius)
            points, normals = _levelled(*self._planes(*stood, np.repeat(level, _LAYERS)))
        else:
            points, normals = self._planes(points, views, level)
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
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return points and unit vectors averaged per voxel, separately for each part (N,) of the points, and the parts."""
        numbers = np.unique(part).tolist()
        parts = [self._average(points[part == k], vectors[part == k], spacing) for k in numbers]
        averaged, mean = (np.concatenate(a) for a in zip(*parts, strict=True))
        of = np.repeat(numbers, [len(some) for some, _ in parts])
        return averaged, mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9), of

    def _planes(
        self, points: FloatArray, views: FloatArray, level: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the points that lie on a plane, with normals towards the scanner that saw them."""
        # Wider: the direction of a thin wall is needed here, by which its faces are distinguished.
        axes, _, kept = self._fitted(points, views, level, 1.5)
        points, views, level = points[kept], views[kept], level[kept]
        facing = facing_classes(axes, views)
        found, rest = [], np.ones(len(points), dtype=bool)
        for k in np.unique(facing).tolist():
            own = np.flatnonzero(facing == k)
            part, seen = points[own], views[own]
            normals, flat, kept = self._fitted(part, seen, level[own])
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
        self, points: FloatArray, views: FloatArray, level: BoolArray, wider: float = 1.0
    ) -> tuple[FloatArray, BoolArray, IntArray]:
        """Return normals (M, 3) of either sign, whether there is a plane (M,), and the numbers (M,) of points.

        Points without neighbours are left out.
        """
        c, o3d = self.config, self._open3d
        cloud, kept = self._cloud(points, views).remove_radius_outlier(
            nb_points=c.lonely, radius=c.plane_radius
        )
        near = o3d.geometry.KDTreeSearchParamHybrid(
            radius=wider * c.plane_radius, max_nn=round(wider**2 * c.plane_points)
        )
        if not len(kept):
            return np.zeros((0, 3)), np.zeros(0, dtype=bool), np.zeros(0, dtype=np.int64)
        cloud.estimate_covariances(near)
        normals, flat = _planes_of(
            np.array(cloud.covariances), views[kept], level[kept], c.most_curved
        )
        return normals, flat, np.array(kept, dtype=np.int64)

    def _thin(self, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points averaged per voxel, separately for each of the six main directions of normals.

        Therefore neither the two walls of a corner nor the two faces of a board are averaged into one.
        """
        spacing = self.config.spacing
        thinned, mean, _ = self._averaged_apart(
            points, normals, facing_classes(normals, normals), spacing
        )
        order = np.lexsort(np.round(thinned / spacing).astype(int).T)
        return thinned[order], mean[order]


_BESIDE = 0.3
"""A scanner this near to a point's own height [m] sees no floor there; most scanners are mounted higher than this."""
_LEVEL = 0.1
"""Sine of the greatest angle between level and nearly level: a robot pitches, and its scanner is mounted, by less."""


def _met_level(points: FloatArray, beside: BoolArray, reach: float) -> BoolArray:
    """Return which points (N,) that a scanner beside them saw have no neighbour that one above or below them saw."""
    level = beside.copy()
    if beside.any() and not beside.all():
        distance, _ = cKDTree(points[~beside]).query(points[beside], distance_upper_bound=reach)
        level[beside] = ~np.isfinite(distance)
    return level


def _planes_of(
    covariances: FloatArray, views: FloatArray, level: BoolArray, most_curved: float
) -> tuple[FloatArray, BoolArray]:
    """Return the normals (M, 3) of either sign of neighbourhoods, and whether each is a plane (M,).

    The normal is the axis of least spread. Points on a line have none: it could have any direction around the line.
    But what a level scanner has met of a wall is a level line, as thin up and down as its noise is wide across, so
    that the axis of least spread may be that of a floor, which no level beam meets. The wall through such a line
    stands upright.

    Args:
        covariances: Covariances (M, 3, 3) of the points [m^2].
        views: Directions (M, 3) from the points to the scanners that saw them.
        level: Whether only scanners at its own height have seen the point and its neighbours (M,).
        most_curved: Greatest ratio of the spread across a plane to that in all directions.
    """
    spread, axes = np.linalg.eigh(covariances)
    normals, along = axes[:, :, 0].copy(), axes[:, :, 2]
    total = spread.sum(axis=1)
    flat = (spread[:, 0] < most_curved * total) & (spread[:, 1] > 0.05 * spread[:, 2])
    walls = np.column_stack([along[:, 1], -along[:, 0], np.zeros(len(along))])
    walls /= np.maximum(np.linalg.norm(walls, axis=1, keepdims=True), 1e-9)
    across = np.einsum("ni,nij,nj->n", walls, covariances, walls)
    # As if the wall were as high as its line is long.
    straight = across < most_curved * (across + 2.0 * spread[:, 2])
    facing = np.abs(np.einsum("ij,ij->i", walls, views)) > _LEVEL
    floor = level & (np.abs(views[:, 2]) < _LEVEL) & (np.abs(normals[:, 2]) > 0.5)
    upright = floor & facing & (np.abs(along[:, 2]) < _LEVEL)
    normals[upright] = walls[upright]
    flat[floor] = (upright & straight)[floor]
    return normals, flat


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
