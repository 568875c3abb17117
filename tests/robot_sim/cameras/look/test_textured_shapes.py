from __future__ import annotations

import numpy as np
import pytest

from robot_sim.cameras.look.ground_decals import Decal
from robot_sim.cameras.look.textured_shapes import (
    TexturedMesh,
    box_mesh,
    cylinder_mesh,
    ellipsoid_mesh,
    plane_mesh,
    relief_meshes,
)

HALF = np.array((0.5, 1.0, 2.0))
CLOSED = {
    "box": (box_mesh(HALF, 1.0, 0.0), 8.0),
    "cylinder": (cylinder_mesh(0.5, 1.0, 1.0, 0.0), np.pi * 0.5),
    "ellipsoid": (ellipsoid_mesh(HALF, 1.0), 4.0 / 3.0 * np.pi),
}


def corners(mesh: TexturedMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return a, b, c


@pytest.mark.parametrize("name", CLOSED)
def test_triangles_face_outwards_as_their_normals_do(name: str) -> None:
    mesh, volume = CLOSED[name]
    a, b, c = corners(mesh)
    facing = np.cross(b - a, c - a)

    # By the divergence theorem.
    assert (a * facing).sum() / 6.0 == pytest.approx(volume, rel=0.06)
    area = np.linalg.norm(facing, axis=1)
    along = (facing * mesh.normals[mesh.faces].mean(axis=1)).sum(axis=1)
    assert (along[area > 1e-9] > 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)


def test_a_texture_is_as_large_on_every_face_of_a_box() -> None:
    mesh = box_mesh(HALF, 0.8, 2.0)
    a, b, c = corners(mesh)
    ta, tb, tc = (mesh.texcoords[mesh.faces[:, i]] for i in range(3))
    for p, q, tp, tq in ((a, b, ta, tb), (b, c, tb, tc)):
        length, taken = np.linalg.norm(q - p, axis=1), np.linalg.norm(tq - tp, axis=1)
        np.testing.assert_allclose(taken, length / 0.8)


def test_upright_faces_begin_at_the_ground() -> None:
    mesh = box_mesh(HALF, 4.0, 2.0)
    upright = np.abs(mesh.normals[:, 2]) < 0.5
    low = upright & (mesh.vertices[:, 2] < 0.0)

    # The last row of the texture is the lowest.
    np.testing.assert_allclose(mesh.texcoords[low, 1], 1.0)
    np.testing.assert_allclose(mesh.texcoords[upright & ~low, 1], 0.0)


def test_a_fitted_texture_fills_each_face_once() -> None:
    mesh = box_mesh(HALF, 0.0, 0.0)

    assert sorted(set(mesh.texcoords.ravel().tolist())) == [0.0, 1.0]


def test_a_relief_is_cut_into_parts_that_meet() -> None:
    x, y = np.linspace(-2.0, 2.0, 9), np.linspace(0.0, 1.0, 5)
    heights = 0.1 * np.add.outer(y**2, x**2)
    parts = relief_meshes(x, y, heights, 1.0, 3)

    assert len(parts) == 6
    seen = {tuple(v) for part in parts for v in part.vertices.round(9).tolist()}
    assert len(seen) == 45
    assert sum(len(part.faces) for part in parts) == 2 * 8 * 4
    for part in parts:
        a, b, c = corners(part)
        assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()


def test_planes_and_decals_are_seen_from_above() -> None:
    decal = Decal("shadow", 0.1, 0, (1.0, 2.0, 0.01), 0.3, (0.4, 0.2), 0.1)
    for mesh, area in (
        (plane_mesh(2.0, 3.0, 1.0), 24.0),
        (decal.mesh(1.0), 0.8 * 0.4 + 2 * 0.1 * 1.2 + np.pi * 0.01),
    ):
        a, b, c = corners(mesh)
        up = np.cross(b - a, c - a)[:, 2]
        assert (up > -1e-12).all()
        assert 0.5 * up.sum() == pytest.approx(area, rel=0.02)
    np.testing.assert_allclose(decal.mesh(1.0).vertices[0], (1.0, 2.0, 0.01))
