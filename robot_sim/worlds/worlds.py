"""Worlds: a plan as a compiled MuJoCo model with the robot in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final

import mujoco

from localization.types import Pose
from robot_sim.actors.movers import Mover, moving_bodies
from robot_sim.errors import SimulationError, WorldError
from robot_sim.floorplan.plan import NO_FLOOR, Placement, Plan, Waypoint as Waypoint
from robot_sim.floorplan.plan_ground import Ground
from robot_sim.floorplan.scene_folders import (
    PLAN_FILE,
    scene_folder as scene_folder,
    scene_names as scene_names,
)
from robot_sim.floorplan.toml_reader import plan_from_toml
from robot_sim.layout.furniture_moves import rearranged
from robot_sim.layout.path_clearance import check_paths
from robot_sim.placement import obstacles_touched as obstacles_touched, place_robot as place_robot
from robot_sim.robot.bumper_geom import add_fender
from robot_sim.robot.drivable_surfaces import drivable_geoms, mark_drivable
from robot_sim.robot.mujoco_body import add_robot, set_physics
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.scene_objects.blocks import Block, paint
from robot_sim.scene_objects.floor_surfaces import Patch, surface_named
from robot_sim.scene_objects.furniture import footprint, piece_blocks
from robot_sim.scene_objects.terrain import add_terrain
from robot_sim.scene_objects.walls import wall_blocks

TIMESTEP_NS: Final = 4_000_000
"""One physics step [ns]. The contact recipe holds up to 5 ms; chi, creep and kerbs are as at 1 ms."""


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """What can be different about a world from one day to the next."""

    alive: bool = False
    """Whether people walk about, doors swing and carts are pushed."""
    rearranged: int | None = None
    """Seed by which furniture was moved since the world was mapped; None leaves it in its place."""
    timing: int = 0
    """Seed of when those who live there are where, as far as the plan leaves it open."""

    def __post_init__(self) -> None:
        for key in ("rearranged", "timing"):
            seed = getattr(self, key)
            if seed is not None and seed < 0:
                raise WorldError(f"{key} is a seed and must be >= 0, got {seed}")


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A place with the robot in it. Its model is shared by simulations and never changed."""

    name: str
    model: mujoco.MjModel
    spawn: Pose
    """``map_from_base`` where the robot starts."""
    places: Mapping[str, Pose]
    """``map_from_base`` of each named place."""
    tour: tuple[Waypoint, ...]
    """A drive through most rooms, ending near where it began."""
    survey: tuple[Waypoint, ...]
    """A longer drive that sees every corner, for building a map."""
    bounds: tuple[float, float, float, float]
    """Smallest x, y and largest x, y of the floor [m]."""
    spawns: Mapping[str, Pose] = field(default_factory=lambda: MappingProxyType({}))
    """``map_from_base`` of each start pose, ``spawn`` among them."""
    robot: SkidSteer = field(default_factory=P3AT)
    """Compiled into the model."""
    plan: Plan | None = None
    """What it was built from; None for a world that was not built from a plan."""
    patches: tuple[Patch, ...] = ()
    """Where the ground grips otherwise than what it belongs to."""
    movers: tuple[Mover, ...] = ()
    """What moves on its own; none unless the world is alive."""
    notes: tuple[str, ...] = ()
    """What in a user's file is not done as it says, one line each."""

    @property
    def area(self) -> float:
        """Floor area within the bounds [m^2]."""
        x0, y0, x1, y1 = self.bounds
        return (x1 - x0) * (y1 - y0)


def load_plan(scene: str) -> Plan:
    """Read the plan of a scene.

    Args:
        scene: the name of one that comes with the project, or the path of any other's folder.

    Raises:
        UnknownSceneError: there is no such scene; the message lists those there are.
        WorldError: it makes no sense.
    """
    folder = scene_folder(scene)
    return plan_from_toml((folder / PLAN_FILE).read_text(encoding="utf-8"), name=folder.name)


def load_world(
    name: str,
    *,
    robot: SkidSteer | None = None,
    options: WorldOptions = WorldOptions(),
) -> World:
    """Build the world of a scene.

    Args:
        name: Of one that comes with the project, the path of any other's folder, or that of a
            floor plan (``.toml``) or of an MJCF file (``.xml``).
        robot: Compiled into the world.
        options: What is different about it today.

    Raises:
        UnknownSceneError: there is no such scene; the message lists those there are.
        WorldError: its floor plan cannot be built.
    """
    path = Path(name)
    if path.suffix == ".xml":
        if options != WorldOptions():
            raise WorldError(
                f"{path.name}: an MJCF has no options; it moves what its joints let move"
            )
        # Imported here, for it builds on this module.
        from robot_sim.worlds.mjcf_world import load_mjcf

        return load_mjcf(path, robot=robot)
    if path.suffix == ".toml":
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise WorldError(f"cannot read the floor plan {name!r}: {error}") from None
        return parse_world(text, name=path.stem, robot=robot, options=options)
    return build_world(load_plan(name), robot=robot, options=options)


def parse_world(
    text: str,
    *,
    name: str,
    robot: SkidSteer | None = None,
    options: WorldOptions = WorldOptions(),
) -> World:
    """Build a world from the text of a floor plan; see ``load_world`` for the rest."""
    return build_world(plan_from_toml(text, name=name), robot=robot, options=options)


def build_world(
    plan: Plan,
    *,
    robot: SkidSteer | None = None,
    options: WorldOptions = WorldOptions(),
) -> World:
    """Build a world from a plan; see ``load_world`` for the rest.

    Raises:
        WorldError: the plan cannot be built, nothing in it is drivable, or the robot does not fit
            at one of its spawns or places; the message names what is wrong.
    """
    robot = robot or P3AT()
    spec = mujoco.MjSpec()
    set_physics(spec, timestep=TIMESTEP_NS * 1e-9)
    try:
        if options.rearranged is not None:
            plan = rearranged(plan, options.rearranged)
        ground = Ground(plan)
        _add_ground(spec, plan, ground)
        blocks = list(plan_blocks(plan, ground))
        if options.alive:
            check_paths(plan, blocks)
        for block in blocks:
            block.add_to(spec)
        bodies = tuple(
            moving_bodies(plan.inhabitants, seed=options.timing) if options.alive else ()
        )
        for body in bodies:
            body.add_to(spec)
        surfaces = tuple(geom.name for geom in drivable_geoms(spec))
        if not surfaces:
            raise WorldError("no surface is drivable: give it a floor")
        add_robot(spec, surfaces=surfaces, robot=robot)
        if bodies:
            add_fender(spec, robot)
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
            patches=plan.patches,
            movers=tuple(body.mover for body in bodies),
        )
        check_places(world)
    except (ValueError, SimulationError) as error:
        raise WorldError(f"world {plan.name!r}: {' '.join(str(error).split())}") from None
    return world


def plan_blocks(plan: Plan, ground: Ground | None = None) -> Iterator[Block]:
    """Yield the blocks of everything in a plan that stands still, but for what is driven on."""
    ground = ground or Ground(plan)
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


def _add_ground(spec: mujoco.MjSpec, plan: Plan, ground: Ground) -> None:
    """Add what is driven on: the floor, slabs and terrains."""
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
    placements: Mapping[str, Placement], ground: Ground, robot: SkidSteer
) -> Mapping[str, Pose]:
    return MappingProxyType(
        {key: ground.stand(p, robot.wheelbase, robot.track) for key, p in placements.items()}
    )


def check_places(world: World) -> None:
    """Raise a WorldError if the robot cannot stand at one of the named poses."""
    data = mujoco.MjData(world.model)
    x0, y0, x1, y1 = world.bounds
    for kind, poses in (("spawn", world.spawns), ("place", world.places)):
        for name, pose in poses.items():
            x, y = pose.position[:2]
            if not (x0 <= x <= x1 and y0 <= y <= y1):
                raise WorldError(
                    f"{kind} {name!r} at x {x:.2f}, y {y:.2f} is off the floor, which reaches from"
                    f" {x0:g}, {y0:g} to {x1:g}, {y1:g}"
                )
            try:
                place_robot(world.model, data, pose)
            except WorldError as error:
                raise WorldError(f"{kind} {name!r}: {error}") from None
