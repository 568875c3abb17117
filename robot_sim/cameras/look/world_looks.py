"""Which look each solid of a world has, from the plan that the world was built from."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

import mujoco
import numpy as np

from robot_sim.cameras.look.surface_looks import clothes, furniture_look, material_look
from robot_sim.floorplan.actors_in_plan import DoorLeaf
from robot_sim.floorplan.plan import Plan
from robot_sim.robot.mujoco_body import ROBOT_GROUP
from robot_sim.scene_objects.furniture import piece_blocks
from robot_sim.scene_objects.walls import wall_blocks
from robot_sim.worlds.world import World

OWN: Final = ""
"""Look of a solid that keeps the material of its own file."""
BARE: Final = "bare"
"""Look of a solid that has its plain colour."""

_HIGH_CEILING: Final = 4.0
"""Height from which a ceiling is a hall's [m]."""
_TEXTURED: Final = tuple(
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}"))
    for name in ("PLANE", "HFIELD", "SPHERE", "ELLIPSOID", "CYLINDER", "BOX")
)
"""Shapes that can be given a texture."""
_SKIRTED: Final = 4.0
"""Height up to which indoor walls have a skirting board [m]."""
_FLOORS: Final = {"wood": "wood_floor"}
_TRUNK: Final = re.compile(r"(.+)_trunk$")


def looks_of(world: World) -> tuple[str, ...]:
    """Return the look of each geom of a world's model: a key of ``LOOKS``, ``OWN`` or ``BARE``."""
    model = world.model
    plan = world.plan
    known = {**dict(_walls(plan)), **dict(_furniture(plan))} if plan is not None else {}
    doors = _door_leaves(world)
    ours = {mover.name for mover in world.movers} | {spare.name for spare in world.spares}
    return tuple(_look(world, model, geom, known, doors, ours) for geom in range(model.ngeom))


def _look(
    world: World,
    model: mujoco.MjModel,
    geom: int,
    known: dict[str, str],
    doors: frozenset[str],
    ours: set[str],
) -> str:
    name = model.geom(geom).name
    material = _material(model, geom)
    if model.geom_group[geom] == ROBOT_GROUP:
        return BARE
    body = model.body(int(model.geom_bodyid[geom])).name
    if world.plan is None and body not in ours:
        plain = material == "" and np.allclose(model.geom_rgba[geom], (0.5, 0.5, 0.5, 1.0))
        drivable = bool(model.nuser_geom) and model.geom_user[geom].any()
        shown = int(model.geom_type[geom]) in _TEXTURED
        return ("concrete" if drivable else "render") if plain and shown else OWN
    if name in known:
        return known[name]
    if name == "ceiling" and world.plan is not None:
        return "steel_roof" if world.plan.height >= _HIGH_CEILING else "ceiling"
    if name in doors:
        return "door"
    person = _TRUNK.match(name)
    if person:
        return clothes(person[1])
    if model.geom_user[geom].any() if model.nuser_geom else False:
        return _FLOORS.get(material, material_look(material, name))
    return material_look(material, name)


def _material(model: mujoco.MjModel, geom: int) -> str:
    index = int(model.geom_matid[geom])
    return str(model.material(index).name) if index >= 0 else ""


def _furniture(plan: Plan) -> Iterator[tuple[str, str]]:
    """Yield the geoms of all furniture with their looks."""
    for piece in plan.furniture:
        for block in piece_blocks(piece):
            part = block.name.removeprefix(f"{piece.name}_")
            yield block.name, furniture_look(piece.kind, part, block.material, piece.name)


def _walls(plan: Plan) -> Iterator[tuple[str, str]]:
    """Yield the geoms of those walls that look otherwise than their material, with their looks."""
    for wall in plan.walls:
        for block in wall_blocks(wall):
            if wall.material == "metal" and block.material == "metal":
                yield block.name, "cladding"
            elif block.material == "wall" and (wall.height > _SKIRTED or not plan.ceiling):
                yield block.name, "render"
            elif block.material == "glass" and not plan.ceiling:
                yield block.name, "window"


def _door_leaves(world: World) -> frozenset[str]:
    """Return the names of the geoms that are door leaves of wood."""
    actors = world.plan.actors if world.plan is not None else ()
    leaves = {f"{a.name}_slab" for a in actors if isinstance(a, DoorLeaf) and a.material == "wood"}
    closed = {
        f"{mover.name}_leaf" for mover in world.movers if mover.name.startswith("closed_door_")
    }
    return frozenset(leaves | closed)
