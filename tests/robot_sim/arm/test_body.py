"""The arm's body in a model: the table's geometry and mass, its servos' strength, and what collides with what."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.body import arm_top, fold_arm
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.parts import ARM_BASE
from robot_sim.errors import ArmError
from robot_sim.robot.mujoco_body import add_robot, set_physics
from robot_sim.robot.platforms import HUSKY, P3AT

TABLE = load_arm()


def on_floor() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    set_physics(spec, timestep=0.004)
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(5.0, 5.0, 0.1),
        contype=2,
        conaffinity=2,
    )
    add_robot(spec, ("floor",), P3AT(), TABLE)
    return spec


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return on_floor().compile()


def test_the_arm_adds_its_mass_and_nothing_else(model: mujoco.MjModel) -> None:
    assert model.body(ARM_BASE).subtreemass[0] == pytest.approx(TABLE.mass, abs=1e-12)
    assert model.body("base_link").subtreemass[0] == pytest.approx(P3AT().mass + TABLE.mass)


def test_no_servo_is_stronger_than_its_stall_torque(model: mujoco.MjModel) -> None:
    for joint in TABLE.joints:
        stall = joint.servo.torque(TABLE.supply)
        assert model.actuator(joint.name).forcerange.tolist() == [-stall, stall]


def test_a_folded_arm_touches_nothing_and_stays_below_the_scanner(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    fold_arm(model, data)
    mujoco.mj_forward(model, data)
    inside = model.body_rootid == model.body("base_link").id
    bodies = model.geom_bodyid[np.asarray(data.contact.geom).reshape(-1, 2)]
    assert not inside[bodies].all(axis=1).any()
    geoms = [g for g in range(model.ngeom) if model.geom(g).name.startswith("arm_")]
    assert max(top(model, data, geom) for geom in geoms) < 0.385


def top(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Return the height of the highest point of a box or cylinder."""
    up, half = np.abs(data.geom_xmat[geom].reshape(3, 3)[2]), model.geom_size[geom]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        half = np.array([half[0], 0.0, half[1]])
        up = np.array([math.sqrt(max(0.0, 1.0 - up[2] ** 2)), 0.0, up[2]])
    return float(data.geom_xpos[geom, 2] + up @ half)


@pytest.mark.parametrize(
    ("angles", "touching"),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.0), False),  # outstretched
        ((0.0, 135.0, -135.0, 0.0, -90.0), True),  # the gripper in the base
        ((0.0, -45.0, -135.0, 0.0, 0.0), True),  # under the chassis
        ((90.0, 90.0, 45.0, 0.0, 90.0), False),
    ],
)
def test_the_arm_collides_with_itself_and_the_vehicle(
    model: mujoco.MjModel, angles: tuple[float, ...], touching: bool
) -> None:
    data = mujoco.MjData(model)
    data.qpos[2] = 1.0
    joints = [int(model.joint(joint.name).qposadr[0]) for joint in TABLE.joints]
    data.qpos[joints] = np.radians(angles)
    mujoco.mj_forward(model, data)
    names = {model.geom(g).name for g in np.asarray(data.contact.geom).ravel()}
    assert any(name.startswith("arm_") for name in names) == touching


def test_the_top_is_where_the_arm_points_straight_up(model: mujoco.MjModel) -> None:
    upright = np.radians((0.0, 90.0, 0.0, 0.0, 0.0))
    tip = Kinematics(TABLE).tip(upright)[2, 3] + TABLE.mounts["bracket"].position[2]
    assert arm_top(TABLE, "bracket") == pytest.approx(tip)


def test_an_arm_is_refused_on_a_robot_it_has_no_mounts_for() -> None:
    with pytest.raises(ArmError, match="has mounts for a p3at only, not for a husky"):
        add_robot(mujoco.MjSpec(), (), HUSKY, TABLE)
