"""Measurements on the arm: its three models against each other, its bending moments, and when the vehicle tips over."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

from robot_sim.arm.arm_table import KGF_CM, ArmTable
from robot_sim.arm.body import add_arm
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.parts import TOOL
from robot_sim.array_types import FloatArray
from robot_sim.drive.tyres import GRAVITY
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.urdf import urdf
from robot_sim.scene_objects.floor_surfaces import Surface
from robot_sim.validation.drive_bench import TICK, DriveBench, HeldArm

MOUNT: Final = "bracket"
"""Where the arm is mounted while its models are compared."""
UPRIGHT: Final = (0.0, 0.5 * math.pi, 0.0, 0.0, 0.0)
"""Pose with all links in one line, from the base on [rad]."""
ROUGH: Final = Surface("rough", 2.0, 2.0, 0.0, "so that the robot tips over before it slides")
_READER: Final = (
    '<mujoco><compiler fusestatic="false" discardvisual="true" balanceinertia="false"/></mujoco>'
)
"""What MuJoCo needs in a URDF to keep inertias, and bodies without joints, as they are."""
_NEAR: Final = math.radians(5.0)
"""Distance from the expected slope at which the ground is tilted slowly [rad]."""
_FAST: Final = math.radians(20.0)
"""Rate at which it is tilted before [rad/s]."""
_SLOW: Final = math.radians(1.0)
"""Rate then [rad/s]."""
_PAUSE: Final = 0.1
"""Time between two slopes [s]."""


class ArmModel:
    """An arm on a vehicle that is held, without limits, contacts and rotors, which a URDF does not describe."""

    def __init__(self, model: mujoco.MjModel, table: ArmTable) -> None:
        """Take a compiled model that contains the arm."""
        self.model, self.data = model, mujoco.MjData(model)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        model.dof_armature[:] = 0.0
        joints = [model.joint(joint.name) for joint in table.joints]
        self._angles = [int(joint.qposadr[0]) for joint in joints]
        self._rates = [int(joint.dofadr[0]) for joint in joints]

    def tip(self, angles: FloatArray) -> FloatArray:
        """Return ``base_from_tool0`` (4, 4) for joint angles (5,) [rad]."""
        self.data.qpos[self._angles] = angles
        mujoco.mj_kinematics(self.model, self.data)
        found, tip = self.data.body(TOOL), np.eye(4)
        tip[:3, :3], tip[:3, 3] = found.xmat.reshape(3, 3), found.xpos
        return tip

    def torques(self, angles: FloatArray, rates: FloatArray, gains: FloatArray) -> FloatArray:
        """Return the torques (5,) [N m] of a motion: angles [rad], rates [rad/s], accelerations [rad/s^2]."""
        data = self.data
        data.qpos[self._angles], data.qvel[self._rates] = angles, rates
        data.qacc[self._rates] = gains
        mujoco.mj_inverse(self.model, data)
        return np.array(data.qfrc_inverse[self._rates])


def simulated(table: ArmTable) -> ArmModel:
    """Return the arm as it is simulated, on a vehicle that is nothing but a frame."""
    spec = mujoco.MjSpec()
    add_arm(spec, spec.worldbody.add_body(name="base_link"), table, MOUNT)
    return ArmModel(spec.compile(), table)


def described(table: ArmTable) -> ArmModel:
    """Return the arm as its URDF describes it, read by MuJoCo."""
    robot = P3AT()
    text = urdf(robot, robot.mounts, arm=table, arm_mount=MOUNT)
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", _READER + "</robot>"))
    return ArmModel(model, table)


def tips_apart(table: ArmTable, poses: FloatArray) -> float:
    """Return the greatest difference [m] of tips by matrices, simulated and described, in poses (N, 5) [rad]."""
    models, kinematics, base_from_arm = (
        (simulated(table), described(table)),
        Kinematics(table),
        np.eye(4),
    )
    base_from_arm[:3, 3] = table.mount(MOUNT).position
    worst = 0.0
    for pose in poses:
        tip = base_from_arm @ kinematics.tip(pose)
        worst = max(worst, *(float(np.abs(m.tip(pose) - tip).max()) for m in models))
    return worst


def torques_apart(table: ArmTable, motions: FloatArray) -> float:
    """Return the greatest difference [N m] of torques, simulated and described, for (N, 3, 5) angles, rates, accelerations."""
    one, other = simulated(table), described(table)
    apart = [np.abs(one.torques(*motion) - other.torques(*motion)).max() for motion in motions]
    return float(np.max(apart))


def flat_moments(table: ArmTable) -> FloatArray:
    """Return what the simulated arm bears at the place of each servo (5,) [kgf cm], all links in one horizontal line.

    The arm stands upright, in one line from its base on, and gravity pulls it aside.
    """
    arm = simulated(table)
    arm.model.opt.gravity[:] = (-100.0 * KGF_CM, 0.0, 0.0)
    arm.tip(np.array(UPRIGHT))
    data = arm.data
    mujoco.mj_forward(arm.model, data)
    data.qacc[:] = 0.0
    mujoco.mj_rnePostConstraint(arm.model, data)
    moments = []
    for before, link in zip(table.links[:-1], table.links[1:], strict=True):
        # The wrench between a link and the one before it, which MuJoCo has about the whole arm's centre of mass.
        body = arm.model.body(link.name).id
        wrench = data.cfrc_int[body]
        centre = data.subtree_com[arm.model.body_rootid[body]]
        servo = data.geom(f"{before.name}_servo_1").xpos
        moments.append(wrench[:3] + np.cross(centre - servo, wrench[3:]))
    found: FloatArray = np.linalg.norm(moments, axis=1) / KGF_CM
    return found


def tipping(
    robot: P3AT, arm: HeldArm | None, direction: tuple[float, float], expected: float
) -> float:
    """Return the slope at which tyres uphill leave the ground, which is tilted slowly [rad].

    Args:
        robot: The robot, whose wheels are held.
        arm: The arm that it carries, if any.
        direction: Ahead and to the left (2,), of length 1: where it is downhill.
        expected: Slope near which to look [rad].
    """
    bench = DriveBench(robot, ROUGH, arm=arm)
    slope, still = 0.0, np.zeros((round(_PAUSE / TICK), 2))
    while slope < expected + _NEAR:
        slope += (_SLOW if slope > expected - _NEAR else _FAST) * _PAUSE
        down = GRAVITY * math.sin(slope)
        bench.model.opt.gravity[:] = (
            *(down * way for way in direction),
            -GRAVITY * math.cos(slope),
        )
        if bench.run(still).tyres_down[-1].sum() <= 2:
            return slope
    return math.nan
