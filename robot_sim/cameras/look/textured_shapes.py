"""Solids as triangles with texture coordinates in metres, so that a texture has the same size on all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from localization.types import IntArray
from robot_sim.array_types import FloatArray

_AROUND: Final = 16
"""Sides of a round solid."""
_SLENDER: Final = 8
"""Sides of a round solid that is thinner than ``_THIN``."""
_THIN: Final = 0.08
"""Radius [m]."""
_RINGS: Final = 10
"""Rings of an ellipsoid from pole to pole."""


@dataclass(frozen=True, slots=True, eq=False)
class TexturedMesh:
    """Triangles; every vertex has a normal and texture coordinates."""

    vertices: FloatArray
    """Positions [m], (V, 3)."""
    normals: FloatArray
    """Unit normals, (V, 3)."""
    texcoords: FloatArray
    """Texture coordinates, (V, 2): 1 is one texture; the second grows downwards."""
    faces: IntArray
    """Vertices of each triangle, counter-clockwise from outside, (T, 3)."""

    def moved(self, position: FloatArray, rotation: FloatArray) -> Self:
        """Return the mesh rotated by (3, 3) and then shifted by (3,) [m]."""
        return type(self)(
            self.vertices @ rotation.T + position,
            self.normals @ rotation.T,
            self.texcoords,
            self.faces,
        )


def joined(meshes: list[TexturedMesh]) -> TexturedMesh:
    """Return several meshes as one."""
    offsets = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    return TexturedMesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.normals for m in meshes]),
        np.concatenate([m.texcoords for m in meshes]),
        np.concatenate([m.faces + o for m, o in zip(meshes, offsets, strict=True)]),
    )


def box_mesh(half: FloatArray, size: float, foot: float) -> TexturedMesh:
    """Return a box.

    Args:
        half: Half extents [m].
        size: Side of the texture [m]; 0 to fit it to each face.
        foot: Height of the middle above that where textures of upright faces begin [m].
    """
    parts = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = np.zeros(3)
            normal[axis] = sign
            # Seen from outside: to the right, and up (for top and bottom, +y).
            up = np.array([0.0, 0.0, 1.0]) if axis != 2 else np.array([0.0, 1.0, 0.0])
            right = np.cross(up, normal)
            corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
            vertices = normal * half + corners[:, :1] * right * half + corners[:, 1:] * up * half
            if size > 0.0:
                u, v = vertices @ right / size, vertices @ up
                v = (v + (foot if axis != 2 else 0.0)) / size
            else:
                u, v = 0.5 + 0.5 * corners[:, 0], 0.5 + 0.5 * corners[:, 1]
            parts.append(
                TexturedMesh(
                    vertices,
                    np.tile(normal, (4, 1)),
                    np.column_stack([u, 1.0 - v]),
                    np.array([(0, 1, 2), (0, 2, 3)]),
                )
            )
    return joined(parts)


def cylinder_mesh(radius: float, half: float, size: float, foot: float) -> TexturedMesh:
    """Return an upright cylinder; arguments as for ``box_mesh``."""
    n = _SLENDER if radius < _THIN else _AROUND
    angle = 2.0 * math.pi * np.arange(n + 1) / n
    around = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n + 1)])
    turns = max(1, round(2.0 * math.pi * radius / size)) if size > 0.0 else 1
    rows = []
    for z in (-half, half):
        v = (z + foot) / size if size > 0.0 else 0.5 + 0.5 * z / half
        rows.append(np.column_stack([turns * angle / (2.0 * math.pi), np.full(n + 1, 1.0 - v)]))
    vertices = np.concatenate([around * radius + (0.0, 0.0, z) for z in (-half, half)])
    i = np.arange(n)
    sides = np.concatenate(
        [np.column_stack([i, i + 1, n + 2 + i]), np.column_stack([i, n + 2 + i, n + 1 + i])]
    )
    side = TexturedMesh(vertices, np.tile(around, (2, 1)), np.concatenate(rows), sides)
    caps = []
    for sign in (1.0, -1.0):
        rim = np.vstack([(0.0, 0.0, sign * half), around[:-1] * radius + (0.0, 0.0, sign * half)])
        flat = rim[:, :2] / (size if size > 0.0 else 2.0 * radius) + 0.5
        after = 1 + (i + 1) % n
        faces = np.column_stack([np.zeros(n, int), 1 + i, after])
        normal = np.tile((0.0, 0.0, sign), (n + 1, 1))
        caps.append(TexturedMesh(rim, normal, flat, faces if sign > 0.0 else faces[:, ::-1]))
    return joined([side, *caps])


def ellipsoid_mesh(half: FloatArray, size: float) -> TexturedMesh:
    """Return an ellipsoid; arguments as for ``box_mesh``."""
    n = _AROUND
    around = 2.0 * math.pi * np.arange(n + 1) / n
    down = math.pi * np.arange(_RINGS + 1) / _RINGS
    lat, lon = np.meshgrid(down, around, indexing="ij")
    sphere = np.stack([np.sin(lat) * np.cos(lon), np.sin(lat) * np.sin(lon), np.cos(lat)], axis=-1)
    sphere = sphere.reshape(-1, 3)
    normals = sphere / half
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    scale = float(np.mean(half))
    turns = (
        (max(1, round(2.0 * math.pi * scale / size)), math.pi * scale / size)
        if size > 0.0
        else (1, 1)
    )
    texcoords = np.column_stack(
        [turns[0] * lon.ravel() / (2.0 * math.pi), turns[1] * lat.ravel() / math.pi]
    )
    return TexturedMesh(sphere * half, normals, texcoords, _lattice(_RINGS, n))


def plane_mesh(half_x: float, half_y: float, size: float) -> TexturedMesh:
    """Return a level rectangle, seen from above; arguments as for ``box_mesh``."""
    corners = np.array([(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)])
    scale = size if size > 0.0 else 1.0
    return TexturedMesh(
        np.column_stack([corners, np.zeros(4)]),
        np.tile((0.0, 0.0, 1.0), (4, 1)),
        np.column_stack([corners[:, 0], -corners[:, 1]]) / scale,
        np.array([(0, 1, 2), (0, 2, 3)]),
    )


def relief_meshes(
    x: FloatArray, y: FloatArray, heights: FloatArray, size: float, tile: int
) -> list[TexturedMesh]:
    """Return a relief as several meshes, each ``tile`` cells wide.

    Args:
        x: x of the columns [m].
        y: y of the rows [m].
        heights: Heights [m], one row for each y.
        size: Side of the texture [m].
        tile: Most cells along one side of a mesh.
    """
    slope_y, slope_x = np.gradient(heights, y, x)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(heights)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    gx, gy = np.meshgrid(x, y)
    points = np.stack([gx, gy, heights], axis=-1)
    meshes = []
    for i in range(0, len(y) - 1, tile):
        for j in range(0, len(x) - 1, tile):
            part = slice(i, i + tile + 1), slice(j, j + tile + 1)
            block = points[part]
            rows, columns = block.shape[0] - 1, block.shape[1] - 1
            flat = block.reshape(-1, 3)
            texcoords = np.column_stack([flat[:, 0], -flat[:, 1]]) / size
            # Split from the first corner to the opposite one, as MuJoCo's rays see the cells.
            faces = _lattice(rows, columns, upwards=True)
            meshes.append(TexturedMesh(flat, normals[part].reshape(-1, 3), texcoords, faces))
    return meshes


def _lattice(rows: int, columns: int, *, upwards: bool = False) -> IntArray:
    """Return the triangles of a lattice of (rows + 1, columns + 1) points."""
    i, j = (a.ravel() for a in np.mgrid[0:rows, 0:columns])
    here = i * (columns + 1) + j
    right, below = here + 1, here + columns + 1
    across = below + 1
    if upwards:
        return np.concatenate(
            [np.column_stack([here, right, across]), np.column_stack([here, across, below])]
        )
    return np.concatenate(
        [np.column_stack([here, below, across]), np.column_stack([here, across, right])]
    )
