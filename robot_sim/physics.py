"""MuJoCo physics of one tick, rolled out in one native call, with errors where it became unstable.

A tick is rolled out by MuJoCo, bit for bit equal to ``mj_step`` in a loop, and the state of every
step is kept. ``World.model`` is never written to: the physics owns a copy.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from localization.types import IntArray, Pose
from robot_sim.array_types import FloatArray
from robot_sim.errors import PhysicsError
from robot_sim.robot.mujoco_body import WHEELS
from robot_sim.robot_placement import place_robot
from robot_sim.worlds.world import TIMESTEP_NS

_STATE: Final = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
_INPUTS: Final = int(mujoco.mjtState.mjSTATE_USER)
"""Inputs of the physics: motor commands, applied forces, poses of mocap bodies."""
_RUNAWAY: Final = 1e3
"""Speed that no wheel or body of a real robot reaches [m/s, rad/s]; beyond it the physics is
unstable."""

_WARNING: Final = mujoco.mjtWarning
_BAD_NUMBERS: Final = {
    _WARNING.mjWARN_BADQPOS: "position",
    _WARNING.mjWARN_BADQVEL: "velocity",
    _WARNING.mjWARN_BADQACC: "acceleration",
}


@dataclass(frozen=True, slots=True, eq=False)
class TickMotion:
    """The robot's motion through one tick, step by step: views that are valid until the next tick."""

    stamps: IntArray
    """End of each step [ns], (S,)."""
    poses: FloatArray
    """``map_from_base`` at the end of each step, (S, 7): position [m] and quaternion wxyz."""
    positions: FloatArray
    """Positions of all joints at the end of each step, (S, nq), as ``MjData.qpos``."""
    angular_velocities: FloatArray
    """Angular velocity in ``base_link`` that acted in each step, (S, 3) [rad/s]."""
    sensors: FloatArray
    """Sensor data of the model, (S, K); forces are those at the start of the step."""


class Physics:
    """Owns the model, its state and the number of completed steps."""

    def __init__(self, model: mujoco.MjModel, start: Pose, *, steps_per_tick: int) -> None:
        """Place the robot at rest at ``start`` (``map_from_base``).

        Raises:
            PhysicsError: the model was compiled with another time step.
            WorldError: the robot would stand inside an obstacle.
        """
        if abs(model.opt.timestep * 1e9 - TIMESTEP_NS) > 1.0:
            raise PhysicsError(
                f"the model's time step is {model.opt.timestep} s; the simulation needs"
                f" {TIMESTEP_NS * 1e-9} s"
            )
        # A copy, because friction under the wheels is rewritten as the robot drives.
        self.model = copy.copy(model)
        # With sleeping enabled, bodies at rest and walls cost nothing. A body with motors, the robot,
        # never sleeps.
        self.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
        self.data = mujoco.MjData(self.model)
        place_robot(self.model, self.data, start)
        # A view of the counters; iterating over the warnings themselves takes half a tick's time.
        self._warnings = self.data.warning.number
        self._ticks = 0
        self._steps_per_tick = steps_per_tick
        self._ends: IntArray = TIMESTEP_NS * np.arange(1, steps_per_tick + 1, dtype=np.int64)
        self._rollout = Rollout(nthread=0)
        self._models, self._datas = [self.model], [self.data]
        size = mujoco.mj_stateSize
        self._before = np.empty((1, size(self.model, _STATE)))
        self._warmstart = np.empty((1, self.model.nv))
        self._input = np.empty(size(self.model, _INPUTS))
        self._inputs = np.empty((1, steps_per_tick, len(self._input)))
        self._states = np.empty((1, steps_per_tick, self._before.shape[1]))
        self._sensors = np.empty((1, steps_per_tick, self.model.nsensordata))
        # The motors' commands come first in the inputs; those of the wheels follow each other.
        motors = [int(self.model.actuator(wheel).id) for wheel in WHEELS]
        self._motors = slice(motors[0], motors[-1] + 1)
        self._last_warmstart = self.data.qacc_warmstart
        # The state is time, positions, velocities, activations; the robot's joint is found by name.
        base = self.model.joint("base_link")
        q, v = 1 + int(base.qposadr[0]), 1 + self.model.nq + int(base.dofadr[0])
        self._pose_columns = slice(q, q + 7)
        states = self._states[0]
        self._views = (
            states[:, self._pose_columns],
            states[:, 1 : 1 + self.model.nq],
            states[:, v + 3 : v + 6],
            self._sensors[0],
        )
        self._velocity_columns = slice(1 + self.model.nq, 1 + self.model.nq + self.model.nv)
        self._velocities, self._last_state = states[:, self._velocity_columns], states[-1]

    @property
    def stamp(self) -> int:
        """Time since the start [ns]: an integer number of steps, so that it does not drift."""
        return self._ticks * self._steps_per_tick * TIMESTEP_NS

    @property
    def step_stamps(self) -> IntArray:
        """End of each step of the coming tick [ns], (S,)."""
        return self.stamp + self._ends

    def advance(self, controls: FloatArray) -> TickMotion:
        """Run one tick.

        Other inputs in ``data`` (``mocap_pos``, ``xfrc_applied`` ...) are held constant through the tick.

        Args:
            controls: (S, 4) commands of the wheels' motors in each step [rad/s]; other motors keep
                the command in ``data``.

        Raises:
            PhysicsError: the physics became unstable; the message names what, when and where.
        """
        model, data = self.model, self.data
        mujoco.mj_getState(model, data, self._before[0], _STATE)
        mujoco.mj_getState(model, data, self._input, _INPUTS)
        inputs = self._inputs[0]
        inputs[:] = self._input
        inputs[:, self._motors] = controls
        self._warmstart[0] = self._last_warmstart
        self._rollout.rollout(
            self._models,
            self._datas,
            self._before,
            self._inputs,
            control_spec=_INPUTS,
            skip_checks=True,
            nstep=self._steps_per_tick,
            initial_warmstart=self._warmstart,
            state=self._states,
            sensordata=self._sensors,
        )
        self._check()
        stamps = self.step_stamps
        self._ticks += 1
        return TickMotion(stamps, *self._views)

    def _check(self) -> None:
        """Raise if MuJoCo issued a warning, or if a value is not finite or a speed is beyond ``_RUNAWAY``.

        After a warning a rollout repeats the last state, which must not be taken for a motion.
        """
        warned = bool(np.count_nonzero(self._warnings))
        velocities = self._velocities
        # A bound of the greatest speed. Written so that NaN fails as well; a sum is finite only if all
        # its terms are.
        square = float(np.vdot(velocities, velocities))
        if square < _RUNAWAY**2 and not warned and math.isfinite(np.add.reduce(self._last_state)):
            return
        tame = np.abs(velocities) < _RUNAWAY
        if not warned and tame.all() and np.isfinite(self._last_state).all():
            return
        if warned:
            kind = int(np.flatnonzero(self._warnings)[0])
            reason = self._warning(kind, int(self.data.warning[kind].lastinfo))
        elif not tame.all():
            step, dof = (int(i) for i in np.argwhere(~tame)[0])
            value = velocities[step, dof]
            reason = f"{self._joint_of_dof(dof)} moves at {value:.3g} m/s or rad/s"
        else:
            reason = "the state is not finite"
        raise PhysicsError(f"physics became unstable at {self._failed_at()}: {reason}")

    def _failed_at(self) -> str:
        """Return the time of the failure, and the last valid position of the robot before it."""
        times = np.concatenate([self._before[:, 0], self._states[0, :, 0]])
        rows = np.concatenate([self._before, self._states[0]])
        speeds = np.abs(rows[:, self._velocity_columns]).max(axis=1, initial=0.0)
        sound = np.isfinite(rows).all(axis=1) & (speeds < _RUNAWAY)
        # After a failed step its state and its time repeat.
        sound[1:] &= np.diff(times) > 0.0
        good = int(np.argmin(sound)) if not sound.all() else len(sound) - 1
        stamp = self.stamp + good * TIMESTEP_NS
        if good == 0:
            return f"{stamp * 1e-9:.3f} s"
        x, y, z = rows[good - 1, self._pose_columns][:3]
        return f"{stamp * 1e-9:.3f} s with the robot at x {x:.2f}, y {y:.2f}, z {z:.2f}"

    def _warning(self, kind: int, info: int) -> str:
        model = self.model
        if kind in _BAD_NUMBERS:
            joint = self._joint_of_q(info) if kind == _WARNING.mjWARN_BADQPOS else None
            joint = joint or self._joint_of_dof(info)
            return f"the {_BAD_NUMBERS[_WARNING(kind)]} of {joint} is not finite or too large"
        if kind == _WARNING.mjWARN_BADCTRL:
            return f"the command of motor {model.actuator(info).name!r} is not finite"
        if kind == _WARNING.mjWARN_CONTACTFULL:
            return f"no memory for more than {info} contacts (raise <size memory> in the model)"
        if kind == _WARNING.mjWARN_CNSTRFULL:
            return f"no memory for more than {info} constraints (raise <size memory> in the model)"
        return f"MuJoCo warns of {_WARNING(kind).name.removeprefix('mjWARN_').lower()}"

    def _joint_of_q(self, index: int) -> str:
        return self._joint(int(np.searchsorted(self.model.jnt_qposadr, index, "right")) - 1)

    def _joint_of_dof(self, index: int) -> str:
        return self._joint(int(self.model.dof_jntid[index]))

    def _joint(self, number: int) -> str:
        joint = self.model.joint(number)
        body = self.model.body(int(self.model.jnt_bodyid[number])).name
        if not joint.name or joint.name == body:
            return f"body {body!r}"
        return f"joint {joint.name!r} of body {body!r}"


def _keep_quiet(message: str) -> None:
    """Ignore MuJoCo's warning text: ``data.warning`` counts warnings, and ``Physics`` raises errors."""


# MuJoCo would otherwise write MUJOCO_LOG.TXT into the current working directory.
mujoco.set_mju_user_warning(_keep_quiet)
