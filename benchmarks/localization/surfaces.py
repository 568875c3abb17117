"""Surfaces of twelve generated buildings against their plans: openings that are open, and what stands in the free.

The clouds are surveyed from stations, once. A doorway is open if no face crosses it, jambs of 5 cm apart. A place is
free if no solid of the plan lies above or below it within 7 cm, between the floor and the ceiling.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt

from benchmarks.common.figures import OURS, Figure, say
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.maps.open3d_import import import_open3d
from localization.surfaces.building import Building, building_of
from localization.surfaces.gltf import glb
from robot_sim import World
from robot_sim.building_generator import generate
from robot_sim.survey.static_mesh import static_mesh
from robot_sim.worlds.from_floorplan import build_world
from teleop.scene_clouds import load_scene_cloud
from teleop.world_building.station_survey import survey_from_stations

PLANS: Final = [(200 + i, 150.0 + 40.0 * i) for i in range(1, 13)]
"""Seed and area [m²] of each building."""
LARGE: Final = (931, 2000.0)
"""The same of the one whose time and size are measured."""
_WIDTH: Final = 0.5
"""Width from which an opening counts [m]."""
_JAMB, _NEAR = 0.05, 0.07
_STEP: Final = 0.05
"""Distance between the places on a surface that are looked at [m]."""
_LEVELS: Final = np.arange(0.12, 2.5, 0.08)
"""Heights at which a place is looked for in a solid [m]."""


def main() -> None:
    """Print the figures of all plans together, and of the largest."""
    doors = closed = 0
    standing = 0.0
    for seed, area in PLANS:
        world = build_world(generate(seed, area).plan)
        building = building_of(survey_from_stations(world, seed=0))
        n, shut = openings(building, world)
        free = area_in_the_free(building, world)
        say(
            f"  building {seed}, {area:g} m²: {n - shut} of {n} openings open, {free:.3f} m² in the free"
        )
        doors, closed, standing = doors + n, closed + shut, standing + free
    case = f"{len(PLANS)} plans"
    large = survey_from_stations(build_world(generate(*LARGE).plan), seed=0)
    office = load_scene_cloud("office")
    for figure in (
        Figure(case, OURS, "openings that are open", 100.0 * (doors - closed) / doors, "%", least=99.0),
        Figure(case, OURS, "surface where the plan is free, in all", standing, "m²", most=0.1),
        Figure(f"{LARGE[1]:g} m²", OURS, f"time of {len(large.points)} points", _seconds(large), "s", most=3.0),
        Figure(f"{LARGE[1]:g} m²", OURS, "size of the file", len(glb(building_of(large))) / 1e3, "kB"),
        Figure("office", OURS, "size of the file", len(glb(building_of(office))) / 1e3, "kB", most=300.0),
    ):  # fmt: skip
        say(
            f"    {figure.case:10s} {figure.quantity:44s} {figure.text:12s} {figure.verdict}".rstrip()
        )


def openings(building: Building, world: World) -> tuple[int, int]:
    """Return how many doorways of a plan are wide enough to count, and across how many of them a face stands."""
    places = np.concatenate([at for at, _ in _samples(_upright(building))])
    places = places[places[:, 2] < 1.8, :2]
    count = closed = 0
    assert world.plan is not None
    for wall in world.plan.walls:
        along = np.array([np.cos(wall.yaw), np.sin(wall.yaw)])
        u = (places - wall.start) @ along
        v = np.abs((places - wall.start) @ [-along[1], along[0]])
        for door in wall.doors:
            if door.width >= _WIDTH:
                inside = np.abs(u - door.at) < 0.5 * door.width - _JAMB
                count += 1
                closed += bool((inside & (v < 0.5 * wall.thickness + _JAMB)).any())
    return count, closed


def area_in_the_free(building: Building, world: World) -> float:
    """Return the area [m²] of surfaces that stand where a plan is free."""
    o3d = import_open3d()
    vertices, faces = static_mesh(world)
    solids = o3d.t.geometry.RaycastingScene()
    solids.add_triangles(vertices.astype(np.float32), faces.astype(np.uint32))
    walls = building.walls.only(building.walls.wide())
    parts = list(_samples(np.concatenate([_upright(building), walls.top_corners(), building.tops])))
    places = np.concatenate([at[:, :2] for at, _ in parts])
    area = np.concatenate([size for _, size in parts])
    free = np.ones(len(places), dtype=bool)
    for level in _LEVELS:
        left = np.flatnonzero(free)
        at = np.column_stack([places[left], np.full(len(left), level)]).astype(np.float32)
        near = solids.compute_distance(at).numpy() <= _NEAR
        free[left[near | (solids.compute_occupancy(at).numpy() > 0.5)]] = False
    return float(area[free].sum())


def _upright(building: Building) -> FloatArray:
    return np.concatenate([building.walls.upright_corners(), building.furniture.upright_corners()])


def _samples(quads: FloatArray) -> Iterator[tuple[FloatArray, npt.NDArray[np.float64]]]:
    """Yield for each quad (4, 3) places on it (S, 3) [m], and the area (S,) that each stands for [m²]."""
    for corners in quads:
        sides = corners[1] - corners[0], corners[3] - corners[0]
        lengths = [float(np.linalg.norm(side)) for side in sides]
        counts = [max(1, int(np.ceil(length / _STEP))) for length in lengths]
        u, v = np.meshgrid(*((np.arange(n) + 0.5) / n for n in counts))
        at = corners[0] + u.reshape(-1, 1) * sides[0] + v.reshape(-1, 1) * sides[1]
        yield at, np.full(len(at), lengths[0] * lengths[1] / len(at))


def _seconds(cloud: Cloud) -> float:
    begun = time.perf_counter()
    glb(building_of(cloud))
    return time.perf_counter() - begun
