"""Drive test bench: one robot on an infinite floor with directly commanded wheels, without ramps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.parts import TOOL
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.drive.tyres import GRAVITY, Tyres
from robot_sim.robot.contact_sensors import ContactSensorColumns
from robot_sim.robot.drivable_surfaces import mark_drivable
from robot_sim.robot.mujoco_body import (
    SERVO_DAMPING,
    SERVO_STIFFNESS,
    WHEELS,
    add_robot,
    set_physics,
)
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.scene_objects.floor_surfaces import Patch, Surface
from robot_sim.simulation import STEPS_PER_TICK
from robot_sim.worlds.world import TIMESTEP_NS

TICK: Final = 0.02
"""Interval at which tyres and commands are updated, as in the simulation [s]."""
STEP: Final = TIMESTEP_NS * 1e-9
"""Time step of the physics [s]."""
BENCH: Final = Surface("bench", 0.7, 0.7, 0.0, "what the targets assume; rolls without resistance")
"""Floor that the targets assume, without rolling resistance."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Motion of the robot in S samples; the first sample is the start."""

    times: FloatArray
    """Times (S,) [s]."""
    positions: FloatArray
    """Positions of ``base_link`` in ``map`` (S, 3) [m]."""
    yaws: FloatArray
    """Unwrapped yaws (S,) [rad]."""
    twists: FloatArray
    """Forward and left velocity [m/s] and yaw rate [rad/s] in ``base_link``, (S, 3)."""
    wheel_angles: FloatArray
    """Wheel angles (S, 4) in the order of ``WHEELS`` [rad]."""
    wheel_rates: FloatArray
    """Wheel rates (S, 4) [rad/s]."""
    torques: FloatArray
    """Motor torques (S, 4) [N m]."""
    accelerations: FloatArray
    """Specific force at the inertial unit (S, 3) [m/s^2]."""
    tyres_down: BoolArray
    """Which tyres touch the ground, (S, 4)."""

    def after(self, seconds: float) -> Run:
        """Return the samples from a time on."""
        keep = self.times >= seconds - 1e-9
        parts = (getattr(self, name)[keep] for name in self.__dataclass_fields__)
        return Run(*parts)


@dataclass(frozen=True, slots=True)
class Inertia:
    """Mass and inertias of the robot in the MuJoCo model."""

    mass: float
    """Mass of the whole robot [kg]."""
    yaw: float
    """Inertia of the whole robot about the vertical [kg m^2]."""
    wheel: float
    """Inertia of one wheel and its rotor about the axle [kg m^2]."""


@dataclass(frozen=True, slots=True)
class HeldArm:
    """An arm that the robot carries, and that keeps its pose."""

    table: ArmTable
    """The arm."""
    mount: str
    """Where it is mounted."""
    angles: Sequence[float]
    """Angles of its joints [rad]."""
    payload: float = 0.0
    """Mass of a ball at its tip [kg]."""


class DriveBench:
    """A floor with a robot on it, at rest."""

    def __init__(
        self,
        robot: SkidSteer,
        surface: Surface = BENCH,
        *,
        pitch: float = 0.0,
        roll: float = 0.0,
        patches: Sequence[Patch] = (),
        compliant: bool = True,
        arm: HeldArm | None = None,
    ) -> None:
        """Build the bench.

        Args:
            robot: The robot on the floor.
            surface: Surface of the floor.
            pitch: Angle of the slope that the robot faces up [rad]; gravity is tilted, not the floor.
            roll: Angle of the slope that falls to the robot's left [rad].
            patches: Areas of other surfaces on the floor.
            compliant: Whether the tyres bend sideways.
            arm: An arm that the robot carries, if any.
        """
        spec = mujoco.MjSpec()
        set_physics(spec, timestep=STEP, arm=arm is not None)
        spec.option.gravity = (
            -GRAVITY * math.sin(pitch),
            GRAVITY * math.cos(pitch) * math.sin(roll),
            -GRAVITY * math.cos(pitch) * math.cos(roll),
        )
        floor = spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(100.0, 100.0, 0.1)
        )
        mark_drivable(floor, surface.mu_long, surface.mu_lat, surface.rolling_resistance)
        if arm is None:
            add_robot(spec, surfaces=("floor",), robot=robot)
        else:
            add_robot(spec, ("floor",), robot, arm.table, arm.mount)
            _load(spec, arm.payload)
        self.robot = robot
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        if arm is not None:
            self._hold(arm)
        self._tyres = Tyres(self.model, robot, patches, compliant=compliant)
        self._down = ContactSensorColumns.of(self.model, "base_link", WHEELS).tyres
        mujoco.mj_forward(self.model, self.data)

    @property
    def inertia(self) -> Inertia:
        """Mass and inertias of the robot as it stands."""
        full = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, full)
        return Inertia(float(full[0, 0]), float(full[5, 5]), float(full[6, 6]))

    def run(self, commands: FloatArray, *, fine: bool = False) -> Run:
        """Command the left and the right wheels with (T, 2) rates [rad/s], one row per tick.

        Args:
            commands: Commands of the motors; only the motors' own limits apply.
            fine: Whether to sample every physics step instead of every tick.
        """
        model, data = self.model, self.data
        steps = 1 if fine else STEPS_PER_TICK
        rows = 1 + len(commands) * (STEPS_PER_TICK // steps)
        state = np.empty((rows, model.nq + model.nv + model.na + model.nsensordata))
        times = np.empty(rows)
        times[0], state[0] = data.time, self._state()
        row = 1
        for left, right in commands.tolist():
            data.ctrl[: len(WHEELS)] = (left, right, left, right)
            self._tyres.grip(data)
            for _ in range(STEPS_PER_TICK // steps):
                mujoco.mj_step(model, data, nstep=steps)
                times[row], state[row] = data.time, self._state()
                row += 1
        return self._run(times, state)

    def _hold(self, arm: HeldArm) -> None:
        """Put the arm into its pose, and its servos' set-points with it, which then stay."""
        for joint, angle in zip(arm.table.joints, arm.angles, strict=True):
            self.data.joint(joint.name).qpos = angle
            self.data.act[self.model.actuator_actadr[self.model.actuator(joint.name).id]] = angle

    def _state(self) -> FloatArray:
        data = self.data
        state: FloatArray = np.concatenate([data.qpos, data.qvel, data.act, data.sensordata])
        return state

    def _run(self, times: FloatArray, state: FloatArray) -> Run:
        model = self.model
        q, v, act, sensors = np.split(state, np.cumsum([model.nq, model.nv, model.na]), axis=1)
        yaws, planar = _planar(q[:, 3:7], v[:, :3])
        limit = self.robot.wheel_torque
        # The joints of an arm, if there is one, follow those of the wheels.
        act, angles, rates = (
            part[:, first : first + len(WHEELS)] for part, first in ((act, 0), (q, 7), (v, 6))
        )
        servo = SERVO_STIFFNESS * (act - angles) - SERVO_DAMPING * rates
        if not self.robot.imperfections.integral_control:
            servo = SERVO_DAMPING * (act - rates)
        return Run(
            times=times,
            positions=q[:, :3],
            yaws=yaws,
            twists=np.column_stack([planar, v[:, 5]]),
            wheel_angles=angles,
            wheel_rates=rates,
            torques=np.clip(servo, -limit, limit),
            accelerations=sensors[:, :3],
            tyres_down=sensors[:, self._down] > 0.0,
        )


def _load(spec: mujoco.MjSpec, payload: float) -> None:
    """Put a ball of a mass [kg] at an arm's tip, which collides with nothing."""
    if payload > 0.0:
        ball = mujoco.mjtGeom.mjGEOM_SPHERE
        size = (0.01, 0.0, 0.0)
        spec.body(TOOL).add_geom(type=ball, size=size, mass=payload, contype=0, conaffinity=0)


def _planar(quaternions: FloatArray, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return yaws (S,) and forward and left velocities (S, 2) in ``base_link``."""
    w, x, y, z = quaternions.T
    forward = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)
    left = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1)
    planar = np.stack([(forward * velocities).sum(axis=1), (left * velocities).sum(axis=1)], axis=1)
    return np.unwrap(np.arctan2(forward[:, 1], forward[:, 0])), planar


def ramped(left: float, right: float, seconds: float, *, ramp: float = 0.5) -> FloatArray:
    """Return (T, 2) commands that rise to these rates [rad/s] within ``ramp`` [s] and stay."""
    ticks = np.arange(1, round(seconds / TICK) + 1) * TICK
    share = np.minimum(1.0, ticks / ramp) if ramp > 0.0 else np.ones(len(ticks))
    commands: FloatArray = share[:, None] * np.array([left, right])
    return commands


def chi(robot: SkidSteer, run: Run) -> float:
    """Return the yaw of a differential drive with these wheel angles, over the actual yaw."""
    turned = run.wheel_angles[-1] - run.wheel_angles[0]
    left = robot.true_rolling_radius("left") * 0.5 * (turned[0] + turned[2])
    right = robot.true_rolling_radius("right") * 0.5 * (turned[1] + turned[3])
    return float((right - left) / robot.track / (run.yaws[-1] - run.yaws[0]))
