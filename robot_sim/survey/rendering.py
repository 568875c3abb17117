"""Rendered pictures of a world from a camera above it; needs a graphics library.

Without a display set ``MUJOCO_GL=egl`` (Mesa's software renderer is sufficient). Simulations do not need
this: it is for the pictures in the documentation.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.robot_placement import place_robot
from robot_sim.worlds.world import World


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Position and orientation of a camera."""

    at: tuple[float, float, float]
    """Point in the middle of the picture, in ``map`` [m]."""
    distance: float
    """Distance from there to the camera [m]."""
    azimuth: float
    """Yaw of the viewing direction [rad]."""
    elevation: float
    """Angle by which it looks down [rad]."""
    field_of_view: float = math.radians(45.0)
    """Angle from the picture's lower to its upper edge [rad]."""

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows: to the right, up and forward in the picture."""
        ca, sa = math.cos(self.azimuth), math.sin(self.azimuth)
        ce, se = math.cos(self.elevation), math.sin(self.elevation)
        return np.array([[sa, -ca, 0.0], [se * ca, se * sa, ce], [ce * ca, ce * sa, -se]])

    def project(
        self, points: FloatArray, width: int, height: int
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return pixels (N, 2), depths (N,) [m] and which of (N, 3) ``points`` [m] lie in the picture."""
        eye = np.array(self.at) - self.distance * self.axes[2]
        right, up, depth = self.axes @ (points - eye).T
        scale = 0.5 * height / math.tan(0.5 * self.field_of_view) / np.maximum(depth, 1e-6)
        pixels = np.column_stack([0.5 * width + scale * right, 0.5 * height - scale * up])
        seen = (depth > 0.1) & (pixels >= 0.0).all(axis=1) & (pixels < (width, height)).all(axis=1)
        return pixels, depth, seen


def render_world(
    world: World,
    camera: Viewpoint,
    *,
    width: int,
    height: int,
    hidden: tuple[str, ...] = ("ceiling",),
) -> npt.NDArray[np.uint8]:
    """Return the world with the robot at its spawn as colours (height, width, 3), on white.

    Args:
        world: The world.
        camera: Point of view.
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
        hidden: Prefixes of the names of geoms that are left out.
    """
    model = copy.copy(world.model)
    model.vis.global_.fovy = math.degrees(camera.field_of_view)
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.vis.headlight.ambient[:] = 0.45
    model.vis.headlight.diffuse[:] = 0.55
    model.vis.headlight.specular[:] = 0.0
    model.vis.map.zfar = 10.0 * camera.distance / model.stat.extent
    for geom in range(model.ngeom):
        if model.geom(geom).name.startswith(hidden):
            model.geom_rgba[geom, 3] = 0.0
    data = mujoco.MjData(model)
    place_robot(model, data, world.spawn)
    view = mujoco.MjvCamera()
    view.lookat[:] = camera.at
    view.distance = camera.distance
    view.azimuth = math.degrees(camera.azimuth)
    view.elevation = -math.degrees(camera.elevation)
    options = mujoco.MjvOption()
    options.geomgroup[:] = 1
    with mujoco.Renderer(model, height, width) as renderer:
        renderer.update_scene(data, view, options)
        picture: npt.NDArray[np.uint8] = renderer.render().copy()
    picture[(picture == 0).all(axis=2)] = 255  # where there is nothing
    return picture
