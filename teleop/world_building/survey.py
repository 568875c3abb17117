"""Map a scene: drive its survey route, or set up a scanner on a tripod along it.

The cloud holds nothing that a beam did not hit. The poses the points are placed at are the simulator's
own, and so is the steering: this is a survey with a perfect total station, not SLAM.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.cloud_builder import CloudBuilder, MappingConfig
from localization.maps.cloud import Cloud
from localization.motion.deskew import deskew
from localization.motion.odometry_track import OdometryTrack
from localization.types import IntArray, Pose, Scan, Sweep
from robot_sim import Simulation, SimulationConfig, World
from robot_sim.floorplan.plan import CloudSpec
from robot_sim.survey.total_station import TotalStation
from teleop.world_building.survey_drive import Progress, survey_drive

_SPAN: Final = 1 << 20
_HALF_SPAN: Final = _SPAN // 2
"""Cells of the sieve are numbered up to the span, half of it on either side of the origin."""


def survey(
    world: World,
    *,
    seed: int = 0,
    config: MappingConfig | None = None,
    sensors: SimulationConfig | None = None,
    progress: Progress = lambda share, text: None,
) -> Cloud:
    """Drive the world's survey route and return its cloud.

    Args:
        world: a scene with a survey route.
        seed: of the sensor noise.
        config: how points become a map; None for what the world asks for.
        sensors: what the robot carries; None for what it does by default.
        progress: called with the share done and a line of text.

    Raises:
        SurveyError: if the route took four times as long as its length lets expect.
    """
    simulation = Simulation(world, seed=seed, config=sensors)
    builder = CloudBuilder(config or mapping_config(world))
    track = OdometryTrack().extended(simulation.stamp, simulation.truth().map_from_base)
    waiting: list[Scan] = []
    for readings, pose in survey_drive(simulation, progress=progress):
        waiting += [r for r in readings if isinstance(r, Scan)]
        track = track.extended(simulation.stamp, pose)
        if waiting:
            builder.add(deskew(waiting, track, simulation.mounts, simulation.stamp), pose)
            waiting = []
    progress(1.0, f"thinning {builder.count / 1e6:.1f} M points")
    return builder.build(world.name)


def mapping_config(world: World) -> MappingConfig:
    """Return how points become the map that a world asks for, in neighbourhoods to match."""
    spec = world.plan.cloud if world.plan is not None else CloudSpec()
    return MappingConfig(
        spacing=spec.spacing,
        raw_spacing=0.25 * spec.spacing,
        plane_radius=min(max(0.09, spec.spacing), 0.15),
        highest=float("inf") if spec.highest is None else spec.highest,
    )


@dataclass(frozen=True, slots=True)
class StationConfig:
    """A scanner that is set up along the survey route and looks all round at each stop."""

    apart: float = 2.5
    """Between stops at least [m]."""
    height: float = 0.45
    """Above the ground [m]: about as high as the robot's scanners, for it is they who use the cloud."""
    resolution: float = float(np.deg2rad(0.4))
    """Between rays [rad]."""
    lowest: float = float(np.deg2rad(-80.0))
    """Elevation of the lowest rays [rad]: the tripod stands below them."""
    reach: float = 12.0
    """[m]. Farther surfaces are left to nearer stops."""
    overhead: float = 20.0
    """Reach of rays that go up steeply, for roofs [m]."""
    grazing: float = 0.15
    """Cosine of incidence below which a point is dropped."""
    sigma: float = 0.006
    """Standard deviation of a range [m]."""
    dense: float = 0.05
    """Side of the cells of which each gets one point at most from one side [m]."""

    def __post_init__(self) -> None:
        for name in ("apart", "height", "resolution", "reach", "overhead", "dense"):
            if not (np.isfinite(value := getattr(self, name)) and value > 0.0):
                raise ValueError(f"{name} must be > 0, got {value}")
        if not self.sigma >= 0.0:
            raise ValueError(f"sigma must be >= 0 m, got {self.sigma}")


def survey_from_stations(
    world: World,
    *,
    seed: int = 0,
    station: StationConfig = StationConfig(),
    config: MappingConfig | None = None,
    progress: Progress = lambda share, text: None,
) -> Cloud:
    """Look all round from stops along the world's survey route and return the cloud.

    Takes seconds for what the drive takes minutes. Glass leaves no points, nor does what moves.

    Args:
        world: any world; without routes the stops are its places and spawns.
        seed: of the noise and of which rays are left out.
        station: the scanner and its stops.
        config: how points become a map; None for what the world asks for.
        progress: called with the share done and a line of text.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, 2]))
    # The sieve leaves few points in a neighbourhood: to look for more of them takes time only.
    builder = CloudBuilder(config or replace(mapping_config(world), plane_points=20))
    instrument = TotalStation(world)
    fan = _fan(station)
    stops = _stops(world, instrument, station)
    sieve = _Sieve(station.dense)
    for i, stop in enumerate(stops):
        points = _panorama(instrument, stop, fan, station, rng)
        points = points[sieve.new(points, points - stop)]
        origins = np.broadcast_to(stop, points.shape)
        level = np.zeros(len(points), dtype=bool)
        builder.add(Sweep(0, points, origins, level), Pose.identity())
        progress((i + 1) / len(stops), f"stop {i + 1}, {builder.count / 1e6:.1f} M points")
    progress(1.0, f"thinning {builder.count / 1e6:.1f} M points")
    return builder.build(world.name)


def visible_surface(
    world: World,
    *,
    station: StationConfig = StationConfig(),
    progress: Progress = lambda share, text: None,
) -> FloatArray:
    """Return points (N, 3) of all surface that a robot on the survey route can see, without error.

    Each cell of it has one, on each side that is seen: so many points are so much surface.

    Args:
        world: any world.
        station: how near one looks, and how densely.
        progress: called with the share done and a line of text.
    """
    exact = replace(station, sigma=0.0)
    rng = np.random.default_rng(0)
    instrument = TotalStation(world)
    fan, stops, sieve = _fan(exact), _stops(world, instrument, exact), _Sieve(exact.dense)
    seen = []
    for i, stop in enumerate(stops):
        points = _panorama(instrument, stop, fan, exact, rng)
        seen.append(points[sieve.new(points, points - stop)])
        progress((i + 1) / len(stops), f"looking about, stop {i + 1}")
    return np.concatenate(seen)


def _fan(station: StationConfig) -> FloatArray:
    """Return unit vectors (N, 3) spread evenly over the sphere above the lowest elevation."""
    rows = []
    half_turn = 0.5 * np.pi
    count = round((half_turn - station.lowest) / station.resolution)
    for elevation in station.lowest + (np.arange(count) + 0.5) * station.resolution:
        around = max(1, round(2.0 * np.pi * float(np.cos(elevation)) / station.resolution))
        azimuth = 2.0 * np.pi * np.arange(around) / around
        level = np.cos(elevation)
        up = np.full(around, np.sin(elevation))
        rows.append(np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=1))
    return np.concatenate(rows)


def _stops(world: World, instrument: TotalStation, station: StationConfig) -> FloatArray:
    """Return where the scanner is set up, (N, 3) [m]: at the places, and where they leave gaps.

    Along the route another stop is made wherever none of those so far is both near and in sight.
    """
    poses = [world.spawn, *world.spawns.values(), *world.places.values()]
    stands = [pose.position + (0.0, 0.0, station.height) for pose in poses]
    chosen: list[FloatArray] = []
    for stand in stands:
        if all(np.linalg.norm(stand - other) >= 0.5 * station.apart for other in chosen):
            chosen.append(stand)
    route = world.survey or world.tour
    if len(route) < 2:
        return np.array(chosen)
    line = _densified(np.array(route), 0.25)
    ground = instrument.ground(line, float(world.spawn.position[2]))
    for candidate in np.column_stack([line, ground + station.height]):
        way = np.array(chosen) - candidate
        far = np.linalg.norm(way, axis=1)
        near = far < station.apart
        eyes = np.repeat(candidate[None], int(near.sum()), axis=0)
        toward = way[near] / np.maximum(far[near, None], 1e-9)
        seen = instrument.look(eyes, toward, station.apart).distances
        if not (seen >= far[near]).any():
            chosen.append(candidate)
    return np.array(chosen)


def _densified(corners: FloatArray, spacing: float) -> FloatArray:
    parts = []
    for a, b in itertools.pairwise(corners):
        n = max(1, int(np.ceil(float(np.hypot(*(b - a))) / spacing)))
        parts.append(a + np.linspace(0.0, 1.0, n, endpoint=False)[:, None] * (b - a))
    return np.concatenate([*parts, corners[-1:]])


def _panorama(
    instrument: TotalStation,
    stop: FloatArray,
    fan: FloatArray,
    station: StationConfig,
    rng: np.random.Generator,
) -> FloatArray:
    """Return the points (N, 3) that one stop sees, in ``map`` [m]."""
    eyes = np.ascontiguousarray(np.broadcast_to(stop, fan.shape))
    hits = instrument.look(eyes, fan, max(station.reach, station.overhead))
    reach = np.where(fan[:, 2] > 0.5, station.overhead, station.reach)
    kept = (hits.distances <= reach) & (hits.cosines > station.grazing)
    # Most rays near the stop would fall into cells that have their point: only some are looked at.
    patch = (hits.distances * station.resolution) ** 2 / np.maximum(hits.cosines, 1e-9)
    kept &= rng.random(len(fan)) * (0.5 * station.dense) ** 2 < patch
    noise = station.sigma * rng.standard_normal(len(fan))
    ranges = hits.distances[kept] + noise[kept]
    points: FloatArray = stop + ranges[:, None] * fan[kept]
    return points


class _Sieve:
    """Lets one point through for each cell of space and each of six sides it is seen from."""

    def __init__(self, cell: float) -> None:
        self._cell = cell
        self._seen = np.empty(0, dtype=np.int64)

    def new(self, points: FloatArray, rays: FloatArray) -> IntArray:
        """Return which points (N, 3), seen along rays (N, 3), are the first of their kind."""
        axis = np.abs(rays).argmax(axis=1)
        along = np.take_along_axis(rays, axis[:, None], axis=1)[:, 0] > 0.0
        x, y, z = (np.floor(points / self._cell).astype(np.int64) + _HALF_SPAN).T
        key = ((x * _SPAN + y) * _SPAN + z) * 6 + axis + 3 * along
        fresh, first = np.unique(key, return_index=True)
        known = np.isin(fresh, self._seen, assume_unique=True)
        self._seen = np.concatenate([self._seen, fresh[~known]])
        return np.sort(first[~known])
