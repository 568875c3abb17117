"""People, carts and doors: where they are at any time, and what happens when they meet the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from localization.types import Scan, Twist
from robot_sim import (
    Simulation,
    World,
    WorldError,
    load_world,
    parse_world,
    scene_names,
)
from robot_sim.actors.actor_bodies import moving_bodies
from robot_sim.actors.movers import Mover, WalkingBody
from robot_sim.actors.walking import ACCELERATION, Walk
from robot_sim.floorplan.actors_in_plan import MAX_WALKING_SPEED, DoorLeaf, Person
from robot_sim.simulation import TICK_NS
from robot_sim.worlds.world import WorldOptions
from tests.robot_sim.driving import BLIND

ALIVE = WorldOptions(alive=True)
SECOND = 1_000_000_000

ROOM = """
bounds = [0.0, 0.0, 10.0, 8.0]
spawn = [{spawn}]
[[wall]]
name = "south"
from = [0.0, -0.07]
to = [10.0, -0.07]
[[wall]]
name = "east"
from = [10.07, 0.0]
to = [10.07, 8.0]
"""


def room(spawn: str, life: str) -> World:
    return parse_world(ROOM.format(spawn=spawn) + life, name="room", options=ALIVE)


def times(seconds: float, step: float = 0.001) -> np.ndarray:
    return np.arange(0, int(seconds * SECOND), int(step * SECOND), dtype=np.int64)


# ---- walks


corners = st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))


@settings(max_examples=40)
@given(
    path=st.lists(corners, min_size=3, max_size=6),
    speed=st.floats(0.5, MAX_WALKING_SPEED),
    loop=st.booleans(),
    stops=st.lists(st.floats(0.5, 5.0), min_size=6, max_size=6),
)
def test_walker_moves_without_jumps_and_no_faster_than_its_speed(
    path: list[tuple[float, float]], speed: float, loop: bool, stops: list[float]
) -> None:
    # With a stop at every other way-point most paths can be walked.
    points = [(*p, s) if i % 2 else p for i, (p, s) in enumerate(zip(path, stops, strict=False))]
    try:
        walk = Walk(points, speed=speed, step_length=0.7, loop=loop)
    except WorldError:
        # Two in one place, or a spike: covered by a test of its own.
        assume(False)
    step = 10_000_000
    when = np.arange(0, min(walk.cycle, 300 * SECOND) + SECOND, step, dtype=np.int64)
    motion = walk.at(when)
    moved = np.hypot(*np.diff(motion.positions, axis=0).T)
    assert moved.max() <= speed * step * 1e-9 * 1.001 + 1e-9
    # One lap later everything is as it was.
    again = walk.at(when + walk.cycle)
    np.testing.assert_allclose(again.positions, motion.positions, atol=1e-6)
    np.testing.assert_allclose(np.sin(again.strides), np.sin(motion.strides), atol=1e-6)
    low, high = np.min(path, axis=0), np.max(path, axis=0)
    assert (motion.positions >= low - 1e-6).all()
    assert (motion.positions <= high + 1e-6).all()


def test_walk_between_two_points_is_a_trapezoid_of_speed() -> None:
    walk = Walk([(1.0, 2.0), (7.0, 2.0)], speed=1.2, step_length=0.7, pause=3.0)
    ramp = 1.2 / ACCELERATION
    duration = 6.0 / 1.2 + ramp
    assert walk.cycle == pytest.approx(2 * (duration + 3.0) * SECOND, abs=10)
    at = (np.array([0.0, ramp, 0.5 * duration, duration, duration + 2.9]) * SECOND).astype(np.int64)
    x = walk.at(at).positions[:, 0]
    np.testing.assert_allclose(x, [1.0, 1.0 + 0.5 * 1.2 * ramp, 4.0, 7.0, 7.0], atol=1e-6)


def test_walker_faces_where_it_goes_and_turns_round_at_the_end() -> None:
    walk = Walk([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0)], speed=1.0, step_length=0.6, pause=2.0)
    when = times(walk.cycle * 1e-9)
    motion = walk.at(when)
    step = np.diff(motion.positions, axis=0)
    going = np.hypot(*step.T) > 3e-4
    course = np.arctan2(step[:, 1], step[:, 0])
    aside = np.angle(np.exp(1j * (course - motion.headings[:-1])))
    assert np.abs(aside[going]).max() < 0.01
    turn = np.diff(np.unwrap(motion.headings))
    assert np.abs(turn).max() < 5e-3
    # The inner corner is cut by an arc of half a metre, not reached and not left out.
    nearest = np.hypot(*(motion.positions - (4.0, 0.0)).T).min()
    assert nearest == pytest.approx(0.5 * (math.sqrt(2.0) - 1.0), abs=1e-3)


def test_feet_are_together_at_every_stop_and_half_a_turn_apart_per_step() -> None:
    walk = Walk([(0.0, 0.0), (5.0, 0.0, 2.0), (5.0, 3.1)], speed=1.1, step_length=0.65)
    motion = walk.at(times(walk.cycle * 1e-9))
    standing = np.hypot(*np.diff(motion.positions, axis=0).T) < 1e-9
    assert np.abs(np.sin(motion.strides[:-1][standing])).max() < 1e-4
    # 5 m and 3.1 m at about 0.65 m a step.
    assert motion.strides.max() == pytest.approx(8 * math.pi, abs=1e-3)


@pytest.mark.parametrize(
    ("path", "loop", "message"),
    [
        ([(0.0, 0.0)], False, "path must have 2 way-points or more, got 1"),
        ([(0.0, 0.0), (1.0, 0.0)], True, "path must have 3 way-points or more, got 2"),
        ([(0.0, 0.0), (0.0, 0.0)], False, r"stays at \[0, 0\] for two way-points"),
        ([(0, 0), (3, 0), (1, 0), (1, 4)], False, r"turns right back at \[3, 0\]: it needs a stop"),
        ([(0.0, math.nan), (1.0, 0.0)], False, "path must have finite way-points"),
        ([(0.0, 0.0, -1.0), (1.0, 0.0)], False, "stops >= 0"),
    ],
)
def test_path_that_cannot_be_walked_is_rejected(
    path: Sequence[Sequence[float]], loop: bool, message: str
) -> None:
    with pytest.raises(WorldError, match=message):
        Walk(path, speed=1.0, step_length=0.7, loop=loop)


# ---- people, carts, leaves


def of(movers: Sequence[Mover], name: str) -> Mover:
    return next(m for m in movers if m.name == name)


def test_legs_swing_one_before_the_other_at_a_walkers_cadence() -> None:
    person = Person("anna", ((0.0, 0.0), (30.0, 0.0)), speed=1.3, start=0.0)
    movers = [body.mover for body in moving_bodies([person])]
    when = times(15.0)[5000:]
    torso, left, right = (of(movers, f"anna_{n}").pose_at(when)[0] for n in
                          ("torso", "left_leg", "right_leg"))  # fmt: skip
    ahead = left[:, 0] - torso[:, 0]
    np.testing.assert_allclose(right[:, 0] - torso[:, 0], -ahead, atol=1e-12)
    np.testing.assert_allclose(left[:, 1] - right[:, 1], 0.18, atol=1e-12)
    # 1.3 m/s are steps of 0.71 m, 110 a minute: the walk ratio of adults.
    steps = np.count_nonzero(np.diff(np.sign(ahead)))
    assert steps / 10.0 * 60.0 == pytest.approx(math.sqrt(1.3 * 60.0 / 0.0065), abs=6.0)
    assert 0.15 < ahead.max() < 0.25
    # No leg goes backwards over the floor: what stands, stands.
    assert np.diff(left[:, 0]).min() > 0.0


def test_cart_stays_ahead_of_the_person_who_pushes_it() -> None:
    world = room("8.0, 6.0, 0.0", '[[cart]]\nname = "t"\npath = [[2, 2], [6, 2], [6, 5]]\n')
    when = times(30.0, 0.05)
    cart, yaws = of(world.movers, "t").pose_at(when)
    driver, _ = of(world.movers, "t_driver_torso").pose_at(when)
    offset = cart - driver
    np.testing.assert_allclose(offset[:, 0] * np.cos(yaws) + offset[:, 1] * np.sin(yaws), 0.85)
    np.testing.assert_allclose(offset[:, 1] * np.cos(yaws) - offset[:, 0] * np.sin(yaws), 0.0,
                               atol=1e-9)  # fmt: skip


def test_leaf_opens_all_the_way_and_closes_again_smoothly() -> None:
    leaf = DoorLeaf("door", (1.0, 2.0), closed=0.5, swing=-1.4, open_time=4.0, closed_time=6.0)
    (body,) = moving_bodies([leaf])
    positions, yaws = body.mover.pose_at(times(400.0, 0.02))
    np.testing.assert_array_equal(positions, np.broadcast_to((1.0, 2.0, 0.0), positions.shape))
    assert yaws.max() == pytest.approx(0.5)
    assert yaws.min() == pytest.approx(-0.9)
    # Minimum jerk over 2.5 s peaks at 15/8 of the mean rate.
    assert np.abs(np.diff(yaws)).max() / 0.02 == pytest.approx(1.875 * 1.4 / 2.5, rel=0.01)
    openings = np.count_nonzero(np.diff((yaws < 0.4).astype(int)) == 1)
    assert openings == pytest.approx(400.0 / (6.0 + 4.0 + 5.0), rel=0.3)


def test_timing_is_by_seed_and_name_alone() -> None:
    path = ((1.0, 1.0), (8.0, 1.0))
    when = times(60.0, 0.5)

    def where(people: Sequence[Person], seed: int) -> np.ndarray:
        movers = [body.mover for body in moving_bodies(people, seed=seed)]
        return of(movers, "anna_torso").pose_at(when)[0]

    alone = where([Person("anna", path)], 0)
    np.testing.assert_array_equal(alone, where([Person("ben", path), Person("anna", path)], 0))
    assert np.abs(alone - where([Person("anna", path)], 1)).max() > 0.5
    movers = [body.mover for body in moving_bodies([Person("anna", path), Person("ben", path)])]
    ben = of(movers, "ben_torso").pose_at(when)[0]
    assert np.abs(alone - ben).max() > 0.5
    speeds = [where([Person("anna", path)], s) for s in range(20)]
    fastest = [np.hypot(*np.diff(p[:, :2], axis=0).T).max() / 0.5 for p in speeds]
    assert min(fastest) > 0.75
    assert max(fastest) <= 1.4
    assert max(fastest) - min(fastest) > 0.3


def test_actor_with_a_start_time_stands_until_then() -> None:
    (torso, *_) = moving_bodies([Person("anna", ((1.0, 1.0), (8.0, 1.0)), start=5.0)])
    x = torso.mover.pose_at(np.array([0, 5, 7]) * SECOND)[0][:, 0]
    np.testing.assert_allclose(x[:2], 1.0)
    assert x[2] > 1.5


@pytest.mark.parametrize(
    ("life", "message"),
    [
        ('[[person]]\nname = "a"', "person 'a': lacks the entry 'path'"),
        ('[[person]]\nname = "a"\npath = [1, 2]', "person 'a': path must be a list of"),
        ('[[person]]\nname = "a"\npath = [[1, 1]]', "person 'a': path must have 2 way-points"),
        ('[[person]]\nname = "a"\npath = [[1, 1], [2, 2]]\nspeed = 9.0',
         "person 'a': speed must be at most 2.5 m/s, got 9"),
        ('[[person]]\nname = "a"\npath = [[1, 1], [2, 2]]\nhat = true', "unknown entry 'hat'"),
        ('[[person]]\nname = "a"\npath = [[1, 1], [2, 2]]\n'
         '[[cart]]\nname = "a"\npath = [[1, 1], [2, 2]]', "two actors have this name"),
        ('[[person]]\nname = "a"\npath = [[8, 4], [12, 4], [12, 6]]',
         "person 'a' walks through east_0 between [8, 4] and [12, 4]"),
        ('[[cart]]\nname = "c"\npath = [[1, 1], [2, 2]]\nsize = [1, 1, 0.1]',
         "cart 'c': height must be > 0.35 m"),
        ('[[leaf]]\nname = "d"\nhinge = [1, 1]\nclosed = 0\nswing = 90\nmoving_time = 0',
         "leaf 'd': moving_time must be > 0"),
    ],
)  # fmt: skip
def test_invalid_actor_is_rejected_by_name(life: str, message: str) -> None:
    with pytest.raises(WorldError) as caught:
        room("5.0, 4.0, 0.0", life)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


# ---- in the world


def test_nothing_moves_unless_the_world_is_alive(office: World) -> None:
    assert office.movers == ()
    assert office.model.nmocap == 0
    alive = load_world("office", options=ALIVE)
    assert alive.model.nmocap == len(alive.movers) > 20
    # And what stands still is the same.
    still = [office.model.geom(i).name for i in range(office.model.ngeom)]
    assert set(still) <= {alive.model.geom(i).name for i in range(alive.model.ngeom)}


def test_physics_and_scanners_see_a_walker_at_its_computed_pose() -> None:
    world = room(
        "1.0, 4.0, 0.0",
        '[[person]]\nname = "anna"\npath = [[4, 1], [4, 7]]\nspeed = 1.3\nstart = 0.5\n',
    )
    simulation = Simulation(world, seed=3)
    data = simulation._data
    seen = 0
    for _ in range(250):
        readings = simulation.step()
        now = np.array([simulation.stamp])
        for mover in world.movers:
            positions, yaws = mover.pose_at(now)
            body = data.body(mover.name)
            # The last step of the tick began with the bodies where they are at its end.
            np.testing.assert_allclose(body.xpos, positions[0], atol=1e-12)
            assert math.atan2(body.xmat[3], body.xmat[0]) == pytest.approx(yaws[0], abs=1e-9)
        for scan in readings:
            if isinstance(scan, Scan) and scan.scanner == "laser_horizontal":
                seen += _beams_on_legs(scan, world)
    assert seen > 150


def _beams_on_legs(scan: Scan, world: World) -> int:
    """Check the beams that hit a leg against where the leg was at each beam's own time; count them."""
    mount = (1.0 + 0.125, 4.0)
    x = mount[0] + scan.ranges * np.cos(scan.angles)
    y = mount[1] + scan.ranges * np.sin(scan.angles)
    when = scan.stamp + scan.offsets
    legs = [m for m in world.movers if m.name.endswith("_leg")]
    off = [np.hypot(x - p[:, 0], y - p[:, 1]) for p in (m.pose_at(when)[0] for m in legs)]
    nearest = np.min(off, axis=0)
    hit = nearest < 0.13
    # On the leg's skin, but for the noise of 12 mm and grazing beams.
    assert (np.abs(nearest[hit] - 0.065) < 0.06).all()
    return int(hit.sum())


def test_doors_close_before_the_scanner() -> None:
    world = room(
        "5.0, 4.0, 0.0",
        '[[leaf]]\nname = "door"\nhinge = [6.5, 3.5]\nclosed = 90\nswing = -90\nwidth = 1.0\n'
        "open_time = 2.0\nclosed_time = 2.0\nmoving_time = 1.0\n",
    )
    simulation = Simulation(world)
    ahead = [
        float(reading.ranges[len(reading.ranges) // 2])
        for _ in range(600)
        for reading in simulation.step()
        if isinstance(reading, Scan) and reading.scanner == "laser_horizontal"
    ]
    # The leaf, 4 cm thick, at x 6.5; or the east wall at x 10.
    assert min(ahead) == pytest.approx(6.48 - 5.125, abs=0.06)
    assert max(ahead) == pytest.approx(10.0 - 5.125, abs=0.06)


# ---- when they meet the robot


def _run(
    world: World, seconds: float, forward: float = 0.0
) -> tuple[Simulation, np.ndarray, float]:
    """Return the simulation, the robot's positions (N, 3) at each tick and its top speed."""
    simulation = Simulation(world, config=BLIND)
    path, fastest = [], 0.0
    for _ in range(round(seconds * SECOND / TICK_NS)):
        simulation.command(Twist.planar(forward, 0.0))
        simulation.step()
        truth = simulation.truth()
        path.append(truth.map_from_base.position)
        fastest = max(fastest, float(np.linalg.norm(truth.twist.linear)))
    return simulation, np.array(path), fastest


def test_person_who_walks_into_the_robot_pushes_it_and_walks_on() -> None:
    life = '[[person]]\nname = "a"\npath = [[5, 1], [5, 7]]\nspeed = 1.2\nstart = 0.5\n'
    simulation, path, fastest = _run(room("5.0, 4.0, 0.0", life), 9.0)
    shoved = np.hypot(*(path[-1] - path[0])[:2])
    assert 0.01 < shoved < 0.4
    assert fastest < 0.8
    assert abs(path[-1][2]) < 0.005
    assert simulation.touching == ()


@pytest.mark.parametrize(
    "life",
    [
        '[[person]]\nname = "a"\npath = [[4, 0.4], [9.6, 0.4]]\nspeed = 1.4\nstart = 0.5\n',
        '[[cart]]\nname = "a"\npath = [[4, 0.45], [9.4, 0.45]]\nspeed = 1.0\nstart = 0.5\n',
        '[[leaf]]\nname = "a"\nhinge = [9.0, 0.05]\nclosed = 100\nswing = -95\nclosed_time = 2.0\n',
    ],
)
def test_cornered_robot_is_not_pressed_through_the_wall(life: str) -> None:
    simulation, path, fastest = _run(room("9.6, 0.4, 0.0", life), 16.0)
    # Its middle stays in the room, whose corner is at x 10, y 0, and it lands on its wheels.
    assert (path[:, 0] < 9.85).all()
    assert (path[:, 1] > 0.15).all()
    assert fastest < 0.8
    assert simulation.truth().map_from_base.rotation[2, 2] > 0.99


def test_standing_person_stops_the_robot() -> None:
    life = '[[person]]\nname = "a"\npath = [[6, 4], [9, 4]]\nstart = 500.0\n'
    simulation, path, _ = _run(room("4.0, 4.0, 0.0", life), 6.0, forward=0.7)
    assert path[-1][0] < 5.8
    assert any(name.startswith("a_") for name in simulation.touching)


# ---- in our scenes


def clearances(
    world: World, step: float = 0.2, horizon: float = 0.2
) -> dict[str, tuple[float, str]]:
    """Return each mover's least distance [m] from what stands still, over a cycle, and from what."""
    model, data = world.model, mujoco.MjData(world.model)
    mujoco.mj_kinematics(model, data)
    body_of = model.geom_bodyid
    ground = np.isin(model.geom_type, (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD))
    still = np.flatnonzero(
        (model.body_weldid[body_of] == 0) & (model.body_mocapid[body_of] < 0) & ~ground
    )
    centres, radii = data.geom_xpos[still].copy(), model.geom_rbound[still]
    least = {}
    for mover in world.movers:
        cycle = mover.walk.cycle if isinstance(mover, WalkingBody) else 120 * SECOND
        positions, yaws = mover.pose_at(np.arange(0, cycle, int(step * SECOND), dtype=np.int64))
        body = model.body(mover.name)
        slot = model.body_mocapid[body.id]
        geoms = np.flatnonzero(body_of == body.id)
        best = (horizon, "nothing")
        for position, yaw in zip(positions, yaws, strict=True):
            data.mocap_pos[slot] = position
            data.mocap_quat[slot] = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
            mujoco.mj_kinematics(model, data)
            for geom in geoms:
                gaps = np.linalg.norm(centres - data.geom_xpos[geom], axis=1) - radii
                for other in still[gaps < model.geom_rbound[geom] + horizon]:
                    gap = mujoco.mj_geomDistance(model, data, geom, other, horizon, None)
                    best = min(best, (gap, model.geom(other).name))
        least[mover.name] = best
    return least


@pytest.mark.slow
@pytest.mark.parametrize("scene", scene_names())
def test_actors_pass_through_nothing_in_our_scenes(scene: str) -> None:
    world = load_world(scene, options=ALIVE)
    assert world.movers, "every scene has somebody in it"
    for name, (gap, what) in clearances(world, step=0.8 if scene == "warehouse" else 0.25).items():
        least = 0.005 if name.endswith("_leaf") else 0.03
        assert gap >= least, f"{name} comes within {gap:.3f} m of {what}"


def test_actors_do_not_pass_through_moved_furniture() -> None:
    world = load_world("office", options=WorldOptions(alive=True, rearranged=1))
    for name, (gap, what) in clearances(world, step=0.4).items():
        assert gap >= 0.005, f"{name} comes within {gap:.3f} m of {what}"


@pytest.mark.parametrize("scene", scene_names())
def test_no_actor_stands_at_the_robots_start(scene: str) -> None:
    world = load_world(scene, options=ALIVE)
    spawn = world.spawn.position[:2]
    when = times(15.0, 0.1)
    for mover in world.movers:
        positions, _ = mover.pose_at(when)
        assert np.hypot(*(positions[:, :2] - spawn).T).min() > 0.7, mover.name
