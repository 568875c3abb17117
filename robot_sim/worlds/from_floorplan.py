"""Build a world from a floor plan: ground, walls, furniture, actors and the robot in one model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

import mujoco

from localization.types import Pose
from robot_sim.actors.actor_bodies import moving_bodies
from robot_sim.actors.extras import (
    PassingPerson,
    extra_bodies,
    spare_body,
    spares,
)
from robot_sim.arm.body import arm_top
from robot_sim.errors import SimulationError, WorldError
from robot_sim.floorplan.doorways import doorways
from robot_sim.floorplan.plan import NO_FLOOR, Placement, Plan
from robot_sim.floorplan.plan_ground import PlanGround, height_at, stand_on
from robot_sim.layout.furniture_rearrangement import rearranged
from robot_sim.layout.path_collisions import check_paths, check_ways
from robot_sim.robot.bumper_geom import add_bumper
from robot_sim.robot.drivable_surfaces import drivable_geoms, mark_drivable
from robot_sim.robot.mujoco_body import HEADROOM, add_robot, set_physics
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.scene_objects.blocks import Block, paint
from robot_sim.scene_objects.floor_surfaces import surface_named
from robot_sim.scene_objects.furniture import footprint, piece_blocks
from robot_sim.scene_objects.terrain import add_terrain
from robot_sim.scene_objects.walls import wall_blocks
from robot_sim.worlds.world import AS_MAPPED, TIMESTEP_NS, World, WorldOptions, check_places

_SPARE: Final = 0.05
"""Height above the top of an arm up to which it may collide [m]: half the gripper's, and a vehicle that tilts."""


def build_world(
    plan: Plan,
    *,
    robot: SkidSteer | None = None,
    options: WorldOptions = AS_MAPPED,
) -> World:
    """Build a world from a floor plan.

    Args:
        plan: The floor plan.
        robot: Robot that is compiled into the world; a P3-AT by default.
        options: Differences from the mapped world.

    Raises:
        WorldError: the plan cannot be built, nothing in it is drivable, or the robot does not fit
            at one of its spawns or places; the message gives the reason.
    """
    robot = robot or P3AT()
    spec = mujoco.MjSpec()
    notes = []
    try:
        arm = options.arm_table
        set_physics(spec, timestep=TIMESTEP_NS * 1e-9, arm=arm is not None)
        if options.alive and not plan.actors:
            notes.append("alive: the plan has no people, carts or doors, so nothing moves")
        if options.rearranged is not None:
            moved = rearranged(plan, options.rearranged)
            notes.extend(_unmoved(plan, moved))
            plan = moved
        ground = PlanGround(plan)
        _add_ground(spec, plan, ground)
        blocks = list(plan_blocks(plan, ground))
        if options.alive:
            check_paths(plan, blocks)
        # An arm reaches higher than the robot itself.
        top = 0.0 if arm is None else arm_top(arm, options.arm_mount) + _SPARE
        headroom = max(HEADROOM, top)
        for block in blocks:
            block.add_to(spec, headroom=headroom)
        for parcel in (*plan.parcels, *options.parcels):
            parcel.add_to(spec, height_at(ground.heights, parcel.x, parcel.y))
        parked = tuple(spares(options.spare_boxes, options.spare_people))
        moving = (
            *(moving_bodies(plan.actors, seed=options.timing) if options.alive else ()),
            *extra_bodies(options.extras, doorways(plan), ground.heights),
        )
        check_ways([e.path for e in options.extras if isinstance(e, PassingPerson)], blocks)
        bodies = (*moving, *map(spare_body, parked))
        for body in bodies:
            body.add_to(spec)
        surfaces = tuple(geom.name for geom in drivable_geoms(spec))
        if not surfaces:
            raise WorldError("no surface is drivable: give it a floor")
        add_robot(spec, surfaces=surfaces, robot=robot, arm=arm, mount=options.arm_mount)
        if not all(body.hard for body in bodies):
            add_bumper(spec, robot)
        model = spec.compile()
        spawns = _poses(plan.spawns, ground, robot)
        world = World(
            name=plan.name,
            model=model,
            spawn=next(iter(spawns.values())),
            places=_poses(plan.places, ground, robot),
            tour=plan.tour,
            survey=plan.survey or plan.tour,
            bounds=plan.bounds,
            spawns=spawns,
            robot=robot,
            plan=plan,
            arm=arm,
            arm_mount=options.arm_mount,
            patches=plan.patches,
            movers=tuple(body.mover for body in moving),
            spares=parked,
            ground=ground.heights,
            notes=tuple(notes),
        )
        check_places(world)
    except (ValueError, SimulationError) as error:
        raise WorldError(f"world {plan.name!r}: {' '.join(str(error).split())}") from None
    return world


def _unmoved(mapped: Plan, now: Plan) -> Iterator[str]:
    """Yield a note if a rearranged plan has all its furniture where it was mapped."""
    before = {piece.name: piece for piece in mapped.furniture}
    after = {piece.name: piece for piece in now.furniture}
    if all(after.get(name) == piece for name, piece in before.items()):
        added = len(after) - len(before)
        boxes = "" if not added else f"; {added} {'box was' if added == 1 else 'boxes were'} added"
        yield f"rearranged: no furniture of the plan can be moved{boxes}"


def plan_blocks(plan: Plan, ground: PlanGround | None = None) -> Iterator[Block]:
    """Yield the solids of everything static in a plan, except for drivable surfaces."""
    ground = ground or PlanGround(plan)
    for wall in plan.walls:
        yield from wall_blocks(wall)
    for glazing in plan.glazings:
        yield from glazing.blocks()
    for roof in plan.roofs:
        yield from roof.blocks()
    for piece in plan.furniture:
        yield from piece_blocks(piece, ground.lowest(footprint(piece)))
    if plan.ceiling:
        x0, y0, x1, y1 = plan.bounds
        half = (0.5 * (x1 - x0), 0.5 * (y1 - y0), 0.05)
        yield Block("ceiling", 0.5 * (x0 + x1), 0.5 * (y0 + y1), plan.height + 0.05, half)


def _add_ground(spec: mujoco.MjSpec, plan: Plan, ground: PlanGround) -> None:
    """Add the drivable surfaces: floor, slabs and terrains."""
    if plan.floor != NO_FLOOR:
        x0, y0, x1, y1 = plan.bounds
        floor = spec.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            pos=(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0),
            size=(0.5 * (x1 - x0), 0.5 * (y1 - y0), 0.1),
        )
        _surface(spec, floor, plan.floor)
    for slab in plan.slabs:
        _surface(spec, slab.block().add_to(spec), slab.surface)
    for terrain, grid in ground.grids:
        _surface(spec, add_terrain(spec, terrain, grid), terrain.surface)


def _surface(spec: mujoco.MjSpec, geom: mujoco.MjsGeom, name: str) -> None:
    surface = surface_named(name)
    mark_drivable(geom, surface.mu_long, surface.mu_lat, surface.rolling_resistance)
    paint(spec, geom, name)


def _poses(
    placements: Mapping[str, Placement], ground: PlanGround, robot: SkidSteer
) -> Mapping[str, Pose]:
    wheels = robot.wheelbase, robot.track
    return MappingProxyType(
        {key: stand_on(ground.heights, p, *wheels) for key, p in placements.items()}
    )
