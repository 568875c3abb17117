"""The scenes that come with the project: as large as promised, roomy along their tours, and mapped."""

from __future__ import annotations

import math
from functools import cache

import mujoco
import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.maps.map_files import load_cloud
from localization.types import Health
from robot_sim import Simulation, World, load_world, scene_names
from robot_sim.array_types import FloatArray
from robot_sim.floorplan.plan import Plan
from robot_sim.floorplan.plan_ground import PlanGround
from robot_sim.layout.route_planning import length
from robot_sim.robot.mujoco_body import HEADROOM
from robot_sim.scene_objects.blocks import Block, Shape
from robot_sim.worlds.from_floorplan import plan_blocks
from robot_sim.worlds.loading import load_plan
from teleop.scenario.tour_driver import TourDriver
from teleop.scene_clouds import scene_cloud_path
from tests.robot_sim.driving import BLIND, state_of
from tests.robot_sim.lines import dense

MARGIN = 0.35
"""Between the circle in which the robot turns and everything it could bump into [m]."""
LEAST_AREA = {
    "corridor": 70.0 * 2.4,
    "courtyard": 1200.0,
    "glasshouse": 30.0 * 12.0,
    "office": 400.0,
    "warehouse": 2000.0,
}
SCENES = scene_names()


@cache
def world_of(scene: str) -> World:
    return load_world(scene)


@cache
def load_scene_cloud(scene: str) -> Cloud:
    return load_cloud(scene_cloud_path(scene))


def plan_of(world: World) -> Plan:
    assert world.plan is not None
    return world.plan


def gap(block: Block, points: FloatArray) -> FloatArray:
    """Return the horizontal distance [m] of each of (N, 2) points from a block's outline."""
    c, s = math.cos(block.yaw), math.sin(block.yaw)
    dx, dy = points[:, 0] - block.x, points[:, 1] - block.y
    local = np.column_stack([c * dx + s * dy, c * dy - s * dx])
    if block.shape is Shape.BOX:
        reach = block.half[0] * math.cos(block.pitch) + block.half[2] * abs(math.sin(block.pitch))
        outside: FloatArray = np.maximum(np.abs(local) - (reach, block.half[1]), 0.0)
        return np.asarray(np.hypot(*outside.T))
    return np.asarray(np.hypot(*local.T)) - max(block.half[:2])


def test_all_five_scenes_are_available() -> None:
    assert set(LEAST_AREA) <= set(SCENES)


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_scene_is_as_large_as_promised_and_has_places_to_name(scene: str) -> None:
    world = world_of(scene)
    assert world.area >= LEAST_AREA[scene]
    assert len(world.places) >= 5
    assert world.spawns["spawn"] is world.spawn


def test_corridor_is_seventy_metres_long_and_featureless() -> None:
    """From 8 m to 30 m along it, whatever the scanners see is the same."""
    world = world_of("corridor")
    data = state_of(world.model)
    static = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
    hit = np.zeros(1, dtype=np.int32)
    profiles = []
    for x in np.linspace(8.0, 30.0, 12):
        across = [
            mujoco.mj_ray(
                world.model, data, np.array([x, 4.0, 0.45]),
                np.array([0.0, math.cos(a), math.sin(a)]), static, 1, -1, hit,
            )
            for a in np.linspace(0.0, 2.0 * math.pi, 60, endpoint=False)
        ]  # fmt: skip
        profiles.append(across)
    np.testing.assert_allclose(profiles, profiles[:1] * len(profiles), atol=1e-9)
    walls = {wall.name: wall for wall in plan_of(world).walls}
    assert walls["corridor_south"].length == pytest.approx(70.0)


def test_warehouse_repeats_itself() -> None:
    racks = [piece for piece in load_plan("warehouse").furniture if piece.kind == "rack"]
    assert len(racks) == 18
    assert len({rack.size for rack in racks}) == 1
    assert len({rack.seed for rack in racks}) == len(racks)


def test_courtyard_has_places_with_roll_and_pitch() -> None:
    world = world_of("courtyard")
    ground = PlanGround(plan_of(world))
    assert ground.heights(dense(world.tour)).max() > 0.5
    assert world.places["terrace"].position[2] == pytest.approx(0.35)
    tilts = [math.hypot(*pose.euler[:2]) for pose in world.places.values()]
    assert max(tilts) > math.radians(3.0)
    grades = [abs(slab.grade) for slab in plan_of(world).slabs]
    assert max(grades) == pytest.approx(0.35)


def test_glasshouse_is_walled_and_roofed_with_glass() -> None:
    plan = load_plan("glasshouse")
    panes = [b for b in plan_blocks(plan) if b.material == "glass"]
    overhead = [b for b in panes if b.bottom >= 2.9]
    assert len(overhead) >= 2
    assert len(panes) - len(overhead) >= 5


@pytest.mark.slow
@pytest.mark.parametrize("route", ["tour", "survey"])
@pytest.mark.parametrize("scene", SCENES)
def test_route_keeps_clear_of_everything(scene: str, route: str) -> None:
    plan = plan_of(world_of(scene))
    ground = PlanGround(plan)
    points = dense(getattr(plan, route), 0.05)
    height = ground.heights(points)
    for block in plan_blocks(plan, ground):
        distances = np.where(block.bottom - height < HEADROOM, gap(block, points), np.inf)
        nearest = int(distances.argmin())
        assert distances[nearest] >= 0.34 + MARGIN, f"{block.name} at {points[nearest].round(2)}"


@pytest.mark.parametrize("scene", SCENES)
def test_tour_leads_from_the_spawn_and_back(scene: str) -> None:
    world = world_of(scene)
    here = world.spawn.position[:2]
    assert np.hypot(*(here - world.tour[0])) < 0.1
    assert np.hypot(*(here - world.tour[-1])) < 1.0
    assert 80.0 <= length(world.tour) <= 200.0
    assert length(world.survey) > length(world.tour)


@pytest.mark.parametrize("scene", SCENES)
def test_cloud_lies_on_the_scene(scene: str) -> None:
    """From a little before each point, against its normal, a ray meets something just there."""
    world, cloud = world_of(scene), load_scene_cloud(scene)
    data = state_of(world.model)
    static = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
    hit = np.zeros(1, dtype=np.int32)
    before = 0.15
    picked = np.random.default_rng(0).choice(len(cloud.points), 400, replace=False)
    off = np.array([
        mujoco.mj_ray(world.model, data, p + before * n, -n, static, 1, -1, hit) - before
        for p, n in zip(
            cloud.points[picked].astype(float), cloud.normals[picked].astype(float), strict=True
        )
    ])  # fmt: skip
    assert (np.abs(off) < 0.04).mean() >= 0.9
    assert np.median(np.abs(off)) < 0.01


@pytest.mark.parametrize("scene", SCENES)
def test_cloud_covers_the_tour(scene: str) -> None:
    """Wherever the tour leads, there are points on the ground within a step."""
    world, cloud = world_of(scene), load_scene_cloud(scene)
    up = cloud.points[cloud.normals[:, 2] > 0.8][:, :2]
    for x, y in world.tour:
        assert np.hypot(*(up - (x, y)).T).min() < 0.6, (x, y)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("scene", ["courtyard", "glasshouse"])  # the hilliest and the narrowest
def test_tour_can_be_driven_without_touching_anything(scene: str) -> None:
    simulation = Simulation(world_of(scene), config=BLIND)
    driver = TourDriver(simulation.world.tour)
    while not driver.done:
        truth = simulation.truth()
        simulation.command(driver.command(truth.map_from_base, Health.TRACKING))
        simulation.step()
        assert simulation.touching == ()
        assert simulation.stamp < 400e9, f"stuck at {truth.map_from_base.position.round(2)}"
