"""Grip by surface and by slip."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import Pose, Twist
from robot_sim.array_types import FloatArray
from robot_sim.drive.tyres import FULL_SLIDE, Tyres, lateral_grip
from robot_sim.errors import WorldError
from robot_sim.robot.drivable_surfaces import mark_drivable
from robot_sim.robot.mujoco_body import WHEELS, add_robot, set_physics
from robot_sim.robot.platforms import P3AT
from robot_sim.scene_objects.floor_surfaces import SURFACES, Patch, Surface
from robot_sim.simulation import Simulation
from robot_sim.validation import friction_theory as coulomb
from robot_sim.validation.drive_bench import STEP, DriveBench, chi, ramped
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND, run

MUD = Surface("mud", 0.3, 0.5, 0.1, "for these tests")


def friction(model: mujoco.MjModel, wheel: str, ground: str = "floor") -> list[float]:
    """Friction across and along a wheel on a geom."""
    return list(np.round(model.pair(f"{wheel}_on_{ground}").friction[:2], 9))


@given(slip=st.floats(0.0, 1.0), rim=st.floats(-2.0, 2.0), more=st.floats(0.0, 0.5))
def test_grip_across_grows_with_slip_and_never_beyond_full(
    slip: float, rim: float, more: float
) -> None:
    here = lateral_grip(slip, rim)
    assert 0.8 < here <= lateral_grip(slip + more, rim) + 1e-12 <= 1.0 + 1e-12
    assert here == lateral_grip(slip, -rim)


@given(rim=st.floats(-1e-4, 1e-4))
def test_grip_is_full_at_rest(rim: float) -> None:
    assert lateral_grip(0.0, rim) == 1.0


@given(rim=st.floats(0.05, 2.0))
def test_grip_has_no_jump_where_the_tyre_begins_to_slide(rim: float) -> None:
    edge = FULL_SLIDE * rim
    below, above = lateral_grip(edge * (1 - 1e-4) - 1e-4, rim), lateral_grip(edge, rim)
    assert above == 1.0
    assert below == pytest.approx(1.0, abs=1e-4)


def test_model_of_the_world_is_never_modified(field: World) -> None:
    before = field.model.pair_friction.copy(), field.model.dof_frictionloss.copy()
    simulation = Simulation(field, config=BLIND)
    run(simulation, 50, Twist.planar(0.5, 0.1))
    assert (field.model.pair_friction == before[0]).all()
    assert (field.model.dof_frictionloss == before[1]).all()
    assert friction(simulation._model, "front_left")[0] < 0.7


def test_each_wheel_has_the_surface_that_it_stands_on() -> None:
    robot = P3AT()
    patch = Patch(MUD, 1.0, 0.3, half=(1.0, 0.3))
    bench = DriveBench(robot, SURFACES["tile"], patches=[patch])
    bench.run(ramped(0.0, 0.0, 0.1))
    for wheel in WHEELS:
        on_mud = wheel == "front_left"
        assert friction(bench.model, wheel) == ([0.5, 0.3] if on_mud else [0.7, 0.7])
        load = robot.mass * 9.81 / 4.0 * robot.rolling_radius
        resistance = (0.1 if on_mud else 0.015) * load
        assert bench.model.joint(wheel).frictionloss[0] == pytest.approx(resistance)


def test_patch_under_one_side_makes_a_braking_robot_swerve() -> None:
    slippery = Patch(SURFACES["ice"], 0.0, 10.0, half=(50.0, 10.0))
    for patches, swerves in (((), False), ((slippery,), True)):
        bench = DriveBench(P3AT(), SURFACES["tile"], patches=patches)
        # Full speed at once: the wheels spin on ice and grip on tile.
        driven = bench.run(ramped(6.0, 6.0, 1.0, ramp=0.0))
        assert (float(driven.yaws[-1]) > math.radians(3.0)) == swerves


@pytest.mark.parametrize("speed", [0.05, 0.2, 0.6])
def test_chi_follows_the_published_curve_at_any_speed(speed: float) -> None:
    robot, curve = P3AT(), 10.0
    mean = speed / robot.rolling_radius
    left, right = mean * (1.0 - 1.0 / curve), mean * (1.0 + 1.0 / curve)
    run = DriveBench(robot).run(ramped(left, right, 6.0)).after(2.0)
    assert chi(robot, run) == pytest.approx(coulomb.published_chi(curve), rel=0.03)


def test_without_compliance_chi_is_one_number() -> None:
    robot = P3AT()
    run = DriveBench(robot, compliant=False).run(ramped(2.7, 3.3, 4.0)).after(2.0)
    assert chi(robot, run) == pytest.approx(robot.chi, rel=0.01)


def test_grip_settles_in_a_steady_curve() -> None:
    bench = DriveBench(P3AT())
    bench.run(ramped(2.7, 3.3, 3.0))
    grips = []
    for _ in range(50):
        bench.run(ramped(2.7, 3.3, STEP * 5, ramp=0.0))
        grips.append(bench.model.pair_friction[:, 0].copy())
    assert np.ptp(grips, axis=0).max() < 1e-3


def on_ground(kind: str) -> mujoco.MjModel:
    """A robot on level ground of some kind, with friction 0.6 along and 0.8 across."""
    spec = mujoco.MjSpec()
    set_physics(spec, timestep=STEP)
    if kind == "box":
        geom = spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_BOX, pos=(0, 0, -0.5), size=(20, 20, 0.5)
        )
    else:
        spec.add_hfield(name="h", nrow=41, ncol=41, size=(10, 10, 1, 0.1), userdata=[0.0] * 41**2)
        geom = spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="h"
        )
    mark_drivable(geom, 0.6, 0.8)
    add_robot(spec, surfaces=("floor",), robot=P3AT())
    return spec.compile()


@pytest.mark.parametrize("kind", ["box", "hfield"])
def test_off_planes_grip_is_the_mean_in_all_directions(kind: str) -> None:
    robot, model = P3AT(), on_ground(kind)
    tyres, data = Tyres(model, robot), mujoco.MjData(model)
    angles, yaws = [], []
    for tick in range(150):
        share = min(1.0, tick / 25)
        data.ctrl[:] = share * np.array([-2.0, 2.0, -2.0, 2.0])
        tyres.grip(data)
        mujoco.mj_step(model, data, nstep=round(0.02 / STEP))
        angles.append(data.qpos[7:11].copy())
        yaws.append(2.0 * math.atan2(data.qpos[6], data.qpos[3]))
    assert friction(model, "rear_right") == [0.7, 0.7]
    turned = angles[-1] - angles[50]
    promised = (turned[1::2].mean() - turned[::2].mean()) * robot.rolling_radius / robot.track
    yaw = float(np.unwrap(yaws)[-1] - np.unwrap(yaws)[50])
    assert promised / yaw == pytest.approx(robot.chi, rel=0.03)


def test_each_wheel_rolls_with_the_resistance_of_the_geom_that_it_touches() -> None:
    spec = mujoco.MjSpec()
    set_physics(spec, timestep=STEP)
    plane, box = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_BOX
    floor = spec.worldbody.add_geom(name="floor", type=plane, size=(20, 20, 0.1))
    mark_drivable(floor, 0.7, 0.7, 0.01)
    # A slab under the left wheels, a centimetre high.
    slab = spec.worldbody.add_geom(name="slab", type=box, pos=(0, 1.0, 0), size=(5, 0.9, 0.01))
    mark_drivable(slab, 0.5, 0.5, 0.05)
    robot = P3AT()
    add_robot(spec, surfaces=("floor", "slab"), robot=robot)
    model = spec.compile()
    data, tyres = mujoco.MjData(model), Tyres(model, robot)
    data.qpos[2] = 0.011
    mujoco.mj_step(model, data, nstep=250)
    tyres.grip(data)
    load = robot.mass * 9.81 / 4.0 * robot.rolling_radius
    losses = [model.joint(w).frictionloss[0] / load for w in WHEELS]
    assert losses == pytest.approx([0.05, 0.01, 0.05, 0.01])
    data.qpos[2] += 0.1
    mujoco.mj_forward(model, data)
    tyres.grip(data)
    assert [model.joint(w).frictionloss[0] for w in WHEELS] == [0.0] * 4


def test_model_without_a_pair_for_a_wheel_is_rejected() -> None:
    spec = mujoco.MjSpec()
    add_robot(spec, surfaces=(), robot=P3AT())
    with pytest.raises(WorldError, match="no surface is drivable for front_left"):
        Tyres(spec.compile(), P3AT())


def test_patches_of_a_world_reach_the_wheels(field: World) -> None:
    iced = replace(field, patches=(Patch(SURFACES["ice"], 0.0, 0.0, half=(2.0, 2.0)),))

    def ran(world: World, start: Pose) -> FloatArray:
        simulation = Simulation(world, config=BLIND, start=start)
        run(simulation, 40, Twist.planar(0.0, 2.0))
        along: FloatArray = simulation._model.pair_friction[:, 1].copy()
        return along

    assert ran(iced, Pose.identity()) == pytest.approx(0.1)
    assert ran(iced, Pose.planar(5.0, 0.0, 0.0)) == pytest.approx(0.7)
