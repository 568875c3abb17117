"""The simulation as a whole: time, order, determinism, failure."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from localization.types import Inertial, Pose, Reading, Scan, Twist, WheelSpeeds
from robot_sim.errors import PhysicsError, SimulationError, WorldError
from robot_sim.physics import Physics
from robot_sim.robot.mujoco_body import FLOOR_BIT, OBSTACLE_BIT, add_robot, set_physics
from robot_sim.robot_placement import place_robot
from robot_sim.sensors.lidar import ScannerConfig
from robot_sim.simulation import STEPS_PER_TICK, TICK_NS, Simulation, SimulationConfig
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import TIMESTEP_NS, World
from tests.robot_sim.driving import BLIND, run

BARE = "bounds = [-9, -9, 9, 9]\nspawn = [0, 0, 0]\nceiling = false"


def fingerprint(reading: Reading) -> bytes:
    """Return all numbers of a reading, bit by bit."""
    if isinstance(reading, Scan):
        return reading.ranges.tobytes()
    if isinstance(reading, Inertial):
        return reading.angular_velocity.tobytes() + reading.specific_force.tobytes()
    assert isinstance(reading, WheelSpeeds)
    return np.array([reading.left, reading.right]).tobytes()


def readings(world: World, *, seed: int, config: SimulationConfig | None = None) -> list[Reading]:
    simulation = Simulation(world, seed=seed, config=config)
    seen: list[Reading] = []
    for tick in range(60):
        simulation.command(Twist.planar(0.4, 0.6 if tick > 30 else -0.3))
        seen += simulation.step()
    return seen


def test_same_seed_gives_the_same_bits_and_another_seed_does_not(room: World) -> None:
    first, again, other = (readings(room, seed=s) for s in (7, 7, 8))
    assert [fingerprint(r) for r in first] == [fingerprint(r) for r in again]
    moving = [(a, b) for a, b in zip(first, other, strict=True) if a.stamp > 100_000_000]
    assert all(fingerprint(a) != fingerprint(b) for a, b in moving)


def test_removing_a_sensor_does_not_change_the_others(room: World) -> None:
    def without_horizontal(seen: list[Reading]) -> list[bytes]:
        return [fingerprint(r) for r in seen
                if not (isinstance(r, Scan) and r.scanner == "laser_horizontal")]  # fmt: skip

    alone = SimulationConfig(scanners=(ScannerConfig("laser_vertical"),))
    full, less = readings(room, seed=2), readings(room, seed=2, config=alone)
    assert without_horizontal(full) == without_horizontal(less)


def end(reading: Reading) -> int:
    return reading.end_stamp if isinstance(reading, Scan) else reading.stamp


def test_readings_are_returned_when_due_in_order_of_their_ends(room: World) -> None:
    simulation = Simulation(room)
    seen: list[Reading] = []
    for tick in range(1, 51):
        readings = simulation.step()
        assert simulation.stamp == simulation.truth().stamp == tick * TICK_NS
        assert all(simulation.stamp - TICK_NS < end(r) <= simulation.stamp for r in readings)
        assert [type(r) for r in readings[-2:]] == [WheelSpeeds, Inertial]
        seen += readings
    ends = [end(r) for r in seen]
    assert ends == sorted(ends)
    assert sum(isinstance(r, Scan) for r in seen) == 20


def test_start_pose_overrides_the_spawn(room: World) -> None:
    simulation = Simulation(room, start=Pose.planar(6.0, 5.0, 1.0))
    pose = simulation.truth().map_from_base
    np.testing.assert_allclose(pose.position, [6.0, 5.0, 0.0], atol=1e-3)
    assert pose.yaw == pytest.approx(1.0)


def test_robot_cannot_start_inside_a_wall(room: World) -> None:
    with pytest.raises(WorldError, match="stand inside east_0"):
        Simulation(room, start=Pose.planar(9.95, 4.0, 0.0))


@pytest.mark.parametrize("poison", [np.nan, np.inf, 1e11])
def test_unstable_physics_raises_one_line_and_writes_no_file(
    field: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, poison: float
) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = Simulation(field, config=BLIND)
    simulation.step()
    simulation._data.qvel[0] = poison
    with pytest.raises(
        PhysicsError, match=r"unstable at 0\.020 s: the velocity of body 'base_link' is not finite"
    ) as caught:
        simulation.step()
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, SimulationError)
    assert list(tmp_path.iterdir()) == []


def test_spinning_robot_has_the_twist_that_its_poses_show(field: World) -> None:
    simulation = Simulation(field, config=BLIND)
    run(simulation, 200, Twist.planar(0.4, 0.5))
    before = simulation.truth()
    simulation.step()
    moved = before.map_from_base.inverse() @ simulation.truth().map_from_base
    np.testing.assert_allclose(moved.position / 0.02, before.twist.linear, atol=5e-3)
    assert moved.yaw / 0.02 == pytest.approx(before.twist.angular[2], rel=1e-3)


def test_tick_is_bit_for_bit_what_single_steps_give(office: World) -> None:
    physics = Physics(office.model, office.spawn, steps_per_tick=STEPS_PER_TICK)
    model, data = physics.model, mujoco.MjData(physics.model)
    place_robot(model, data, office.spawn)
    rng = np.random.default_rng(4)
    for _ in range(40):
        controls = rng.uniform(-6.0, 6.0, (STEPS_PER_TICK, 4))
        motion = physics.advance(controls)
        for step in range(STEPS_PER_TICK):
            data.ctrl[:] = controls[step]
            mujoco.mj_step(model, data)
            np.testing.assert_array_equal(motion.poses[step], data.qpos[:7])
            np.testing.assert_array_equal(motion.angular_velocities[step], data.qvel[3:6])
            np.testing.assert_array_equal(motion.sensors[step], data.sensordata)
    for name in ("qpos", "qvel", "act", "sensordata", "qacc_warmstart", "xpos"):
        np.testing.assert_array_equal(getattr(physics.data, name), getattr(data, name))
    np.testing.assert_array_equal(physics.data.contact.geom, data.contact.geom)


def with_a_floor() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    set_physics(spec, timestep=TIMESTEP_NS * 1e-9)
    plane, bits = mujoco.mjtGeom.mjGEOM_PLANE, {"contype": FLOOR_BIT, "conaffinity": FLOOR_BIT}
    spec.worldbody.add_geom(name="floor", type=plane, size=(9, 9, 1), **bits)
    return spec


def test_forces_and_mocap_poses_are_constant_through_a_tick() -> None:
    spec = with_a_floor()
    cart = spec.worldbody.add_body(name="cart", mocap=True, pos=(5.0, 5.0, 1.0))
    cart.add_geom(size=(0.1, 0.0, 0.0))
    add_robot(spec, surfaces=("floor",))
    physics = Physics(spec.compile(), Pose.identity(), steps_per_tick=STEPS_PER_TICK)
    physics.data.mocap_pos[0] = (1.0, 2.0, 3.0)
    physics.data.body("base_link").xfrc_applied[2] = 1000.0
    for _ in range(3):
        motion = physics.advance(np.zeros((STEPS_PER_TICK, 4)))
    np.testing.assert_array_equal(physics.data.body("cart").xpos, (1.0, 2.0, 3.0))
    # 1000 N lift 27 kg by (1000 / 27 - 9.8) t^2 / 2.
    assert motion.poses[-1, 2] == pytest.approx(0.5 * 27.2 * 0.06**2, rel=0.1)


def springs(stiffness: float) -> World:
    """A field with a light arm on a spring that explicit steps of milliseconds cannot follow."""
    spec = with_a_floor()
    add_robot(spec, surfaces=("floor",))
    arm = spec.worldbody.add_body(name="barrier", pos=(0.0, 3.0, 1.0))
    arm.add_joint(name="pivot", stiffness=stiffness, axis=(0.0, 0.0, 1.0))
    arm.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=(0.5, 0.0, 0.0),
        size=(0.5, 0.01, 0.01),
        mass=0.01,
    )
    model = spec.compile()
    model.qpos0[model.joint("pivot").qposadr[0]] = 0.1
    return replace(parse_world(BARE, name="springs"), model=model)


def test_instability_names_the_joint_the_time_and_the_place() -> None:
    calm = Simulation(springs(0.1), config=BLIND)
    run(calm, 50)
    simulation = Simulation(springs(1e6), config=BLIND)
    with pytest.raises(
        PhysicsError,
        match=r"^physics became unstable at 0\.0\d\d s with the robot at x 0\.00, y 0\.00, z -?0\.00:"
        r" the acceleration of joint 'pivot' of body 'barrier' is not finite or too large$",
    ):
        simulation.step()
    # It stays unstable: nobody can go on from there by asking again.
    with pytest.raises(PhysicsError, match="pivot"):
        simulation.step()


def test_absurd_speed_is_an_error(field: World) -> None:
    simulation = Simulation(field, config=BLIND)
    simulation._data.qvel[1] = 5000.0
    with pytest.raises(PhysicsError, match=r"body 'base_link' moves at \S+ m/s or rad/s"):
        simulation.step()


def test_model_with_another_time_step_is_rejected(field: World) -> None:
    model = copy.copy(field.model)
    model.opt.timestep = 0.01
    with pytest.raises(PhysicsError, match=r"time step is 0\.01 s"):
        Physics(model, field.spawn, steps_per_tick=STEPS_PER_TICK)


def test_crate_sleeps_until_the_robot_pushes_it() -> None:
    spec = with_a_floor()
    crate = spec.worldbody.add_body(name="crate", pos=(1.0, 0.0, 0.2))
    crate.add_freejoint()
    box, bits = mujoco.mjtGeom.mjGEOM_BOX, FLOOR_BIT | OBSTACLE_BIT
    crate.add_geom(type=box, size=(0.2, 0.2, 0.2), mass=3.0, contype=bits, conaffinity=bits)
    add_robot(spec, surfaces=("floor",))
    physics = Physics(spec.compile(), Pose.identity(), steps_per_tick=STEPS_PER_TICK)
    for _ in range(100):
        physics.advance(np.zeros((STEPS_PER_TICK, 4)))
    awake = physics.data.nbody_awake
    for _ in range(200):
        motion = physics.advance(np.full((STEPS_PER_TICK, 4), 4.0))
    assert physics.data.nbody_awake == awake + 1
    gap = physics.data.body("crate").xpos[0] - motion.poses[-1, 0]
    assert physics.data.body("crate").xpos[0] > 1.3
    assert gap == pytest.approx(0.45, abs=0.05)


def test_carried_robot_stands_where_it_was_put_and_its_wheels_notice_nothing(office: World) -> None:
    simulation = Simulation(office, seed=4)
    run(simulation, 10)
    here = simulation.truth().map_from_base
    there = Pose.planar(float(here.position[0]) - 3.0, float(here.position[1]), 1.0)
    simulation.carry_to(
        Pose(np.array([*there.position[:2], here.position[2]]), there.quaternion_wxyz)
    )
    readings = [r for _ in range(10) for r in simulation.step()]
    assert simulation.stamp == 20 * TICK_NS
    now = simulation.truth().map_from_base
    assert np.linalg.norm(now.position[:2] - there.position[:2]) < 0.01
    assert abs(now.yaw - 1.0) < 0.01
    wheels = [r for r in readings if isinstance(r, WheelSpeeds)]
    assert max(abs(r.left) + abs(r.right) for r in wheels) < 0.05


def test_robot_that_would_stand_in_a_wall_is_not_carried(office: World) -> None:
    simulation = Simulation(office, seed=4)
    here = simulation.truth().map_from_base
    with pytest.raises(WorldError, match="would stand inside"):
        simulation.carry_to(Pose(np.array([0.0, 0.0, here.position[2]]), here.quaternion_wxyz))
    np.testing.assert_array_equal(simulation.truth().map_from_base.position, here.position)
