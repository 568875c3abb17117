"""Slabs and heightfields: as high as they say, and as MuJoCo's rays and wheels find them."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import Twist
from robot_sim import Simulation
from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Placement, Plan
from robot_sim.floorplan.plan_ground import PlanGround
from robot_sim.scene_objects.ramps_and_steps import Slab
from robot_sim.scene_objects.terrain import Hill, LevelDisc, Rut, Terrain
from robot_sim.worlds.from_floorplan import build_world
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND, run, state_of

LAWN = Terrain(
    "lawn",
    (2.0, 1.0, 12.0, 9.0),
    height=0.2,
    roughness=0.06,
    seed=5,
    hills=(Hill(7.0, 5.0, 0.6, 3.0),),
    ruts=(Rut(((3.0, 3.0), (11.0, 3.0)), 0.6, 0.06),),
    levels=(LevelDisc(10.0, 7.0, 0.6, 0.25),),
)
RAMP = Slab("ramp", 16.0, 5.0, 2.0, 1.6, (0.0, 0.7), yaw=math.radians(30.0))
KERB = Slab("kerb", 16.0, 1.5, 2.0, 1.0, (0.12, 0.12))
PLAN = Plan(
    "hills",
    (0.0, 0.0, 20.0, 10.0),
    {"spawn": Placement(1.0, 5.0)},
    ceiling=False,
    terrains=(LAWN,),
    slabs=(RAMP, KERB),
    places={"hill": Placement(7.5, 5.5, 1.0), "ramp": Placement(16.0, 5.0, 0.4)},
)


@pytest.fixture(scope="module")
def hills() -> World:
    """A floor with a hilly lawn, a ramp and a kerb on it."""
    return build_world(PLAN)


def seen_from_above(world: World, points: FloatArray) -> FloatArray:
    """Return the height [m] at which a ray straight down meets something static, for each point."""
    data = state_of(world.model)
    static = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
    hit = np.zeros(1, dtype=np.int32)
    down = np.array([0.0, 0.0, -1.0])
    return np.array([
        5.0 - mujoco.mj_ray(world.model, data, np.array([x, y, 5.0]), down, static, 1, -1, hit)
        for x, y in points
    ])  # fmt: skip


def test_ground_is_as_high_as_rays_find_it(hills: World) -> None:
    points = np.random.default_rng(0).uniform((0.0, 0.0), (20.0, 10.0), (2000, 2))
    expected = PlanGround(PLAN).heights(points)
    assert expected.max() > 0.6
    np.testing.assert_allclose(seen_from_above(hills, points), expected, atol=1e-5)


def test_terrain_joins_the_floor_without_a_step() -> None:
    x0, y0, x1, y1 = LAWN.bounds
    t = np.linspace(0.0, 1.0, 500)
    rim = np.concatenate([
        np.column_stack([x0 + t * (x1 - x0), np.full_like(t, y)]) for y in (y0, y1)
    ] + [
        np.column_stack([np.full_like(t, x), y0 + t * (y1 - y0)]) for x in (x0, x1)
    ])  # fmt: skip
    assert not PlanGround(PLAN).heights(rim).any()


def test_level_disc_is_level_and_has_its_height() -> None:
    ring = 0.2 * np.exp(2j * np.pi * np.linspace(0.0, 1.0, 50))
    points = np.column_stack([10.0 + ring.real, 7.0 + ring.imag])
    np.testing.assert_allclose(PlanGround(PLAN).heights(points), 0.25, atol=1e-9)


def test_rut_is_lower_than_the_ground_without_it() -> None:
    here = np.array([[5.0, 3.0], [9.0, 3.0]])
    filled = replace(PLAN, terrains=(replace(LAWN, ruts=()),))
    depth = PlanGround(filled).heights(here) - PlanGround(PLAN).heights(here)
    assert ((depth > 0.04) & (depth < 0.07)).all()


def test_same_seed_makes_the_same_terrain_and_another_seed_another() -> None:
    assert np.array_equal(LAWN.grid(), replace(LAWN).grid())
    assert not np.allclose(LAWN.grid(), replace(LAWN, seed=6).grid())


def test_roughness_is_the_standard_deviation_of_the_noise() -> None:
    plain = Terrain("t", (0.0, 0.0, 20.0, 20.0), roughness=0.08, skirt=0.5, seed=1)
    inner = plain.grid()[4:-4, 4:-4]
    assert inner.std() == pytest.approx(0.08, rel=0.1)


@given(
    low=st.floats(0.0, 1.0),
    high=st.floats(0.0, 1.0),
    length=st.floats(0.5, 5.0),
    yaw=st.floats(-math.pi, math.pi),
    along=st.floats(-0.49, 0.49),
    across=st.floats(-0.49, 0.49),
)
def test_face_of_a_slab_connects_the_heights_of_its_ends(
    low: float, high: float, length: float, yaw: float, along: float, across: float
) -> None:
    slab = Slab("s", 3.0, -2.0, length, 1.5, (low, high), yaw=yaw, thickness=0.1)
    c, s = math.cos(yaw), math.sin(yaw)
    u, v = along * length, across * 1.5
    point = np.array([[3.0 + c * u - s * v, -2.0 + s * u + c * v]])
    assert slab.heights(point)[0] == pytest.approx(low + (along + 0.5) * (high - low), abs=1e-9)
    block = slab.block()
    w, x, y, z = block.quaternion_wxyz
    normal = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    face = np.array([block.x, block.y, block.z]) + block.half[2] * normal
    above = np.array([*point[0], slab.heights(point)[0]])
    assert (above - face) @ normal == pytest.approx(0.0, abs=1e-9)


def test_robot_put_on_a_hill_stands_still_there(hills: World) -> None:
    for name, place in hills.places.items():
        assert max(abs(place.euler[0]), abs(place.euler[1])) > math.radians(3.0)
        simulation = Simulation(hills, config=BLIND, start=place)
        run(simulation, 100)
        moved = place.inverse() @ simulation.truth().map_from_base
        assert np.abs(moved.position).max() < 0.02, name
        assert np.abs(moved.euler).max() < math.radians(2.0), name


@pytest.mark.slow
def test_robot_drives_over_the_hill_and_back_to_the_floor(hills: World) -> None:
    simulation = Simulation(hills, config=BLIND)
    heights, pitches = [], []
    simulation.command(Twist.planar(0.6, 0.0))
    while simulation.truth().map_from_base.position[0] < 13.0:
        simulation.step()
        pose = simulation.truth().map_from_base
        heights.append(pose.position[2])
        pitches.append(pose.euler[1])
        assert simulation.stamp < 40e9
    top = PlanGround(PLAN).heights(np.column_stack([np.linspace(5, 9, 50), np.full(50, 5.0)])).max()
    assert max(heights) == pytest.approx(top, abs=0.08)
    assert min(pitches) < math.radians(-8.0)
    assert max(pitches) > math.radians(8.0)
    assert abs(heights[-1]) < 0.01


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cell": 0.01}, "terrain 'lawn': 1000 by 800 cells are too many; with at most 256"),
        ({"cell": 0.0}, "terrain 'lawn': cell must be > 0 m"),
        ({"bounds": (2.0, 1.0, 2.0, 9.0)}, "terrain 'lawn': bounds must be"),
        ({"roughness": -1.0}, "terrain 'lawn': roughness must be >= 0 m"),
        ({"seed": -1}, "terrain 'lawn': seed must be >= 0"),
    ],
)
def test_invalid_terrain_is_rejected(change: dict[str, object], message: str) -> None:
    with pytest.raises(WorldError, match=message):
        replace(LAWN, **change)  # type: ignore[arg-type]


def test_slab_without_thickness_must_rise_above_the_floor() -> None:
    with pytest.raises(WorldError, match="slab 'kerb': its top must be > 0 m"):
        replace(KERB, rise=(0.0, 0.0))


def test_place_beside_all_ground_is_rejected() -> None:
    with pytest.raises(WorldError, match=r"at x 1\.00, y 5\.00 there is no ground"):
        build_world(replace(PLAN, floor="none"))
