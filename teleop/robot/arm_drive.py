"""What drives the arm: the robot's safety on one side, its control and the simulated arm on the other."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from robot_sim.arm.arm_plant import ArmPlant
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.kinematics import Kinematics
from robot_sim.simulation import Simulation
from teleop.robot.arm.arm_commands import (
    Alive,
    Answered,
    ArmTwist,
    Cancel,
    Confirm,
    Halt,
    Hand,
    JointJog,
    TipTarget,
)
from teleop.robot.arm.arm_control import ArmControl
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.arm.arm_settings import ArmSettings, Permit
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.arm.goal_results import GoalOutcome
from teleop.robot.guard.outline import Box
from teleop.robot.inbox import ArmWish
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.speed_limits import SpeedLimits

_THICK: Final = 0.05
"""What an arm is thick around the line through its joints [m]: half the width of its widest servo and bracket, 0.08 m."""
_TURNED: Final = 0.01
"""Turn of a joint that moves an outline by less than a centimetre [rad]."""


class ArmDrive:
    """Passes on to the arm what the safety admits, and to the safety what the arm asks of the vehicle."""

    def __init__(self, simulation: Simulation, safety: Safety, settings: ArmSettings) -> None:
        """Take the arm of a simulation that has one."""
        fit, plant = ArmFit.of(simulation.world), simulation.arm
        assert fit is not None
        assert plant is not None
        self._plant: ArmPlant = plant
        self._safety, self._clearance = safety, Clearance(fit.table, fit.mount)
        plant.show(self._clearance, "")
        self._kinematics, self._base = Kinematics(fit.table), fit.base_from_arm_base
        self._angles = plant.reading.angles
        self.outline = self._measured_outline()
        """What of the robot's surroundings it takes up."""
        self._control = ArmControl(fit, self._clearance, plant.reading, settings)

    def obey(self, message: ArmWish, now: int) -> str | None:
        """Apply a message; return why it is refused, or None."""
        client, wish, control, safety = message.client, message.wish, self._control, self._safety
        why = None
        match wish:
            case Hand() | ArmTwist() | JointJog() | TipTarget():
                why = safety.request_arm(message, wish, now)
                if why is None and safety.controller == client:
                    control.follow(client, wish, safety.config.stale.speed_share(message.age))
            case Confirm():
                if safety.controller == client:
                    control.confirm(client, wish.held, _arrival(message, now))
            case Halt():
                if safety.controller == client:
                    safety.arm.stop("paused by its client")
                    control.halt("paused by its client")
            case Cancel():
                control.desk.cancel(client, wish.number)
            case Answered():
                control.desk.answered(wish.number)
            case Alive():
                safety.arm_alive(client, message.arrival, now)
                control.desk.alive(client, _arrival(message, now), message.age)
            case _:
                refusal = safety.admit_arm_goal(client, message.age, now)
                if refusal is None:
                    control.begin(client, wish, now, message.age)
                else:
                    control.desk.refuse(client, wish, refusal)
        # What others are refused is nothing that the driver's hand should feel.
        if why is not None and safety.controller in ("", client):
            control.note_refusal()
        return why

    def stop_for(self, reason: str) -> None:
        """Stop whatever moves the arm; everybody must show that they know before they move it again."""
        if self._control.busy:
            self._safety.arm.stop(reason)
            self._control.halt(reason, GoalOutcome.BLOCKED)

    def disconnected(self, client: str) -> None:
        """Note that a client has left."""
        self._control.desk.disconnected(client)

    def server_lost(self) -> None:
        """Note that what connects the clients has stopped."""
        self._control.server_lost()

    def tick(self, now: int) -> None:
        """Command the arm for the coming tick."""
        safety, control = self._safety, self._control
        if control.restless:
            self._plant.show(self._clearance, control.held)
        deadman, estop = safety.arm, safety.estop
        command = control.tick(
            now,
            Permit(
                safety.controller,
                deadman.engaged,
                deadman.stopped,
                deadman.reason,
                "" if estop is None else estop.client,
            ),
        )
        if control.stopped:
            deadman.stop(control.stopped)
        self._plant.command(command.angles, command.opening, command.force)

    def measure(self) -> ArmState:
        """Return the arm's state after the tick, and limit the speed of the vehicle for it."""
        reading = self._plant.reading
        state = self._control.measure(reading)
        if np.abs(reading.angles - self._angles).max() > _TURNED:
            self._angles = reading.angles
            self.outline = self._measured_outline()
        narrow = math.isfinite(state.speed_limit) or math.isfinite(state.turn_limit)
        self._safety.narrow = SpeedLimits(state.speed_limit, state.turn_limit) if narrow else None
        return state

    def _measured_outline(self) -> Box:
        """Return a box around the arm, as seen from above, in ``base_link``; outwards to whole centimetres."""
        joints = self._kinematics.frames(self._angles)[:, :3, 3]
        xy = (joints @ self._base.rotation.T + self._base.position)[:, :2]
        low = np.floor(100.0 * (xy.min(axis=0) - _THICK)) / 100.0
        high = np.ceil(100.0 * (xy.max(axis=0) + _THICK)) / 100.0
        return Box(float(low[0]), float(high[0]), float(low[1]), float(high[1]))


def _arrival(message: ArmWish, now: int) -> int:
    return now if message.arrival is None else min(message.arrival, now)
