"""Decals on the ground: the soft shadow round the foot of everything that stands on it, and patches of another surface.

They are drawn as clear films a few millimetres above the ground; depth is that of the ground beneath.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.array_types import FloatArray
from robot_sim.cameras.look.textured_shapes import TexturedMesh
from robot_sim.robot.mujoco_body import ROBOT_GROUP
from robot_sim.worlds.world import World

SHADOW: Final = "shadow"
"""Look of a shadow; any other is a key of ``LOOKS``."""

_LAYERS: Final = (0.008, 0.04, 0.09, 0.14)
"""How far the layers of a shadow reach beyond the foot [m]; a table's top has the outer one."""
_DARK: Final = 0.1
"""Opacity of a layer."""
_THIN: Final = 0.1
"""Thickness up to which what hangs above the ground is a table's top or a seat, and not what lies on one [m]."""
_TOUCHING: Final = 0.06
"""Height up to which a solid stands on the ground [m]."""
_LOW: Final = 0.9
"""Height up to which it throws a shadow on the ground beneath [m]."""
_LEVEL: Final = 0.01
"""Difference of heights across a decal up to which the ground is level [m]."""
_ROUND: Final = 0.05
"""Half-length from which a rectangle's corners are drawn with two points, and not with three [m]."""
_LIFT: Final = 0.002
"""Height of the lowest film above the ground [m], and of each above the last."""
_GEOM: Final = mujoco.mjtGeom


@dataclass(frozen=True, slots=True)
class Decal:
    """A rectangle with rounded corners, level, in the frame of a body or of the world."""

    look: str
    """``SHADOW`` or a key of ``LOOKS``."""
    opacity: float
    """Opacity, 0 to 1."""
    body: int
    """Body of the world's model that it moves with; 0 for the world."""
    at: tuple[float, float, float]
    """Its middle [m]."""
    yaw: float
    """Direction of its x axis [rad]."""
    half: tuple[float, float]
    """Half-lengths without the corners' radius [m]."""
    radius: float
    """Radius of its corners [m]."""

    def mesh(self, size: float) -> TexturedMesh:
        """Return its triangles, with a texture ``size`` [m] wide in the frame of the world or body."""
        a, b = self.half
        quarter = np.linspace(0.0, 0.5 * math.pi, 2 if min(a, b) > _ROUND else 3)
        rim = [
            np.column_stack(
                [
                    sx * a + self.radius * np.cos(quarter + start),
                    sy * b + self.radius * np.sin(quarter + start),
                ]
            )
            for start, sx, sy in (
                (0.0, 1, 1),
                (0.5 * math.pi, -1, 1),
                (math.pi, -1, -1),
                (1.5 * math.pi, 1, -1),
            )
        ]
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        flat = np.concatenate([np.zeros((1, 2)), *rim]) @ np.array([(c, s), (-s, c)])
        points = np.column_stack([flat, np.zeros(len(flat))]) + self.at
        n = len(points) - 1
        i = np.arange(n)
        faces: IntArray = np.column_stack([np.zeros(n, int), 1 + i, 1 + (i + 1) % n])
        texcoords = np.column_stack([points[:, 0], -points[:, 1]]) / size
        return TexturedMesh(points, np.tile((0.0, 0.0, 1.0), (n + 1, 1)), texcoords, faces)


def decals_of(world: World) -> tuple[Decal, ...]:
    """Return the decals of a world that was built from a floor plan, those on which others lie first."""
    if world.plan is None:
        return ()
    return (*_patches(world), *_shadows(world))


def _patches(world: World) -> Iterator[Decal]:
    for patch in world.patches:
        a, b = patch.half
        height = _level_height(world, np.array((patch.x, patch.y)), max(a, b))
        if height is not None:
            at = (patch.x, patch.y, height + _LIFT)
            yield Decal(patch.surface.name, 0.9, 0, at, patch.yaw, (a - 0.05, b - 0.05), 0.05)


def _shadows(world: World) -> Iterator[Decal]:
    model = world.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom in range(model.ngeom):
        kind, body = int(model.geom_type[geom]), int(model.geom_bodyid[geom])
        if kind not in (_GEOM.mjGEOM_BOX, _GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_ELLIPSOID):
            continue
        if model.geom_group[geom] == ROBOT_GROUP or _see_through(model, geom):
            continue
        moves = model.body_mocapid[body] >= 0
        if not moves and body != 0:
            continue
        middle = model.geom_pos[geom] if moves else data.geom_xpos[geom]
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        if rotation[8] < 0.999:
            continue
        a, b, c = (float(v) for v in model.geom_size[geom])
        if kind == _GEOM.mjGEOM_CYLINDER:
            a, b, c = a, a, b
        bottom = float(middle[2]) - c
        ground = 0.0 if moves else _level_height(world, middle[:2], 0.1)
        if ground is None or not -_TOUCHING < bottom - ground < _LOW:
            continue
        stands = bottom - ground < _TOUCHING
        if not stands and 2.0 * c > _THIN:
            continue
        round_foot = min(a, b) if kind != _GEOM.mjGEOM_BOX else 0.0
        yaw = math.atan2(rotation[3], rotation[0])
        layers = _LAYERS if stands else _LAYERS[3:]
        for number, margin in enumerate(layers):
            at = (float(middle[0]), float(middle[1]), ground + (number + 2) * _LIFT)
            half = (a - round_foot, b - round_foot)
            yield Decal(SHADOW, _DARK, body if moves else 0, at, yaw, half, round_foot + margin)


def _see_through(model: mujoco.MjModel, geom: int) -> bool:
    return bool(model.geom_rgba[geom, 3] < 0.99)


def _level_height(world: World, middle: FloatArray, reach: float) -> float | None:
    """Return the height of the ground at a point (2,), or None where it is not level within a distance [m]."""
    d = reach
    offsets = np.array([(0.0, 0.0), (d, d), (d, -d), (-d, d), (-d, -d)])
    heights = world.ground(middle + offsets)
    if not np.isfinite(heights[0]):
        return None
    around = heights[np.isfinite(heights)]
    return float(heights[0]) if np.ptp(around) < _LEVEL else None
