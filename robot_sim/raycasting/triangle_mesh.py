"""Triangle meshes of geoms: exact where flat, slightly outside of the surface where round."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.array_types import FloatArray

MeshFaces = tuple[FloatArray, IntArray]
"""Vertices (V, 3) [m] and triangles (F, 3) that index them."""

FAR: Final = 1000.0
"""Half the side of the square that represents an infinite plane [m]."""
_BULGE: Final = 6e-6
"""Greatest distance of the sides of cylinders from the surface [m], within the limits below. The
less, the fewer rays need an exact intersection."""
_SIDES: Final = (24, 1024)
_SUBDIVISIONS: Final = 3

_BOX_CORNERS: Final = np.array(
    [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
)
_BOX_FACES: Final = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """Triangles of many geoms, in ``map``."""

    vertices: FloatArray
    """Vertices (V, 3) [m]."""
    faces: IntArray
    """Indices of the vertices of each triangle (F, 3)."""
    geoms: IntArray
    """Geom of each triangle (F,)."""
    bulges: FloatArray
    """Distance of each triangle from the surface that it represents [m], (F,): 0 where that is
    flat, ``inf`` where it is curved both ways."""

    @property
    def planes(self) -> FloatArray:
        """(F, 4) unit normal and its product with any point of each triangle's plane."""
        a, b, c = (self.vertices[self.faces[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        lengths = np.sqrt(np.einsum("fd,fd->f", normals, normals))
        # A triangle without an area keeps a normal of zero.
        normals /= np.maximum(lengths, 1e-300)[:, None]
        return np.column_stack([normals, np.einsum("fd,fd->f", normals, a)])


def triangles_of(model: mujoco.MjModel, data: mujoco.MjData, geoms: IntArray) -> Triangles:
    """Return the triangles of ``geoms`` (G,) at their poses in ``data``."""
    vertices: list[FloatArray] = [np.zeros((0, 3))]
    faces: list[IntArray] = [np.zeros((0, 3), dtype=np.int64)]
    owners: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    bulges: list[FloatArray] = [np.zeros(0)]
    count = 0
    for geom in geoms:
        local, triangles = _faces_of(model, int(geom))
        matrix = data.geom_xmat[geom].reshape(3, 3)
        vertices.append(local @ matrix.T + data.geom_xpos[geom])
        faces.append(triangles + count)
        owners.append(np.full(len(triangles), geom, dtype=np.int64))
        bulges.append(np.full(len(triangles), _bulge_of(model, int(geom))))
        count += len(local)
    return Triangles(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(owners),
        np.concatenate(bulges),
    )


def _faces_of(model: mujoco.MjModel, geom: int) -> MeshFaces:
    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    match kind:
        case mujoco.mjtGeom.mjGEOM_BOX:
            return _BOX_CORNERS * size, _BOX_FACES
        case mujoco.mjtGeom.mjGEOM_PLANE:
            return _plane(size)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return _cylinder(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return _capsule(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            vertices, faces = _ball()
            return vertices * size[0], faces
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            vertices, faces = _ball()
            return vertices * size, faces
        case mujoco.mjtGeom.mjGEOM_HFIELD:
            return _heightfield(model, int(model.geom_dataid[geom]))
        case mujoco.mjtGeom.mjGEOM_MESH:
            return _mesh(model, int(model.geom_dataid[geom]))
        case _:
            raise NotImplementedError(f"no ray meets a geom of type {kind.name}")


def _bulge_of(model: mujoco.MjModel, geom: int) -> float:
    kind = mujoco.mjtGeom(int(model.geom_type[geom]))
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        radius = float(model.geom_size[geom, 0])
        return radius / math.cos(math.pi / _sides(radius)) - radius
    curved = (
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    )
    return math.inf if kind in curved else 0.0


def _plane(size: FloatArray) -> MeshFaces:
    """Return a rectangle that faces up; without a size it extends as far as any ray."""
    x, y = (s if s > 0.0 else FAR for s in size[:2])
    vertices = np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])
    return vertices, np.array([[0, 1, 2], [0, 2, 3]])


def _sides(radius: float) -> int:
    # A polygon around a circle is off by r (1 / cos(pi / n) - 1), about r (pi / n)^2 / 2.
    wanted = math.pi * math.sqrt(0.5 * radius / _BULGE)
    return int(np.clip(math.ceil(wanted), *_SIDES))


def _cylinder(radius: float, half: float) -> MeshFaces:
    n = _sides(radius)
    angles = 2.0 * math.pi * np.arange(n) / n
    # Around the circle and not in it: a ray that hits the cylinder must not miss its polygon.
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) * (radius / math.cos(math.pi / n))
    bottom = np.column_stack([ring, np.full(n, -half)])
    top = np.column_stack([ring, np.full(n, half)])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    side = np.concatenate([np.stack([i, j, j + n], axis=1), np.stack([i, j + n, i + n], axis=1)])
    fan = np.stack([np.zeros(n - 2, dtype=np.int64), i[1:-1], i[2:]], axis=1)
    return np.concatenate([bottom, top]), np.concatenate([side, fan, fan + n])


def _capsule(radius: float, half: float) -> MeshFaces:
    """Return the halves of a ball, separated along z, and a cylinder's side between them."""
    vertices, faces = _ball()
    shifted = vertices * radius
    # The ball has vertices on its equator, so that no triangle crosses it.
    upper = vertices[faces].mean(axis=1)[:, 2] > 0.0
    up, down = shifted + (0.0, 0.0, half), shifted - (0.0, 0.0, half)
    n = _sides(radius)
    cylinder, side = _cylinder(radius, half)
    count = len(shifted)
    return (
        np.concatenate([up, down, cylinder]),
        np.concatenate([faces[upper], faces[~upper] + count, side[: 2 * n] + 2 * count]),
    )


@functools.cache
def _ball() -> MeshFaces:
    """Return a subdivided octahedron just outside of the unit ball."""
    vertices = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    points = np.array(vertices, dtype=float)
    faces = np.array(
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    )
    for _ in range(_SUBDIVISIONS):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]))
        unique, where = np.unique(edges, axis=0, return_inverse=True)
        middles = points[unique].sum(axis=1)
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        ab, bc, ca = where.reshape(3, -1) + len(points)
        a, b, c = faces.T
        points = np.concatenate([points, middles])
        faces = np.concatenate(
            [np.stack(f, axis=1) for f in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Blown up until its nearest triangle touches the ball, so that all are outside.
    nearest = np.abs(np.einsum("fd,fd->f", normals, corners[:, 0])).min()
    return points / nearest, faces


def _mesh(model: mujoco.MjModel, mesh: int) -> MeshFaces:
    v, f = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[v : v + model.mesh_vertnum[mesh]]
    faces = model.mesh_face[f : f + model.mesh_facenum[mesh]]
    return vertices.astype(float), faces.astype(np.int64)


def _heightfield(model: mujoco.MjModel, field: int) -> MeshFaces:
    """Return MuJoCo's own triangles of a terrain, its four sides, and the box below it."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, top, base = model.hfield_size[field]
    start = model.hfield_adr[field]
    heights = model.hfield_data[start : start + rows * columns].astype(float) * top
    y, x = np.meshgrid(
        np.linspace(-half_y, half_y, rows), np.linspace(-half_x, half_x, columns), indexing="ij"
    )
    surface = np.column_stack([x.ravel(), y.ravel(), heights])
    index = np.arange(rows * columns).reshape(rows, columns)
    # A cell is split along the diagonal from its first to its last corner.
    here, right = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    above, across = index[1:, :-1].ravel(), index[1:, 1:].ravel()
    ground = np.concatenate(
        [np.stack([here, right, across], axis=1), np.stack([here, across, above], axis=1)]
    )
    rim = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    foot = surface[rim] * (1.0, 1.0, 0.0)
    count, around = len(surface), len(rim)
    i, j = np.arange(around), (np.arange(around) + 1) % around
    walls = np.concatenate(
        [
            np.stack([rim[i], rim[j], count + j], axis=1),
            np.stack([rim[i], count + j, count + i], axis=1),
        ]
    )
    below = _BOX_CORNERS * (half_x, half_y, 0.5 * base) - (0.0, 0.0, 0.5 * base)
    return (
        np.concatenate([surface, foot, below]),
        np.concatenate([ground, walls, _BOX_FACES + count + around]),
    )
