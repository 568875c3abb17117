"""Rules of an arm's motion: how fast and how far it goes, and into what."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.geometry import FloatArray, so3_log
from teleop.robot.arm.arm_commands import Hand, Stream
from teleop.robot.arm.arm_state import ArmMode, ArmState
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import Walker
from teleop.scenario.referee.rules.arm_rule import ArmRule
from teleop.scenario.referee.rules.command_in_force import TICK
from teleop.scenario.referee.rules.rule import RunFacts

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
