"""Draws what a robot's camera sees: colours and depth of one instant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import TracebackType
from typing import Final, Self

import mujoco
import numpy as np
import numpy.typing as npt

from localization.types import Pose
from robot_sim.array_types import FloatArray
from robot_sim.cameras.camera_frame import CameraFrame, measured_depth
from robot_sim.cameras.camera_models import CameraModel
from robot_sim.cameras.gl_context import OffscreenContext
from robot_sim.cameras.look.ground_decals import Decal, decals_of
from robot_sim.cameras.look.render_model import build_render_model
from robot_sim.cameras.look.world_looks import looks_of
from robot_sim.cameras.view_culling import ViewCulling
from robot_sim.cameras.visual_state import VisualState
from robot_sim.worlds.world import World

_NEAR: Final = 0.03
"""Distance from which anything is drawn [m]."""
_FAR: Final = 300.0
"""Distance up to which anything is drawn [m]."""
_OFF: Final = tuple(
    int(getattr(mujoco.mjtRndFlag, f"mjRND_{name}"))
    for name in ("SHADOW", "REFLECTION", "HAZE", "FOG")
)
"""Effects of MuJoCo's that are not drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraScene:
    """A world as a camera needs it; picklable, so that another process can draw it."""

    model: mujoco.MjModel
    """The world's model, from which poses are computed."""
    base_from_camera: Pose
    """``base_from_camera`` of the robot's usual place for one."""
    looks: tuple[str, ...]
    """Look of each of its geoms; see ``look.world_looks``."""
    decals: tuple[Decal, ...]
    """Shadows and patches on its ground."""
    indoors: bool
    """Whether it is lit by lamps rather than by the sun."""


def camera_scene(world: World) -> CameraScene:
    """Return a world as its robot's camera needs it."""
    indoors = world.plan is not None and world.plan.ceiling
    return CameraScene(
        world.model, world.robot.camera_mount, looks_of(world), decals_of(world), indoors
    )


class CameraRenderer:
    """Draws frames of one camera; it belongs to the thread that made it.

    The same state gives the same bytes, in this process and in any other on the same machine.
    """

    def __init__(self, scene: World | CameraScene, model: CameraModel) -> None:
        """Prepare to draw.

        Args:
            scene: The world, or what ``camera_scene`` made of it.
            model: The camera.

        Raises:
            CameraUnavailableError: Nothing can be drawn on this machine; the message names what is missing.
        """
        scene = camera_scene(scene) if isinstance(scene, World) else scene
        self.model = model
        """The camera."""
        self._mount = scene.base_from_camera @ model.place
        self._world = scene.model
        self._data = mujoco.MjData(self._world)
        self._base = int(self._world.body("base_link").id)
        drawn = build_render_model(scene.model, scene.looks, scene.decals, indoors=scene.indoors)
        self._drawn, self._followed = drawn.model, drawn.bodies
        self._drawn_data = mujoco.MjData(self._drawn)
        self._context = OffscreenContext(self._drawn, model.width, model.height)
        self._view_culling = ViewCulling(self._drawn, model)
        self._scene = mujoco.MjvScene(self._drawn, self._drawn.ngeom + 100)
        flags = self._scene.flags
        for flag in _OFF:
            flags[flag] = 0
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = 1
        self._view = mujoco.MjvCamera()
        self._rect = mujoco.MjrRect(0, 0, model.width, model.height)
        self._rgb = np.empty((model.height, model.width, 3), np.uint8)
        self._depth = np.empty((model.height, model.width), np.float32)

    def render(self, state: VisualState) -> CameraFrame:
        """Draw one frame.

        Args:
            state: The instant, of a simulation of the same world.
        """
        self._context.make_current()
        world, drawn = self._data, self._drawn_data
        world.qpos[:] = state.qpos
        world.mocap_pos[:], world.mocap_quat[:] = state.mocap_pos, state.mocap_quat
        mujoco.mj_kinematics(self._world, world)
        drawn.mocap_pos[:] = world.xpos[self._followed]
        drawn.mocap_quat[:] = world.xquat[self._followed]
        mujoco.mj_kinematics(self._drawn, drawn)
        mujoco.mj_comPos(self._drawn, drawn)
        mujoco.mj_camlight(self._drawn, drawn)
        rotation = world.xmat[self._base].reshape(3, 3)
        eye = world.xpos[self._base] + rotation @ self._mount.position
        axes = rotation @ self._mount.rotation
        self._view_culling.show(drawn, eye, axes)
        category = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._drawn, drawn, self._option, None, self._view, category, self._scene
        )
        self._aim(eye, axes)
        mujoco.mjr_render(self._rect, self._scene, self._context.mjr)
        # One pass draws both, so that a pixel's colour and depth are of the same ray.
        mujoco.mjr_readPixels(self._rgb, self._depth, self._rect, self._context.mjr)
        model = self.model
        depth = measured_depth(_metres(self._depth), model.near, model.far, model.depth_step)
        # OpenGL's rows begin at the bottom.
        rgb: npt.NDArray[np.uint8] = np.ascontiguousarray(self._rgb[::-1])
        return CameraFrame(state.stamp, rgb, np.ascontiguousarray(depth[::-1]))

    def _aim(self, eye: FloatArray, axes: FloatArray) -> None:
        """Place MuJoCo's camera, and set its frustum so that pixels are where K has them."""
        model = self.model
        for camera in self._scene.camera:
            camera.pos[:] = eye
            camera.forward[:], camera.up[:] = axes[:, 0], axes[:, 2]
            camera.frustum_center = 0.0
            camera.frustum_width = _NEAR * math.tan(0.5 * model.horizontal_fov)
            camera.frustum_top = _NEAR * math.tan(0.5 * model.vertical_fov)
            camera.frustum_bottom = -camera.frustum_top
            camera.frustum_near, camera.frustum_far = _NEAR, _FAR
            camera.orthographic = 0

    def close(self) -> None:
        """Free the context."""
        self._context.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _metres(buffer: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return distances along the optical axis [m] of MuJoCo's reversed depth buffer (1 near, 0 far).

    With near plane n and far plane f a distance d is stored as ``(n f / d - n) / (f - n)``.
    """
    slope, offset = np.float32(1.0 / _NEAR - 1.0 / _FAR), np.float32(1.0 / _FAR)
    return np.float32(1.0) / (buffer * slope + offset)
