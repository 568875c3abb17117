"""Distances of points from a triangle mesh."""

from __future__ import annotations

import numpy as np

from localization.geometry import FloatArray
from localization.maps.open3d_import import import_open3d
from localization.types import IntArray


def distances_to_mesh(points: FloatArray, vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the distance (N,) of each point from the nearest triangle [m].

    Args:
        points: Points (N, 3) [m].
        vertices: Vertices (V, 3) [m]; used in single precision, a micrometre at ten metres.
        faces: Numbers of each triangle's vertices (F, 3).

    Raises:
        ImportError: If Open3D is missing or does not load; the message names the package to install.
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
