"""Surfaces of a building from the points of its cloud.

Nothing is assumed of the building but that its walls are upright: each straight piece of wall becomes rectangles that
leave the openings which the points leave; level surfaces above the floor become tops; the floor becomes an image of
what was seen of it. A gap is closed only where it is narrower than any way through.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.maps.cloud_from_grid import WALL_TOP
from localization.maps.ground_height import Ground, ground_of
from localization.surfaces.faces import Faces, faces_of
from localization.surfaces.floor import Floor, floor_of
from localization.surfaces.level_tops import tops_of
from localization.surfaces.wall_pieces import main_direction, pieces_of
from localization.types import BoolArray

HIGHEST: Final = 2.6
"""Height above the floor where surfaces end [m]: above any door, and below ceilings, which would hide the rooms."""
_UPRIGHT: Final = 0.35
"""Greatest vertical component of a wall's normal: it leans by at most 20 degrees."""
_LEVEL: Final = 0.8
"""Least vertical component of a level surface's normal, as of the ground's."""
_TALL: Final = 1.0
"""Height that a wall reaches at least [m]; what ends lower is furniture."""
_FLOOR: Final = 0.06
"""Height below which points belong to the floor [m]; the noise of a map and a sill are lower."""


@dataclass(frozen=True, slots=True, eq=False)
class Building:
    """Surfaces of a mapped place, in the cloud's frame."""

    walls: Faces
    """Upright faces of what reaches ``_TALL``."""
    furniture: Faces
    """Upright faces of what does not."""
    tops: FloatArray
    """(T, 4, 3) corners of level surfaces above the floor, anticlockwise from above [m]."""
    floor: Floor | None
    """The floor; None if nothing was seen of it, as in a flat map."""
    wall_height: float | None
    """The height [m] given to all walls, where the map is flat; None where they are as high as they were seen."""


def building_of(cloud: Cloud) -> Building:
    """Return the surfaces of a cloud whose z axis points up."""
    ground = ground_of(cloud)
    spacing = _spacing(cloud.points)
    height = cloud.points[:, 2] - ground.heights(cloud.points[:, :2])
    lean = cloud.normals[:, 2]
    seen = cloud.points[(lean > _LEVEL) & (np.abs(height) < _FLOOR)]
    floor = floor_of(seen, ground, spacing)
    flat = not (lean > _LEVEL).any()
    between = (height > (0.0 if flat else _FLOOR)) & (height < HIGHEST)
    upright = between & (np.abs(lean) < _UPRIGHT)
    faces = _upright_faces(cloud, upright, height, ground)
    if flat:
        walls = faces.with_height(WALL_TOP)
        return Building(walls, Faces.none(), np.zeros((0, 4, 3)), floor, WALL_TOP)
    tall = faces.piece_top > _TALL
    direction = main_direction(cloud.normals[upright, :2]) if upright.any() else 0.0
    tops = tops_of(cloud.points[between & (lean > _LEVEL)], spacing, direction)
    return Building(faces.only(tall), faces.only(~tall), tops, floor, None)


def _upright_faces(cloud: Cloud, upright: BoolArray, height: FloatArray, ground: Ground) -> Faces:
    points, normals = cloud.points[upright, :2], cloud.normals[upright, :2].astype(np.float64)
    if len(points) == 0:
        return Faces.none()
    return faces_of(pieces_of(points, normals), points, height[upright], ground)


def _spacing(points: FloatArray) -> float:
    """Return the median distance between neighbouring points [m], from a sample of them."""
    some = points[:: max(1, len(points) // 4000)]
    distance = cKDTree(points).query(some, k=2)[0][:, 1]
    apart = distance[distance > 0.0]
    return float(np.median(apart)) if len(apart) else 0.0
