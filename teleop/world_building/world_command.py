"""``farsteer world``: make worlds, and tell what is in them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import tyro

from localization.cli.terminal import Progress, say

if TYPE_CHECKING:
    from localization.types import Pose
    from robot_sim.floorplan.plan import Plan
    from robot_sim.worlds.world import World


@dataclass(frozen=True)
class Generate:
    """Make up a furnished building, with its cloud, in a folder of its own.

    The same seed and area always give the same building.
    """

    seed: int = 0
    """Decides everything about the building."""
    area: float = 250.0
    """Of its floor [m^2]."""
    out: Path | None = None
    """Folder to write; worlds/building-<seed> unless given."""
    cloud: bool = True
    """Whether to survey the building and write its cloud."""

    def __call__(self) -> int:
        """Run it."""
        from robot_sim.building_generator import generate
        from robot_sim.floorplan.toml_writer import plan_to_toml

        folder = self.out or Path("worlds") / f"building-{self.seed}"
        building = generate(self.seed, self.area, name=folder.resolve().name)
        command = f"farsteer world generate --seed {self.seed} --area {self.area:g}"
        notes = {
            room.pieces[0]: f"{room.name.replace('_', ' ')}, {room.rectangle.area:.0f} m^2"
            for room in building.rooms
            if room.pieces
        }
        kind = {"office": "An office floor", "house": "A house"}[building.style]
        heading = [
            f"{kind} that was made up by `{command}`.",
            "Metres; yaw in degrees. A wall runs from -> to; a door's or window's `at` is the distance",
            "of its middle from the wall's start.",
        ]
        text = plan_to_toml(building.plan, heading=heading, notes=notes)
        _write(folder, building.plan, text, f"{kind} that was made up.", command, self.cloud)
        return 0


@dataclass(frozen=True)
class FromMap:
    """Extrude a ROS occupancy map (map.yaml and its image) to a world with its cloud.

    Occupied cells become walls. Unknown cells are floor that no route leads to.
    """

    map: Annotated[Path, tyro.conf.Positional]
    """The map's .yaml, as map_server reads it."""
    height: float = 2.5
    """Of the walls [m]."""
    spawn: tuple[float, float, float] | None = None
    """Where the robot starts: x, y [m], heading [degrees]; the roomiest spot unless given."""
    out: Path | None = None
    """Folder to write; worlds/<name of the map> unless given."""
    cloud: bool = True
    """Whether to survey the world and write its cloud."""

    def __call__(self) -> int:
        """Run it."""
        from localization.maps.occupancy_grid import read_occupancy_map
        from robot_sim.floorplan.plan import Placement
        from robot_sim.floorplan.toml_writer import plan_to_toml
        from robot_sim.layout.plan_from_occupancy_map import plan_from_map

        grid = read_occupancy_map(self.map)
        folder = self.out or Path("worlds") / grid.name
        grid = replace(grid, name=folder.resolve().name)
        spawn = None
        if self.spawn is not None:
            x, y, yaw = self.spawn
            spawn = Placement(x, y, math.radians(yaw))
        plan = plan_from_map(grid, height=self.height, spawn=spawn)
        command = f"farsteer world from-map {self.map}"
        heading = [
            f"The occupancy map {self.map}, extruded: a line for each wall.",
            "Metres; yaw in degrees. A wall runs from -> to along its middle.",
        ]
        text = plan_to_toml(plan, heading=heading, tables=False)
        origin = f"The occupancy map `{self.map}`, extruded to {len(plan.walls)} pieces of wall."
        _write(folder, plan, text, origin, command, self.cloud)
        return 0


@dataclass(frozen=True)
class List:
    """List the scenes that come with the project, and those in worlds/."""

    def __call__(self) -> int:
        """Run it."""
        from robot_sim.floorplan.scene_folders import PLAN_FILE, scene_names
        from robot_sim.layout.route_planning import length
        from robot_sim.worlds.loading import load_plan
        from teleop.scene_clouds import scene_cloud_path

        ours = sorted(p.parent for p in Path("worlds").glob(f"*/{PLAN_FILE}"))
        for scene in (*scene_names(), *map(str, ours)):
            plan = load_plan(scene)
            x0, y0, x1, y1 = plan.bounds
            has = "" if scene_cloud_path(scene).is_file() else "   no cloud yet"
            area = f"{(x1 - x0) * (y1 - y0):6.0f} m2"
            say(f"{scene:<24}{area}   tour {length(plan.tour):5.0f} m{has}")
        return 0


@dataclass(frozen=True)
class Show:
    """Tell what is in a scene: its size, places, routes and drivable surfaces."""

    scene: Annotated[str, tyro.conf.Positional]
    """Name of a scene, or the path of a folder, a floor plan or an MJCF file."""

    def __call__(self) -> int:
        """Run it."""
        from robot_sim.worlds.loading import load_world

        say(*_described(load_world(self.scene), self.scene))
        return 0


Command: TypeAlias = (
    Annotated[Generate, tyro.conf.subcommand("generate")]
    | Annotated[FromMap, tyro.conf.subcommand("from-map")]
    | Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Show, tyro.conf.subcommand("show")]
)


@dataclass(frozen=True)
class Worlds:
    """Make worlds, and tell what is in them."""

    command: tyro.conf.OmitSubcommandPrefixes[tyro.conf.OmitArgPrefixes[Command]]

    def __call__(self) -> int:
        """Run the command."""
        run: Callable[[], int] = self.command
        return run()


def _write(folder: Path, plan: Plan, text: str, origin: str, command: str, cloud: bool) -> None:
    from teleop.world_building.scene_writer import write_scene

    bar = Progress()
    world, mapped = write_scene(
        folder, plan, text, origin=origin, command=command, cloud=cloud, progress=bar
    )
    bar.end()
    say(*_described(world, str(folder)))
    if mapped is None:
        say("", f"it has no cloud yet: farsteer map {folder} --quick")
    say(
        "",
        f"files in {folder}/",
        f"  farsteer serve --scene {folder}",
        f"  farsteer operate --map {folder / 'cloud.ply'}",
        f"  farsteer sim --scene {folder}",
    )


def _described(world: World, scene: str) -> list[str]:
    from robot_sim.layout.route_planning import length
    from robot_sim.robot.drivable_surfaces import drivable_names
    from teleop.scene_clouds import scene_cloud_path

    x0, y0, x1, y1 = world.bounds
    cloud = scene_cloud_path(scene)
    surfaces = drivable_names(world.model)
    lines = [
        f"{world.name}: {x1 - x0:.1f} x {y1 - y0:.1f} m, {world.area:.0f} m2,"
        f" {world.model.ngeom} geoms",
        f"tour      {length(world.tour):.0f} m",
        f"survey    {length(world.survey):.0f} m",
        f"cloud     {cloud if cloud.is_file() else 'none'}",
        f"drivable  {', '.join(surfaces[:12])}{' ...' if len(surfaces) > 12 else ''}",
        f"spawns    {_poses(world.spawns)}",
        f"places    {_poses(world.places)}",
    ]
    return [*lines, *(f"note      {note}" for note in world.notes)]


def _poses(poses: Mapping[str, Pose]) -> str:
    lines = [
        f"{name} ({p.position[0]:.1f}, {p.position[1]:.1f}, {math.degrees(p.yaw):.0f} deg)"
        for name, p in poses.items()
    ]
    return "\n          ".join(lines) if lines else "none"
