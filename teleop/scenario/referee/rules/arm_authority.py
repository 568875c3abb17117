"""Rules of an arm's authority: who moves it, what stops it, and what the vehicle may do meanwhile.

What clients asked for is read from the robot's inbox, and where the arm is commanded to from its state.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.types import SECOND
from teleop.robot.arm.arm_commands import GripperGoal, Hand, Move, Stream, Trajectory, WayOut
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.inbox import ArmWish
from teleop.robot.safety.control_state import ControlMode
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.arm_rule import ArmRule
from teleop.scenario.referee.rules.command_in_force import TICK, WATCHDOG
from teleop.scenario.referee.rules.rule import RunFacts

_STOPPING: Final = SECOND // 5
"""Longest time that the arm takes to stop [ns]: at its bounds 0.11 s, and a tick for the command."""
_OFF_STOW: Final = np.radians(5.0)
"""Distance of a joint from its stow pose from which the arm is off it [rad]."""
_TOLD: Final = 7 * SECOND // 10
"""Time after which operators know of a second arm that it is lost [ns]: half a second, and two messages."""
_SETTLED: Final = 5
"""Ticks after which the vehicle's limits must be in force."""
_EXACT: Final = 1e-6
"""Share by which rounding may pass a bound."""


class ArmHasASource(ArmRule):
    """The arm moves for who has the robot, and as long as they want it."""

    name = "arm-source"
    sentence = (
        "the arm moves only by what the client asks that has the robot: a command, at most 0.5 s old and not let go of, "
        "or a goal that has not ended; or to give way to a load; else it stops within 0.2 s"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._until = -SECOND
        self._kind: type[Stream] = Hand
        self._goals: dict[int, str] = {}

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """See ``ArmRule.look``."""
        begin, control = tick.stamp - TICK, tick.control
        for wish in self.streams(tick):
            if wish.engaged:
                self._until, self._kind = begin + WATCHDOG + _STOPPING, type(wish)
            elif type(wish) is self._kind:
                self._until = min(self._until, begin + _STOPPING)
        for message in tick.inbox:
            if isinstance(message, ArmWish):
                goal = message.wish
                if isinstance(goal, Trajectory | Move | WayOut | GripperGoal):
                    self._goals[goal.number] = message.client
        for result in arm.goals.unanswered:
            self._goals.pop(result.number, None)
        if control.controller in self._goals.values() or max(arm.load) >= 0.5:
            self._until = max(self._until, tick.stamp + _STOPPING)
        if tick.stamp > self._until and arm.wanted_rates.any():
            who = control.controller or "nobody"
            return f"the arm moves, and {who}, who has the robot, does not ask for it"
        return None


class ArmHeedsTheEStop(ArmRule):
    """The e-stop reaches the arm."""

    name = "arm-e-stop"
    sentence = "0.2 s after the e-stop is pressed the arm stands, until it is released"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._since: int | None = None

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """See ``ArmRule.look``."""
        if tick.control.control is not ControlMode.ESTOP or max(arm.load) >= 0.5:
            self._since = None
            return None
        self._since = tick.stamp if self._since is None else self._since
        if tick.stamp - self._since >= _STOPPING and arm.wanted_rates.any():
            return "the arm moves though the e-stop is pressed"
        return None


class ArmSlowsTheVehicle(ArmRule):
    """The vehicle drives slowly with its arm out, and turns slowly with something in it."""

    name = "arm-vehicle"
    sentence = (
        "with the arm off its stow pose the command in force is no faster than `world.arm_speed`; while something is "
        "held, it turns at 0.6 rad/s at most"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._off = self._holds = 0

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """See ``ArmRule.look``."""
        assert self.facts.arm is not None
        stow, twist = self.facts.arm.table.poses["stow"], tick.control.twist
        self._off = self._off + 1 if np.abs(arm.angles - stow).max() > _OFF_STOW else 0
        self._holds = self._holds + 1 if arm.held else 0
        limit, speed = self.facts.scenario.world.arm_speed, abs(float(twist.linear[0]))
        if limit and self._off > _SETTLED and speed > limit + _EXACT:
            return f"{speed:.2f} m/s are in force with the arm out, and {limit:g} m/s are allowed"
        turn = abs(float(twist.angular[2]))
        if self._holds > _SETTLED and turn > 0.6 + _EXACT:
            return f"{turn:.2f} rad/s are in force with {arm.held} in the gripper"
        return None


class ArmIsMirrored(ArmRule):
    """Operators see whether the second arm follows."""

    name = "arm-mirror"
    sentence = (
        "0.7 s after the board of a second arm is unplugged `/arm/mirror` says that it is lost, and 0.7 s after it is "
        "plugged in again no longer"
    )

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """See ``ArmRule.look``."""
        assert self.facts.arm is not None
        mirror = self.facts.arm.mirror
        if mirror is None:
            return None
        cut, lost = mirror.cut_since is not None, mirror.said == "lost"
        since = mirror.plugged_since if mirror.cut_since is None else mirror.cut_since
        if cut is lost or tick.stamp - since <= _TOLD:
            return None
        return f"the second arm is {'unplugged' if cut else 'connected'}, and said to be {mirror.said!r}"
