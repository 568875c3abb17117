"""Drives recorded once: readings and truth, of scenes and of buildings that no constant was tuned on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from localization.maps.cloud import Cloud
from localization.maps.map_files import load_cloud, save_cloud
from localization.maps.prepared_map import PreparedMap, default_cache, prepare
from localization.types import SECOND, Health, Pose, Reading
from robot_sim import Simulation, SimulationConfig, SkidSteer, World, WorldOptions, load_world
from robot_sim.building_generator import generate
from robot_sim.floorplan.plan import Plan
from robot_sim.worlds.from_floorplan import build_world
from robot_sim.worlds.loading import load_plan
from teleop.scenario.files.operator_settings import Station
from teleop.scenario.session.station import HINT_STAMP, station_hint
from teleop.scenario.tour_driver import TourDriver
from teleop.scene_clouds import load_scene_cloud
from teleop.world_building.station_survey import survey_from_stations

STANDS = 8 * SECOND // 5
"""The robot sets off after this time [ns]: the hint is given and answered before."""


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """What a localiser was given on a drive, and where the robot was."""

    name: str
    readings: tuple[Reading, ...]
    """In the order of arrival, with one hint that is 1 m and 20 degrees wrong."""
    truth: Mapping[int, Pose]
    """``map_from_base`` at each tick's stamp [ns]."""
    mounts: Mapping[str, Pose]

    def with_fault(self, name: str, readings: tuple[Reading, ...]) -> Recording:
        """Return the same drive with something wrong in its readings."""
        return replace(self, name=name, readings=readings)


def record(
    world: World, *, name: str, seed: int, seconds: float, config: SimulationConfig | None = None
) -> Recording:
    """Drive a world's tour by the truth, so that no method's errors steer what the others see.

    Args:
        world: where.
        name: of the recording.
        seed: of noise, biases and the hint's error.
        seconds: how long [s], standing at the beginning included.
        config: sensors and drive, if they are not the usual ones.
    """
    simulation = Simulation(world, seed=seed, config=config)
    readings: list[Reading] = []
    truth: dict[int, Pose] = {}
    for tick in driving(simulation, world, truth, seed=seed):
        readings += tick
        if simulation.stamp >= seconds * SECOND:
            break
    return Recording(name, tuple(readings), truth, simulation.mounts)


def driving(
    simulation: Simulation,
    world: World,
    truth: dict[int, Pose],
    *,
    seed: int,
    again: bool = False,
) -> Iterator[list[Reading]]:
    """Drive a world's tour by the truth and yield what each tick brings, the hint among it.

    Args:
        simulation: of the world, not yet stepped.
        world: whose tour is driven.
        truth: filled with ``map_from_base`` by stamp [ns].
        seed: of the hint's error.
        again: whether to drive back when the end is reached, and there again, for ever.
    """
    tour = world.tour
    driver = TourDriver(tour)
    truth[simulation.stamp] = here = simulation.truth().map_from_base
    hint = station_hint(Station("station"), seed, here)
    while again or not driver.done:
        if driver.done:
            tour = tour[::-1]
            driver = TourDriver(tour)
        readings: list[Reading] = [hint] if simulation.stamp == HINT_STAMP else []
        if simulation.stamp >= STANDS:
            simulation.command(driver.command(here, Health.TRACKING))
        readings += simulation.step()
        truth[simulation.stamp] = here = simulation.truth().map_from_base
        yield readings


@cache
def plan_of(scene: str) -> Plan:
    """Return the plan of a scene, or of a generated building, named ``building-<seed>-<area>``."""
    if not scene.startswith("building-"):
        return load_plan(scene)
    _, seed, area = scene.split("-")
    return generate(int(seed), float(area), name=scene).plan


def world_of(
    scene: str,
    *,
    rearranged: int | None = None,
    alive: bool = False,
    timing: int = 0,
    robot: SkidSteer | None = None,
) -> World:
    """Build a scene or a generated building.

    Args:
        scene: its name.
        rearranged: seed by which its furniture was moved since it was mapped, if it was.
        alive: whether people walk about in it.
        timing: seed of when they are where.
        robot: which one, if it is not a P3-AT as built.
    """
    options = WorldOptions(rearranged=rearranged, alive=alive, timing=timing)
    if not scene.startswith("building-"):
        return load_world(scene, robot=robot, options=options)
    return build_world(plan_of(scene), robot=robot, options=options)


@cache
def map_of(scene: str) -> PreparedMap:
    """Return the prepared map; a generated building is surveyed once and its cloud kept in the cache."""
    return prepare(_cloud(scene), cache=default_cache())


def _cloud(scene: str) -> Cloud:
    if not scene.startswith("building-"):
        return load_scene_cloud(scene)
    file: Path = default_cache() / "benchmarks" / f"{scene}.ply"
    if file.is_file():
        return load_cloud(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    return save_cloud(survey_from_stations(world_of(scene)), file)
