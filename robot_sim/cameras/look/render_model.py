"""The model that is drawn: a world's solids as textured meshes, under lights and a sky.

It is made from the world's compiled model and compiled apart, so that the physics neither knows nor pays for it.
Solids of one look that stand near each other are one mesh. What moves is a mocap body, placed from the world's own
kinematics at each frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.cameras.look.ground_decals import SHADOW, Decal
from robot_sim.cameras.look.mesh_groups import MeshGroups
from robot_sim.cameras.look.own_materials import OwnMaterials
from robot_sim.cameras.look.sky_and_lights import add_lights, add_sky
from robot_sim.cameras.look.surface_looks import LOOKS
from robot_sim.cameras.look.textured_shapes import (
    TexturedMesh,
    box_mesh,
    cylinder_mesh,
    ellipsoid_mesh,
    plane_mesh,
    relief_meshes,
)
from robot_sim.cameras.look.world_looks import BARE, OWN

_RELIEF_CELLS: Final = 32
"""Cells along the side of one mesh of a terrain."""
_ENDLESS: Final = 150.0
"""Half-length with which an infinite plane is drawn [m]."""
_GEOM: Final = mujoco.mjtGeom


@dataclass(frozen=True, slots=True, eq=False)
class RenderModel:
    """A compiled model to draw."""

    model: mujoco.MjModel
    """The model; mocap bodies are what moves."""
    bodies: IntArray
    """Body of the world's model that each of its mocap bodies follows."""


def build_render_model(
    world: mujoco.MjModel, looks: tuple[str, ...], decals: tuple[Decal, ...] = (), *, indoors: bool
) -> RenderModel:
    """Build the model to draw.

    Args:
        world: The world's model.
        looks: Look of each of its geoms; see ``world_looks``.
        decals: Films on its ground.
        indoors: Whether it is lit by lamps rather than by the sun.
    """
    moving = _moving_bodies(world)
    data = mujoco.MjData(world)
    mujoco.mj_kinematics(world, data)
    spec = mujoco.MjSpec()
    own = OwnMaterials(spec, world)
    if not own.add_sky():
        add_sky(spec)
    if not own.lights:
        add_lights(spec, indoors=indoors)
    followers: dict[int, mujoco.MjsBody] = {0: spec.worldbody}
    groups = MeshGroups()
    for geom, look in enumerate(looks):
        body = int(world.geom_bodyid[geom])
        where = body if moving[body] else 0
        if where not in followers:
            followers[where] = spec.worldbody.add_body(mocap=True)
        position, rotation, quaternion = _pose(world, data, geom, static=where == 0)
        if world.geom_rgba[geom, 3] == 0.0:
            continue
        if look == OWN:
            own.add_geom(followers[where], geom, position, quaternion)
            continue
        colour = tuple(float(v) for v in world.geom_rgba[geom]) if look == BARE else ()
        for mesh in _shapes(world, geom, look, position, rotation):
            groups.add(where, look, mesh, colour)
    for decal in decals:
        if decal.body not in followers:
            followers[decal.body] = spec.worldbody.add_body(mocap=True)
        if decal.look == SHADOW:
            groups.add(decal.body, BARE, decal.mesh(1.0), (0.0, 0.0, 0.0, decal.opacity))
        else:
            size = LOOKS[decal.look].size or 1.0
            groups.add(decal.body, decal.look, decal.mesh(size), (decal.opacity,))
    groups.write(spec, followers)
    own.add_lights(followers)
    quality = spec.visual.quality
    quality.offsamples = quality.shadowsize = 0
    model = spec.compile()
    order = [body for body in followers if body != 0]
    return RenderModel(model, np.array(order, dtype=int))


def _moving_bodies(model: mujoco.MjModel) -> BoolArray:
    """Return which bodies can move."""
    moving = np.zeros(model.nbody, dtype=bool)
    for body in range(1, model.nbody):
        free = model.body_jntnum[body] > 0 or model.body_mocapid[body] >= 0
        moving[body] = free or moving[model.body_parentid[body]]
    return moving


def _pose(
    world: mujoco.MjModel, data: mujoco.MjData, geom: int, *, static: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, rotation and quaternion of a geom in the world, or in its body if that moves."""
    rotation, quaternion = np.empty(9), np.empty(4)
    if static:
        rotation[:] = data.geom_xmat[geom]
        mujoco.mju_mat2Quat(quaternion, rotation)
        return data.geom_xpos[geom].copy(), rotation.reshape(3, 3), quaternion
    quaternion[:] = world.geom_quat[geom]
    mujoco.mju_quat2Mat(rotation, quaternion)
    return world.geom_pos[geom].copy(), rotation.reshape(3, 3), quaternion


def _shapes(
    world: mujoco.MjModel, geom: int, look: str, position: FloatArray, rotation: FloatArray
) -> list[TexturedMesh]:
    """Return the meshes of a geom; none for shapes that are only inside of others."""
    size = LOOKS[look].size if look != BARE else 1.0
    half = world.geom_size[geom].astype(float)
    kind = int(world.geom_type[geom])
    foot = float(position[2])
    if kind == _GEOM.mjGEOM_BOX:
        mesh = box_mesh(half, size, foot)
    elif kind == _GEOM.mjGEOM_CYLINDER:
        mesh = cylinder_mesh(float(half[0]), float(half[1]), size, foot)
    elif kind in (_GEOM.mjGEOM_ELLIPSOID, _GEOM.mjGEOM_SPHERE):
        mesh = ellipsoid_mesh(half if kind == _GEOM.mjGEOM_ELLIPSOID else half[[0, 0, 0]], size)
    elif kind == _GEOM.mjGEOM_PLANE:
        wide, deep = (float(h) if h > 0.0 else _ENDLESS for h in half[:2])
        mesh = plane_mesh(wide, deep, size)
    elif kind == _GEOM.mjGEOM_HFIELD:
        return [m.moved(position, rotation) for m in _relief(world, geom, size)]
    else:
        return []
    return [mesh.moved(position, rotation)]


def _relief(world: mujoco.MjModel, geom: int, size: float) -> list[TexturedMesh]:
    field = int(world.geom_dataid[geom])
    rows, columns = int(world.hfield_nrow[field]), int(world.hfield_ncol[field])
    start = int(world.hfield_adr[field])
    wide, deep, high, _ = (float(v) for v in world.hfield_size[field])
    heights = high * world.hfield_data[start : start + rows * columns].reshape(rows, columns)
    x, y = np.linspace(-wide, wide, columns), np.linspace(-deep, deep, rows)
    return relief_meshes(x, y, heights.astype(float), size, _RELIEF_CELLS)
