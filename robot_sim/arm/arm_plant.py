"""The arm in the physics: wanted angles through its servos to its motors, and what it measures after each tick."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import mujoco
import numpy as np

from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.arm_touch import CONTACTS, NOTHING, Touches, TouchFinder, replay
from robot_sim.arm.body import JAW_STIFFNESS
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.parts import JAWS
from robot_sim.arm.servo import Resolution, ServoBank
from robot_sim.array_types import FloatArray

_MOMENT: Final = 3
"""Ticks for which a jolt may lift a pad off what is held."""
_STILL: Final = 1e-9
"""Rate below which a set-point stands [rad/s, m/s]."""
_NEWTON: Final = int(mujoco.mjtSolver.mjSOL_NEWTON)
_CONJUGATE_GRADIENTS: Final = int(mujoco.mjtSolver.mjSOL_CG)


@dataclass(frozen=True, slots=True, eq=False)
class ArmReading:
    """What is known of the arm after a tick."""

    stamp: int
    """End of the tick [ns]."""
    angles: FloatArray
    """Angles of the joints (5,) [rad]."""
    rates: FloatArray
    """Their rates (5,) [rad/s]."""
    torques: FloatArray
    """Torques of the servos (5,) [N m]."""
    opening: float
    """Distance between the pads [m]."""
    grip_force: float
    """Force of the jaws together on what is between them [N]."""
    touching: tuple[str, ...]
    """Sorted names of what any part of the arm touches."""
    held: str
    """Name of what both pads touch, or have touched until a moment ago; empty without anything."""
    hit: bool
    """Whether a part touches anything but the gripper something that can be picked up."""
    pulses: FloatArray
    """Widths of the servos' pulses in this tick (5,) [us]."""


class ArmPlant:
    """The arm inside of a simulation: owns its servos, and writes its motors' commands."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        table: ArmTable,
        *,
        tick: int,
        resolution: Resolution = "microsecond",
    ) -> None:
        """Take the arm of a physics that has just begun, folded.

        Args:
            model: Model of the physics, whose limit of the gripper's force is written.
            data: Its state.
            table: The arm.
            tick: Time between two steps [ns], a frame of the servos' pulses.
            resolution: What their pulses are rounded to.
        """
        self.table = table
        self._model, self._data, self._tick = model, data, 1e-9 * tick
        names = [joint.name for joint in table.joints]
        joints, motors = [model.joint(n) for n in names], [model.actuator(n).id for n in names]
        q, v = int(joints[0].qposadr[0]), int(joints[0].dofadr[0])
        self._angles, self._rates = data.qpos[q : q + len(names)], data.qvel[v : v + len(names)]
        span = slice(motors[0], motors[-1] + 1)
        self._torques = data.actuator_force[span]
        jaw = int(model.jnt_qposadr[model.joint(JAWS[0]).id])
        self._jaws = data.qpos[jaw : jaw + len(JAWS)]
        # The gripper's motor comes behind those of the joints.
        self._gripper = int(model.actuator(table.gripper.joint).id)
        act = int(model.actuator_actadr[motors[0]])
        self._ctrl = data.ctrl[motors[0] : self._gripper + 1]
        self._set_points = data.act[act : act + len(names) + 1]
        self._counter = int(model.sensor(CONTACTS).adr[0])
        self._finder = TouchFinder(model)
        self._scratch = mujoco.MjData(model)
        self._before = data.qpos.copy()
        self._set_points[:-1] = self._angles
        self._solve_for(touching=False)
        self._held, self._missed = "", 0
        self._request: tuple[bytes, float, float | None] | None = None
        self._servos = ServoBank(table, resolution, self._angles)
        self.command(self._angles, 0.0)
        self.reading = self._read(0, NOTHING)
        """What is known after the last tick."""

    def command(self, angles: FloatArray, opening: float, force: float | None = None) -> None:
        """Set what the servos get in the coming ticks.

        Args:
            angles: Wanted angles (5,) [rad].
            opening: Wanted distance between the pads [m].
            force: Greatest force of the jaws together [N]; the gripper's own if not given.
        """
        request = (angles.tobytes(), opening, force)
        if request == self._request:
            return
        self._request, self._moves = request, True
        gripper = self.table.gripper
        self._pulses = self._servos.command(angles)
        self._opening = min(max(opening, 0.0), gripper.opening)
        force = gripper.force if force is None else min(max(force, 0.0), gripper.force)
        self._grip = 0.5 * force
        self._model.actuator_forcerange[self._gripper] = (-self._grip, self._grip)

    def show(self, clearance: Clearance, held: str) -> None:
        """Let something look around, while the gripper holds the body ``held``."""
        clearance.follow(self._model, self._data, held)

    def drive(self) -> None:
        """Write the motors' commands for the coming tick, at whose end the set-points are where the gears aim."""
        if not self._moves:
            return
        rates = self._ctrl
        rates[:-1] = (self._servos.turn(self._tick) - self._set_points[:-1]) / self._tick
        set_point = float(self._set_points[-1])
        rates[-1] = (self._jaws_goal(set_point) - set_point) / self._tick
        # An arm at rest costs nothing more, until it gets another command.
        self._moves = bool(np.abs(rates).max() > _STILL)

    def _jaws_goal(self, set_point: float) -> float:
        """Return where the set-point of the opening is to be after the coming tick [m]."""
        step = self._tick * self.table.gripper.speed
        goal = min(max(self._opening, set_point - step), set_point + step)
        # Jaws that are blocked press with their force, and open at once.
        opening, reach = float(self._jaws[0] + self._jaws[1]), self._grip / JAW_STIFFNESS
        return min(max(goal, opening - reach), opening + reach)

    def read(self, stamp: int, sensors: FloatArray, positions: FloatArray) -> None:
        """Take the tick that has just been rolled out into the data.

        Args:
            stamp: End of the tick [ns].
            sensors: Sensor data of its steps (S, K).
            positions: Positions of all joints at the end of each step (S, nq).
        """
        counts = sensors[:, self._counter].tolist()
        touches = self._finder.find(self._data) if counts[-1] else NOTHING
        if any(counts):
            touches = self._with_passed(touches, counts, positions)
        if bool(counts[-1]) != self._touching:
            self._solve_for(touching=not self._touching)
        self._before = positions[-1].copy()
        self.reading = self._read(stamp, self._steadied(touches))

    def _steadied(self, touches: Touches) -> Touches:
        """Return what is touched, with what was held until a moment ago as held still if a pad touches it."""
        if touches.held:
            self._held, self._missed = touches.held, 0
        elif self._held:
            self._missed += 1
            if self._missed > _MOMENT or self._held not in touches.names:
                self._held = ""
        return touches if touches.held == self._held else replace(touches, held=self._held)

    def _with_passed(
        self, touches: Touches, counts: Sequence[float], positions: FloatArray
    ) -> Touches:
        """Return what is touched, and contacts of the tick that are over by now; those of a step are those at its start."""
        scratch, seen = self._scratch, {0.0, counts[-1]}
        for step, count in enumerate(counts):
            if count in seen:
                continue
            seen.add(count)
            before = positions[step - 1] if step else self._before
            replay(self._model, scratch, self._data, before)
            touches = touches.with_passed(self._finder.find(scratch))
        return touches

    def _solve_for(self, *, touching: bool) -> None:
        """Let the coming tick be solved by Newton's method if the arm touches something, else as without an arm.

        By conjugate gradients, which are faster for wheels alone, 10 of 26 boxes crept out of the jaws.
        """
        self._touching = touching
        self._model.opt.solver = _NEWTON if touching else _CONJUGATE_GRADIENTS

    def _read(self, stamp: int, touches: Touches) -> ArmReading:
        return ArmReading(
            stamp=stamp,
            angles=self._angles.copy(),
            rates=self._rates.copy(),
            torques=self._torques.copy(),
            opening=float(self._jaws[0] + self._jaws[1]),
            grip_force=touches.force,
            touching=touches.names,
            held=touches.held,
            hit=touches.hit,
            pulses=self._pulses,
        )
