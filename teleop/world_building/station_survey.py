"""Map of a scene from a scanner that is set up at stops along the survey route.

The cloud contains only points that a beam has hit, at ground-truth positions with range noise.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.cloud_builder import CloudBuilder
from localization.mapping.wall_faces import lost_faces_warning, quadrants
from localization.maps.cloud import Cloud
from localization.types import IntArray, Pose, Sweep
from robot_sim import World
from robot_sim.survey.total_station import TotalStation
from teleop.errors import SettingError
from teleop.world_building.survey import mapping_config
from teleop.world_building.survey_drive import Progress

_SPAN: Final = 1 << 20
_HALF_SPAN: Final = _SPAN // 2
"""Number of cells of the occupied-cell filter along an axis, half of it on either side of the origin."""


@dataclass(frozen=True, slots=True)
class StationConfig:
    """A scanner that is set up along the survey route and scans all round at each stop."""

    apart: float = 2.5
    """Least distance between stops [m]."""
    height: float = 0.45
    """Height above the ground [m]: about that of the robot's scanners, which are matched with the cloud."""
    resolution: float = float(np.deg2rad(0.4))
    """Angle between rays [rad]."""
    lowest: float = float(np.deg2rad(-80.0))
    """Elevation of the lowest rays [rad]: the tripod stands below them."""
    reach: float = 12.0
    """Largest range [m]; farther surfaces are left to nearer stops."""
    overhead: float = 20.0
    """Largest range of steeply rising rays, for roofs [m]."""
    grazing: float = 0.15
    """Cosine of the angle of incidence below which a point is dropped."""
    sigma: float = 0.006
    """Standard deviation of a range [m]."""
    dense: float = 0.05
    """Side of the cells that keep one point at most for each viewing side [m]."""

    def __post_init__(self) -> None:
        for name in ("apart", "height", "resolution", "reach", "overhead", "dense"):
            if not (np.isfinite(value := getattr(self, name)) and value > 0.0):
                raise SettingError(f"{name} must be > 0, got {value}")
        if not self.sigma >= 0.0:
            raise SettingError(f"sigma must be >= 0 m, got {self.sigma}")


def survey_from_stations(
    world: World,
    *,
    seed: int = 0,
    station: StationConfig = StationConfig(),
    progress: Progress = lambda share, text: None,
    warn: Callable[[str], None] = lambda line: None,
) -> Cloud:
    """Scan from stops along the world's survey route and return the cloud.

    It takes seconds where the drive takes minutes. Glass and moving objects leave no points.

    Args:
        world: Any world; without routes the stops are its places and spawns.
        seed: Seed of the noise and of the omitted rays.
        station: The scanner and its stops.
        progress: Called with the completed share and a line of text.
        warn: Called with one line if the map lacks one face of a wall that was seen from both sides.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, 2]))
    # The filter leaves few points in a neighbourhood, so a search for more only takes time.
    builder = CloudBuilder(replace(mapping_config(world), plane_points=20))
    instrument = TotalStation(world)
    fan = _fan(station)
    stops = _stops(world, instrument, station)
    cells = _CellFilter(station.dense)
    for i, stop in enumerate(stops):
        points = _panorama(instrument, stop, fan, station, rng)
        points = points[cells.new(points, points - stop)]
        origins = np.broadcast_to(stop, points.shape)
        level = np.zeros(len(points), dtype=bool)
        builder.add(Sweep(0, points, origins, level), Pose.identity())
        progress((i + 1) / len(stops), f"stop {i + 1}, {builder.count / 1e6:.1f} M points")
    progress(1.0, f"thinning {builder.count / 1e6:.1f} M points")
    cloud = builder.build(world.name)
    if (warning := lost_faces_warning(builder.lost_faces)) is not None:
        warn(warning)
    return cloud


def visible_surface(world: World) -> FloatArray:
    """Return points (N, 3) on all surface that is visible from the survey route, without error.

    Each cell has one point for each visible side, so that the number of points measures the surface.
    """
    exact = StationConfig(sigma=0.0)
    rng = np.random.default_rng(0)
    instrument = TotalStation(world)
    fan, stops, cells = _fan(exact), _stops(world, instrument, exact), _CellFilter(exact.dense)
    seen = []
    for stop in stops:
        points = _panorama(instrument, stop, fan, exact, rng)
        seen.append(points[cells.new(points, points - stop)])
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
    """Return the positions of the scanner, (N, 3) [m]: the world's places, and stops that fill the gaps.

    A point of the route becomes a stop if no earlier stop is both near and in sight.
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
    """Return the points (N, 3) that are measured from one stop, in ``map`` [m]."""
    eyes = np.ascontiguousarray(np.broadcast_to(stop, fan.shape))
    hits = instrument.look(eyes, fan, max(station.reach, station.overhead))
    reach = np.where(fan[:, 2] > 0.5, station.overhead, station.reach)
    kept = (hits.distances <= reach) & (hits.cosines > station.grazing)
    # Most rays near the stop would fall into cells that have their point: a random part is kept.
    patch = (hits.distances * station.resolution) ** 2 / np.maximum(hits.cosines, 1e-9)
    kept &= rng.random(len(fan)) * (0.5 * station.dense) ** 2 < patch
    noise = station.sigma * rng.standard_normal(len(fan))
    ranges = hits.distances[kept] + noise[kept]
    points: FloatArray = stop + ranges[:, None] * fan[kept]
    return points


class _CellFilter:
    """Keeps one point for each cell of space and each of six viewing sides."""

    def __init__(self, cell: float) -> None:
        self._cell = cell
        self._seen = np.empty(0, dtype=np.int64)

    def new(self, points: FloatArray, rays: FloatArray) -> IntArray:
        """Return the indices of points (N, 3), seen along rays (N, 3), that are the first of cell and side."""
        # By quadrants of azimuth: along a wall, rays that meet its two faces have the same main axis.
        steep = np.abs(rays[:, 2]) > np.hypot(rays[:, 0], rays[:, 1])
        side = np.where(steep, 4 + (rays[:, 2] > 0.0), quadrants(rays))
        x, y, z = (np.floor(points / self._cell).astype(np.int64) + _HALF_SPAN).T
        key = ((x * _SPAN + y) * _SPAN + z) * 6 + side
        fresh, first = np.unique(key, return_index=True)
        known = np.isin(fresh, self._seen, assume_unique=True)
        self._seen = np.concatenate([self._seen, fresh[~known]])
        return np.sort(first[~known])
