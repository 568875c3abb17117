"""Leaves out of a picture what lies outside the camera's field of view, which would cost time and show nothing."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.cameras.camera_models import CameraModel
from robot_sim.cameras.look.mesh_groups import FILMS

_FILMS_REACH: Final = 9.0
"""Distance up to which shadows and patches on the ground are drawn [m]."""


class ViewCulling:
    """Hides and shows a model's geoms by their bounding spheres."""

    def __init__(self, model: mujoco.MjModel, camera: CameraModel) -> None:
        """Take a model, whose geoms' opacity is written, and the camera."""
        self._model = model
        self._opacity = model.geom_rgba[:, 3].copy()
        self._radius = np.where(model.geom_rbound > 0.0, model.geom_rbound, np.inf)
        self._reach = np.where(model.geom_group == FILMS, _FILMS_REACH, np.inf)
        h, v = 0.5 * camera.horizontal_fov, 0.5 * camera.vertical_fov
        # Inward normals of the frustum's sides in camera_link's axes: x forward, y left, z up.
        self._normals = np.array(
            [
                (math.sin(h), math.cos(h), 0.0),
                (math.sin(h), -math.cos(h), 0.0),
                (math.sin(v), 0.0, math.cos(v)),
                (math.sin(v), 0.0, -math.cos(v)),
            ]
        )

    def show(self, data: mujoco.MjData, eye: FloatArray, axes: FloatArray) -> None:
        """Show what may be in view from ``eye`` (3,) [m] with ``axes`` (3, 3) of ``camera_link``."""
        away = data.geom_xpos - eye
        near = np.einsum("ij,ij->i", away, away) < (self._reach + self._radius) ** 2
        inside = away @ (axes @ self._normals.T)
        seen = (inside > -self._radius[:, None]).all(axis=1)
        self._model.geom_rgba[:, 3] = np.where(seen & near, self._opacity, 0.0)
