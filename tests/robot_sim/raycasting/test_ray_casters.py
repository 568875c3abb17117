"""Both casters against MuJoCo's own rays, shape by shape and world by world."""

from __future__ import annotations

import copy
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.types import Pose
from robot_sim.actors.extras import AddedBox
from robot_sim.actors.movers import Mover
from robot_sim.raycasting import (
    MujocoRayCaster,
    RayCaster,
    SlowCastingWarning,
    caster_for,
    caster_selection as choice,
)
from robot_sim.raycasting.embree_caster import EmbreeRayCaster
from robot_sim.raycasting.embree_scene import StaticGeometry
from robot_sim.raycasting.pose_interpolation import PoseInterpolator
from robot_sim.raycasting.shape_intersection import CONVEX, shape_cosines, shape_distances
from robot_sim.raycasting.static_digest import static_digest
from robot_sim.robot.mujoco_body import ROBOT_GROUP
from robot_sim.robot.p3at import MOUNTS
from robot_sim.scene_objects.plan_elements import Placement
from robot_sim.worlds.loading import load_world
from robot_sim.worlds.world import World, WorldOptions
from tests.robot_sim.driving import state_of

TOLERANCE = 1e-4
"""What the casters may differ by [m]."""
NUDGE = 2e-5
"""An edge this near to a ray [m] makes it anyone's guess whether the ray meets it."""

EVERY_SHAPE = """
<mujoco>
  <asset>
    <mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1.5  0.4 0.4 0.4"/>
    <hfield name="dunes" nrow="9" ncol="12" size="3 2 0.8 0.3" elevation="{dunes}"/>
    <material name="ghost" rgba="1 1 1 0"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="12 9 0.1"/>
    <geom name="sky" type="plane" size="0 0 1" pos="0 0 7" euler="180 0 0"/>
    <geom name="slab" type="box" size="0.5 0.8 0.6" pos="3 1 0.6" euler="10 20 30"/>
    <geom name="post" type="cylinder" size="0.05 1.2" pos="-3 1 1.2"/>
    <geom name="drum" type="cylinder" size="0.6 0.4" pos="-4 -3 0.9" euler="70 10 0"/>
    <geom name="pill" type="capsule" size="0.3 0.5" pos="1 -3 0.9" euler="40 50 0"/>
    <geom name="ball" type="sphere" size="0.7" pos="4 -3 1"/>
    <geom name="bush" type="ellipsoid" size="0.9 0.4 0.6" pos="-1 4 0.8" euler="0 30 60"/>
    <geom name="stone" type="mesh" mesh="wedge" pos="0 0 1" euler="20 0 70"/>
    <geom name="ground" type="hfield" hfield="dunes" pos="8 5 0.4" euler="0 0 20"/>
    <geom name="air" type="box" size="1 1 1" pos="0 -1 1" rgba="1 1 1 0"/>
    <geom name="mist" type="box" size="1 1 1" pos="0 -1 1" material="ghost"/>
    <geom name="robot" type="box" size="1 1 1" pos="0 -1 1" group="3"/>
    <body name="crate" pos="-6 3 0.4">
      <freejoint/>
      <geom name="crate" type="box" size="0.4 0.3 0.4"/>
      <geom name="lamp" type="mesh" mesh="wedge" pos="0 0 0.5"/>
    </body>
  </worldbody>
</mujoco>
"""


def every_shape() -> mujoco.MjModel:
    dunes = np.random.default_rng(5).uniform(0.0, 1.0, 108)
    return mujoco.MjModel.from_xml_string(
        EVERY_SHAPE.format(dunes=" ".join(f"{h:.4f}" for h in dunes))
    )


def native_ray(
    model: mujoco.MjModel, data: mujoco.MjData
) -> Callable[..., tuple[float, int, float]]:
    """Return a function that casts one ray with nothing but MuJoCo."""
    groups = np.ones(mujoco.mjNGROUP, dtype=np.uint8)
    groups[ROBOT_GROUP] = 0
    geom, normal = np.zeros(1, dtype=np.int32), np.zeros(3)

    def cast(origin: np.ndarray, direction: np.ndarray) -> tuple[float, int, float]:
        at = mujoco.mj_ray(model, data, origin, direction, groups, True, -1, geom, normal)
        if at < 0.0:
            return math.inf, -1, 0.0
        return at, int(geom[0]), abs(float(normal @ direction))

    return cast


def on_an_edge(
    cast: Callable[..., tuple[float, int, float]], origin: np.ndarray, direction: np.ndarray
) -> bool:
    """Return whether the ray's nearest neighbours disagree about what it meets."""
    side = np.cross(direction, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    across = np.cross(direction, side)
    sides = (side, -side, across, -across, direction, -direction)
    found = [cast(origin + NUDGE * s, direction) for s in sides]
    at, cosines = [f[0] for f in found], [f[2] for f in found]
    if len({math.isinf(a) for a in at}) > 1:
        return True
    return max(at) - min(at) > TOLERANCE or max(cosines) - min(cosines) > 0.01


def assert_native(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    casters: Sequence[RayCaster],
    origins: np.ndarray,
    directions: np.ndarray,
    max_range: float,
) -> int:
    """Check distances, geoms and cosines; return how many rays met something."""
    cast = native_ray(model, data)
    expected = [cast(o, d) for o, d in zip(origins, directions, strict=True)]
    times = np.zeros(len(origins), dtype=np.int64)
    for caster in casters:
        hits = caster.hits(origins, directions, times, max_range)
        distances = caster.distances(origins, directions, times, max_range)
        np.testing.assert_allclose(distances, hits.distances, atol=TOLERANCE)
        assert not np.isnan(distances).any()
        assert not np.isnan(hits.cosines).any()
        edges = 0
        for i, (at, geom, cosine) in enumerate(expected):
            if at > max_range:
                agree = math.isinf(distances[i]) and hits.geoms[i] == -1 and hits.cosines[i] == 0.0
            else:
                agree = abs(distances[i] - at) <= TOLERANCE
                agree = agree and abs(hits.cosines[i] - cosine) < 2e-3 and hits.geoms[i] == geom
            if not agree:
                assert on_an_edge(cast, origins[i], directions[i]), (
                    f"{type(caster).__name__}: {distances[i]} m to {hits.geoms[i]} instead of"
                    f" {at} m to {geom} from {origins[i]} along {directions[i]}"
                )
                edges += 1
        assert edges <= 0.002 * len(origins) + 1
    return sum(at <= max_range for at, _, _ in expected)


def both(
    model: mujoco.MjModel, data: mujoco.MjData, movers: Sequence[Mover] = ()
) -> tuple[EmbreeRayCaster, MujocoRayCaster]:
    return (
        EmbreeRayCaster(StaticGeometry(model), model, data, movers),
        MujocoRayCaster(model, data, movers),
    )


def anywhere(rng: np.random.Generator, low: Sequence[float], high: Sequence[float], count: int):  # type: ignore[no-untyped-def]
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return rng.uniform(low, high, (count, 3)), directions


def test_all_shapes_are_hit_as_by_mujoco_from_outside_and_inside() -> None:
    model = every_shape()
    data = mujoco.MjData(model)
    data.qpos[:7] = (-6.0, 3.0, 0.6, 0.9, 0.1, 0.3, -0.2)
    mujoco.mj_forward(model, data)
    origins, directions = anywhere(np.random.default_rng(1), (-9, -8, -1), (11, 8, 6), 6000)
    met = assert_native(model, data, both(model, data), origins, directions, 15.0)
    assert met > 3500
    # Starting inside of each geom as well.
    rng = np.random.default_rng(2)
    inside = np.repeat(data.geom_xpos[2:], 40, axis=0) + rng.normal(
        0.0, 0.05, (40 * (model.ngeom - 2), 3)
    )
    _, directions = anywhere(rng, (0, 0, 0), (1, 1, 1), len(inside))
    assert_native(model, data, both(model, data), inside, directions, 15.0)


def test_office_is_hit_as_by_mujoco(office: World) -> None:
    data = state_of(office.model)
    casters = both(office.model, data)
    angles = np.linspace(-2.3, 2.3, 181)
    fan = np.stack([np.cos(angles), np.sin(angles), np.zeros(181)], axis=1)
    along = np.linspace(0.0, 0.05, 181)[:, None]
    for place in office.places.values():
        for mount in MOUNTS.values():
            x, y, _ = place.position
            tilted = Pose.from_euler((x, y, 0.0), roll=0.01, pitch=-0.01, yaw=x) @ mount
            origins = tilted.position + along * [1.0, 0.3, 0.0]
            assert_native(office.model, data, casters, origins, fan @ tilted.rotation.T, 20.0)


def test_long_flat_rays_hit_a_heightfield_as_by_mujoco() -> None:
    rng = np.random.default_rng(3)
    waves = np.add.outer(np.sin(np.linspace(0.0, 9.0, 61)), np.sin(np.linspace(0.0, 14.0, 83)))
    heights = 0.25 * (waves + 2.0) * 0.9 + 0.1 * rng.uniform(size=waves.shape)
    spec = mujoco.MjSpec()
    spec.add_hfield(
        name="hills", nrow=61, ncol=83, size=(20.0, 15.0, 2.0, 0.5), userdata=heights.ravel()
    )
    spec.worldbody.add_geom(
        name="hills", type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="hills", pos=(3.0, -2.0, 0.1)
    )
    model = spec.compile()
    data = state_of(model)
    angles = rng.uniform(-math.pi, math.pi, 700)
    climbs = rng.normal(0.0, 0.05, 700)
    directions = np.stack([np.cos(angles), np.sin(angles), climbs], axis=1)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = rng.uniform((-22.0, -18.0, 0.0), (28.0, 14.0, 2.8), (700, 3))
    casters = (EmbreeRayCaster(StaticGeometry(model), model, data),)
    assert assert_native(model, data, casters, origins, directions, 60.0) > 300


lengths = st.floats(0.01, 3.0)
coordinates = st.floats(-4.0, 4.0)
vectors = st.tuples(coordinates, coordinates, coordinates)


@settings(max_examples=300)
@given(
    kind=st.sampled_from(sorted(CONVEX)),
    size=st.tuples(lengths, lengths, lengths),
    origin=vectors,
    aim=vectors,
)
def test_single_shapes_agree_with_mujoco_for_any_ray(
    kind: int,
    size: tuple[float, float, float],
    origin: tuple[float, float, float],
    aim: tuple[float, float, float],
) -> None:
    o, d = np.array(origin), np.array(aim) - origin
    length = float(np.linalg.norm(d))
    if length < 1e-3:
        return
    d /= length
    sizes, frame, normal = np.array(size), np.eye(3).ravel(), np.zeros(3)

    def native(at: np.ndarray, along: np.ndarray) -> tuple[float, int, float]:
        found = mujoco.mju_rayGeom(np.zeros(3), frame, sizes, at, along, kind, normal)
        return (math.inf, -1, 0.0) if found < 0.0 else (found, 0, abs(float(normal @ along)))

    expected, _, slope = native(o, d)
    kinds = np.array([kind], dtype=np.int32)
    (distance,) = shape_distances(kinds, sizes[None], o[None], d[None])
    assert not math.isnan(distance)
    if distance == pytest.approx(expected, abs=1e-6):
        if math.isfinite(expected) and expected > 1e-6:
            point = (o + distance * d)[None]
            (cosine,) = shape_cosines(kinds, sizes[None], point, d[None])
            assert cosine == pytest.approx(slope, abs=1e-3) or on_an_edge(native, o, d)
        return
    assert on_an_edge(native, o, d)


@dataclass(frozen=True)
class Orbit:
    """Something that goes round and turns about itself."""

    name: str
    radius: float
    rate: float

    def pose_at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        phase = self.rate * 1e-9 * times
        x, y = 5.0 + self.radius * np.cos(phase), 4.0 + self.radius * np.sin(phase)
        return np.stack([x, y, np.full(len(times), 0.1)], axis=1), 2.0 * phase


ORBITS = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1.5  0.4 0.4 0.4"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="12 9 0.1"/>
    <geom name="wall" type="box" size="0.1 4 1" pos="9 4 1"/>
    <body name="walker" mocap="true">
      <geom type="box" size="0.1 0.2 0.3" pos="0 0 1"/>
      <geom type="cylinder" size="0.07 0.4" pos="0.1 0.1 0.4"/>
      <geom type="ellipsoid" size="0.1 0.08 0.13" pos="0 0 1.5" euler="0 20 0"/>
    </body>
    <body name="cart" mocap="true">
      <geom type="mesh" mesh="wedge"/>
      <geom type="capsule" size="0.05 0.4" pos="0.4 0 0.6" euler="90 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_movers_are_hit_at_their_poses_at_each_beams_time() -> None:
    model = mujoco.MjModel.from_xml_string(ORBITS)
    movers = (Orbit("walker", 2.0, 0.6), Orbit("cart", 1.2, -1.0))
    data, there = mujoco.MjData(model), mujoco.MjData(model)
    casters = both(model, data, movers)
    rng = np.random.default_rng(6)
    met = {int(g): 0 for g in range(model.ngeom)}
    for sweep in range(12):
        times = 1_000_000_000 * sweep + np.linspace(0.0, 7.5e7, 361).astype(np.int64)
        # What the simulation has written for the end of the tick.
        data.time = there.time = 1e-9 * float(times[-1])
        for mover in movers:
            slot = model.body(mover.name).mocapid[0]
            (place,), (yaw,) = mover.pose_at(times[-1:])
            data.mocap_pos[slot] = place
            data.mocap_quat[slot] = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
        mujoco.mj_kinematics(model, data)
        angles = np.linspace(-math.pi, math.pi, 361)
        climb = rng.normal(0.1, 0.25, 361)
        directions = np.stack([np.cos(angles), np.sin(angles), climb], axis=1)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        origins = np.array([5.5, 4.2, 0.4]) + np.linspace(0.0, 0.05, 361)[:, None]
        cast = native_ray(model, there)
        expected = []
        for o, d, t in zip(origins, directions, times, strict=True):
            for mover in movers:
                slot = model.body(mover.name).mocapid[0]
                (place,), (yaw,) = mover.pose_at(np.array([t]))
                there.mocap_pos[slot] = place
                there.mocap_quat[slot] = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
            mujoco.mj_kinematics(model, there)
            expected.append(cast(o, d))
        for caster in casters:
            hits = caster.hits(origins, directions, times, 30.0)
            far = np.array([at for at, _, _ in expected])
            off = ~np.isclose(hits.distances, far, rtol=0.0, atol=TOLERANCE)
            # A ray beside an edge may go either way.
            assert off.sum() <= 1
            np.testing.assert_array_equal(
                hits.geoms[~off], np.array([g for _, g, _ in expected])[~off]
            )
            cosines = np.array([c for _, _, c in expected])
            np.testing.assert_allclose(hits.cosines[~off], cosines[~off], atol=2e-3)
        for geom in np.unique(hits.geoms[hits.geoms >= 0]):
            met[int(geom)] += 1
    assert all(count > 0 for count in met.values())


def test_rays_that_start_under_the_floor_pass_it_as_mujocos_do() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom type="plane" size="5 5 1"/>'
        '<geom type="box" size="1 1 1" pos="0 0 4"/></worldbody></mujoco>'
    )
    data = state_of(model)
    up = (
        np.array([[0.2, 0.1, -2.0], [0.2, 0.1, 1.0], [3.0, 0.0, -2.0]]),
        np.tile([0.0, 0.0, 1.0], (3, 1)),
    )
    times = np.zeros(3, dtype=np.int64)
    for caster in both(model, data):
        np.testing.assert_allclose(caster.distances(*up, times, 20.0), [5.0, 2.0, math.inf])


def test_empty_world_gives_no_returns() -> None:
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = state_of(model)
    origins, directions = anywhere(np.random.default_rng(0), (0, 0, 0), (1, 1, 1), 5)
    for caster in both(model, data):
        hits = caster.hits(origins, directions, np.zeros(5, dtype=np.int64), 20.0)
        assert np.isposinf(hits.distances).all()
        assert (hits.geoms == -1).all()
        assert (hits.cosines == 0.0).all()


def test_robot_does_not_see_itself(field: World) -> None:
    data = state_of(field.model)
    down, start = np.array([[0.0, 0.0, -1.0]]), np.array([[0.0, 0.0, 2.0]])
    for caster in both(field.model, data):
        distances = caster.distances(start, down, np.zeros(1, dtype=np.int64), 20.0)
        np.testing.assert_allclose(distances, [2.0])


def test_simulations_of_one_world_share_its_triangles(office: World) -> None:
    first, second = (caster_for(office, mujoco.MjData(office.model)) for _ in range(2))
    assert isinstance(first, EmbreeRayCaster)
    assert isinstance(second, EmbreeRayCaster)
    assert first._static is second._static


def test_without_embree_mujoco_casts_after_one_warning(
    field: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = mujoco.MjData(field.model)
    monkeypatch.setitem(sys.modules, "embreex", None)
    choice._embree_is_there.cache_clear()
    with pytest.warns(SlowCastingWarning, match="the extra `sim`"):
        first = caster_for(field, data)
    second = caster_for(field, data)
    choice._embree_is_there.cache_clear()
    assert isinstance(first, MujocoRayCaster)
    assert isinstance(second, MujocoRayCaster)


def test_interpolated_poses_of_movers_are_exact_at_any_time() -> None:
    world = load_world("office", options=WorldOptions(alive=True))
    table = PoseInterpolator(world.movers)
    rng = np.random.default_rng(7)
    for second in (0, 1, 17, 18, 600):
        # A sweep may reach over from one chunk into the next.
        times = second * 1_000_000_000 + rng.integers(0, 1_500_000_000, 400)
        numbers = rng.integers(0, len(world.movers), 400)
        positions, yaws = table.poses(numbers, times)
        for number, mover in enumerate(world.movers):
            mine = numbers == number
            places, headings = mover.pose_at(times[mine])
            np.testing.assert_allclose(positions[mine], places, atol=1e-4)
            turn = np.exp(1j * (yaws[mine] - headings))
            np.testing.assert_allclose(np.angle(turn), 0.0, atol=2e-3)


def test_worlds_share_static_geometry_only_if_all_that_stands_still_is_the_same() -> None:
    def static(world: World) -> StaticGeometry:
        caster = caster_for(world, mujoco.MjData(world.model))
        assert isinstance(caster, EmbreeRayCaster)
        return caster._static

    plain = load_world("corridor")
    first = static(plain)
    box = AddedBox((1.0, 1.0, 1.0), Placement(2.0, 0.0), start_ns=5)
    later = load_world("corridor", options=WorldOptions(extras=(box,), spare_people=1))
    assert static(later) is first
    assert static(load_world("corridor")) is first
    moved = load_world("corridor", options=WorldOptions(rearranged=3))
    assert static(moved) is not first
    assert static_digest(plain.model) != static_digest(load_world("office").model)
    copied = copy.copy(plain.model)
    copied.geom_size[plain.model.geom("ceiling").id] *= 1.001
    assert static_digest(copied) != static_digest(plain.model)
