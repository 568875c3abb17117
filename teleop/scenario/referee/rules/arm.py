"""Rules of an arm: who moves it, how fast, how far, and into what. Without an arm they are kept.

What clients asked for is read from the robot's inbox, and where the arm is commanded to from its state.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.geometry import FloatArray, so3_log
from localization.types import SECOND
from teleop.robot.arm.arm_state import ArmMode, ArmState
from teleop.robot.arm.commands import (
    ArmTwist,
    GripperGoal,
    Hand,
    JointJog,
    Move,
    Stream,
    TipTarget,
    Trajectory,
    WayOut,
)
from teleop.robot.inbox import ArmWish
from teleop.robot.safety.control_state import ControlMode
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import Walker
from teleop.scenario.referee.rules.command_in_force import TICK, WATCHDOG
from teleop.scenario.referee.rules.rule import Rule, RunFacts

_STOPPING: Final = SECOND // 5
"""Longest time that the arm takes to stop [ns]: at its bounds 0.11 s, and a tick for the command."""
_STREAMS: Final = (Hand, ArmTwist, JointJog, TipTarget)
_EXACT: Final = 1e-6
"""Share by which rounding may pass a bound."""
_NEAR: Final = 0.001
"""Distance that commanded poses keep [m]: half of what the robot's control means to keep."""
_NEARER: Final = 2e-4
"""By so much nearer a pose is led into something [m]."""
_IN_A_ROW: Final = 3
"""Ticks in a row before it counts: what comes by itself may be met for one."""
_SLACK: Final = 0.06
"""Way of a tip that stops, and that its reach moves it [m]."""
_LENGTH: Final = 0.14
"""Way of the tip for a radian of the hand, where its wrist is kept in reach [m]."""
_JUMP: Final = 0.3
"""Way of a hand between two samples that no hand moves [m]."""
_OFF_STOW: Final = np.radians(5.0)
"""Distance of a joint from its stow pose from which the arm is off it [rad]."""
_TOLD: Final = 7 * SECOND // 10
"""Time after which operators know of a second arm that it is lost [ns]: half a second, and two messages."""
_SETTLED: Final = 5
"""Ticks after which the vehicle's limits must be in force."""


class ArmRule(Rule):
    """A rule that looks at the arm."""

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        arm = tick.drive.arm
        return None if arm is None or self.facts.arm is None else self.look(tick, arm)

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """Return how the rule is broken with this tick; None if it is not."""
        raise NotImplementedError

    @staticmethod
    def streams(tick: TickRecord) -> list[Stream]:
        """Return the commands of a tick of the one who has the robot."""
        return [
            m.wish
            for m in tick.inbox
            if isinstance(m, ArmWish)
            and m.client == tick.control.controller
            and isinstance(m.wish, _STREAMS)
        ]


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


class ArmKeepsItsBounds(ArmRule):
    """No commanded motion is faster or rougher than the arm's table allows."""

    name = "arm-bounds"
    sentence = "the arm is commanded no speed, acceleration and jerk beyond those of its table"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._rates: list[FloatArray] = []

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """See ``ArmRule.look``."""
        assert self.facts.arm is not None
        bounds, time = self.facts.arm.table.motion, 1e-9 * TICK
        self._rates = [*self._rates[-2:], arm.wanted_rates]
        found = [("speed", np.abs(arm.wanted_rates).max(), bounds.speed)]
        if len(self._rates) == 3:
            first, second, third = self._rates
            found.append(("acceleration", np.abs(third - second).max() / time, bounds.acceleration))
            jerk = np.abs(third - 2.0 * second + first).max() / time**2
            found.append(("jerk", jerk, bounds.jerk))
        for name, value, bound in found:
            if value > bound * (1.0 + _EXACT) + _EXACT:
                return f"a {name} of {value:.4g} is commanded, and {bound:g} is the bound"
        return None


class ArmFollowsTheHand(ArmRule):
    """The clutch is relative, and what is no motion of a hand moves nothing."""

    name = "arm-hand"
    sentence = (
        "since its clutch closed, or the hand was seen elsewhere at once, the tip has gone no further than the hand, but "
        "for 6 cm and what its turn explains; while the hand is not tracked it stays"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._anchor: Hand | None = None
        self._last: Hand | None = None
        self._from = np.zeros(3)
        self._allowed = 0.0
        self._jumped = False

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """See ``ArmRule.look``."""
        assert self.facts.arm is not None
        tip = self.facts.arm.kinematics.tip(arm.wanted)[:3, 3]
        for wish in self.streams(tick):
            self._observe(wish, tip)
        if arm.mode is not ArmMode.HAND:
            if arm.wanted_rates.any():  # something else moves it
                self._from = tip
            return None
        if self._anchor is None:
            return None
        way = float(np.linalg.norm(tip - self._from))
        if way > self._allowed + _SLACK:
            return f"the tip is led {100 * way:.0f} cm, and the hand has moved {100 * self._allowed:.0f} cm"
        return None

    def _observe(self, wish: Stream, tip: FloatArray) -> None:
        last, self._last = self._last, wish if isinstance(wish, Hand) else None
        if not isinstance(wish, Hand) or not wish.engaged:
            self._anchor, self._jumped = None, False
            return
        begins = self._anchor is None or last is None or last.scale != wish.scale
        lost = last is not None and last.tracked and not wish.tracked
        jumps = (
            last is not None
            and self._anchor is not None
            and float(np.linalg.norm(wish.pose.position - last.pose.position)) > _JUMP
        )
        if begins or lost or (jumps and not self._jumped):
            self._anchor, self._from, self._allowed = wish, tip, 0.0
        self._jumped = self._jumped or jumps
        if self._jumped or not wish.tracked:
            return
        assert self._anchor is not None
        way = np.linalg.norm(wish.pose.position - self._anchor.pose.position)
        turn = np.linalg.norm(so3_log(self._anchor.pose.rotation.T @ wish.pose.rotation))
        self._allowed = max(self._allowed, wish.scale * float(way) + _LENGTH * float(turn))


class ArmKeepsClear(ArmRule):
    """The control leads the arm into nothing."""

    name = "arm-clear"
    sentence = (
        "while the vehicle rests, and nobody walks by, the arm is not commanded within 1 mm of anything that it was not "
        "as near to before; that its servos are off by more is another matter"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._before: FloatArray | None = None
        self._ticks = 0
        scenario = facts.scenario
        self._lonely = not scenario.world.alive
        self._lonely &= not any(isinstance(fault, Walker) for fault in scenario.fault)

    def look(self, tick: TickRecord, arm: ArmState) -> str | None:
        """See ``ArmRule.look``."""
        assert self.facts.arm is not None
        before, self._before = self._before, arm.wanted
        rests = float(np.abs(tick.truth.twist.linear).max()) < 0.01
        if before is None or not (self._lonely and rests and arm.wanted_rates.any()):
            self._ticks = 0
            return None
        was, now = self.facts.arm.distances((before, arm.wanted), 0.01)
        self._ticks = self._ticks + 1 if now < min(_NEAR, was - _NEARER) else 0
        return f"the arm is led to {1e3 * now:.1f} mm" if self._ticks >= _IN_A_ROW else None


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
