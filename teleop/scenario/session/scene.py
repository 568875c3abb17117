"""The world of a scenario with its prepared map; what is costly to build is kept for the next run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Final

from localization.maps.cloud import Cloud
from localization.maps.map_cache import default_cache
from localization.maps.prepared_map import PreparedMap, prepare
from robot_sim import SimulationConfig, World
from robot_sim.actors.extras import Extra
from robot_sim.scene_objects.floor_surfaces import Patch, surface_named
from robot_sim.scene_objects.parcels import Parcel
from robot_sim.survey.route_proposal import with_routes
from teleop.robot.serving.robot_options import RobotOptions
from teleop.scenario.files.scenario import NO_SCANNERS, Scenario, WorldSettings
from teleop.scenario.session.sensor_faults import scanner_faults, slip_faults
from teleop.scenario.session.world_checks import check, check_settings
from teleop.scenario.session.world_extras import extras_of
from teleop.scene_clouds import load_scene_cloud, scene_cloud_path

_FAR: Final = 1000.0
"""Edge of a ground that no robot reaches [m]."""
_WORLDS = 16
"""Worlds that are kept."""
_MAPS = 4
"""Prepared maps that are kept."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A world and the map that the robot has of it."""

    world: World
    """The world, with what the scenario changes in it."""
    cloud: Cloud
    """The map, as it was before."""
    prepared: PreparedMap
    """The map, prepared for the localiser."""
    map_file: Path
    """The map's file."""


def checked_scene_of(scenario: Scenario, folder: Path | None = None) -> Scene:
    """Check a scenario against its world, and build that; arguments and further errors as for ``scene_of``.

    Raises:
        ScenarioError: If the scenario cannot be run as it says, or never be passed; the error names the field.
    """
    check_settings(scenario.world, folder)
    check(scenario, mapped_world(scenario, folder))
    return scene_of(scenario, folder)


def scene_of(scenario: Scenario, folder: Path | None = None) -> Scene:
    """Build the world of a scenario, and load its map.

    Args:
        scenario: The scenario.
        folder: Folder of its file, in which scenes of its own are looked for.

    Raises:
        SimulationError: If the world cannot be built.
        CloudError: If the scene has no map.
    """
    name = scene_name(scenario.world, folder)
    cloud, prepared = _map(name)
    world = mapped_world(scenario, folder)
    if extras := extras_of(scenario, world):
        world = _with_tour(scenario, _world(scenario.world, name, _timing(scenario), extras))
    return Scene(world, cloud, prepared, scene_cloud_path(name))


def mapped_world(scenario: Scenario, folder: Path | None) -> World:
    """Return the world without what comes into it at its time."""
    name = scene_name(scenario.world, folder)
    return _with_tour(scenario, _world(scenario.world, name, _timing(scenario), ()))


def _with_tour(scenario: Scenario, world: World) -> World:
    """Return a world with a tour, if the scenario needs one; an own one goes before one that is planned.

    Raises:
        WorldError: If there is no floor for one.
    """
    return _planned(world) if scenario.mission.tour else world


def _timing(scenario: Scenario) -> int:
    """Return the seed of what moves on its own, on which nothing else depends."""
    return scenario.seed if scenario.world.alive else 0


def scene_name(settings: WorldSettings, folder: Path | None) -> str:
    """Return a shipped scene's name, or the path of a scene beside the scenario file."""
    beside = None if folder is None else folder / settings.scene
    return str(beside) if beside is not None and beside.exists() else settings.scene


def options_of(settings: WorldSettings) -> RobotOptions:
    """Return the robot and the state of its world as ``farsteer sim`` has them."""
    return RobotOptions(
        scanner="default" if settings.scanner == NO_SCANNERS else settings.scanner,
        inertial=settings.inertial,
        effects=settings.effects,
        sun=settings.sun,
        firmware=settings.firmware,
        uneven_tyres=settings.uneven_tyres,
        alive=settings.alive,
        rearranged=settings.rearranged,
        arm=settings.arm,
        arm_mount=settings.arm_mount,
        arm_speed=settings.arm_speed,
    )


@lru_cache(maxsize=_WORLDS)
def _world(settings: WorldSettings, name: str, timing: int, extras: tuple[Extra, ...]) -> World:
    parcels = tuple(
        Parcel(p.name, *p.at[:2], p.z, math.radians(sum(p.at[2:])), p.size, p.mass)
        for p in settings.parcels
    )
    world = options_of(settings).world(name, timing, extras, parcels=parcels)
    return world if settings.surface is None else on_surface(world, settings.surface)


def on_surface(world: World, surface: str) -> World:
    """Return a world whose whole ground has the friction of a surface.

    Raises:
        UnknownSurfaceError: If there is no such surface.
    """
    everywhere = Patch(surface_named(surface), 0.0, 0.0, (_FAR, _FAR))
    return replace(world, patches=(*world.patches, everywhere))


@lru_cache(maxsize=_WORLDS)
def _planned(world: World) -> World:
    return with_routes(world)


@lru_cache(maxsize=_MAPS)
def _map(name: str) -> tuple[Cloud, PreparedMap]:
    cloud = load_scene_cloud(name)
    return cloud, prepare(cloud, cache=default_cache())


def simulation_config(scenario: Scenario) -> SimulationConfig:
    """Return sensors and drive, with the faults that are known from the start."""
    config = options_of(scenario.world).simulation(slip_faults(scenario.fault))
    if scenario.world.scanner == NO_SCANNERS:
        return replace(config, scanners=())
    return replace(config, scanner_faults=scanner_faults(scenario.fault))
