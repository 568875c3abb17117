"""Rules of how the robot moves: it stops in time and place, and obeys."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np

from localization.types import SECOND
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.command_in_force import TICK, in_force
from teleop.scenario.referee.rules.rule import Rule, RunFacts

_REST: Final = 0.03
"""Speed below which the robot counts as resting [m/s], and turn rate [rad/s]; it creeps a little on slopes."""
_MARGIN_TIME: Final = 0.5
"""Time that tyres and servos need beyond the ramp [s]."""
_MARGIN_WAY: Final = 0.12
"""Way that they need beyond the ramp [m]."""
_REACTION: Final = 0.6
"""Time after which the robot follows a steady command [s]."""
_STEEP: Final = 0.2
"""Tilt beyond which tyres may not hold, on grass at 17 degrees for one [rad]."""
_SPINNING: Final = 0.2
"""Time for which wheels may turn faster than the robot moves [s]."""


class ComesToRest(Rule):
    """Once nothing moves it, the robot stands."""

    name = "rest"
    sentence = "after its command has become zero the robot rests within the time and way of its braking ramp"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run at rest."""
        super().__init__(facts)
        self._since: int | None = None
        self._speed = self._way = 0.0
        self._place = np.zeros(2)
        # The wheels of a robot that has just been put down still spin, and the body does not move yet.
        self._speeds: deque[float] = deque(maxlen=round(_SPINNING * SECOND / TICK))

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        twist = tick.truth.twist
        place = tick.truth.map_from_base.position[:2]
        step = float(np.hypot(*(place - self._place)))
        self._place = place
        speed = float(np.hypot(twist.linear[0], twist.linear[1]))
        self._speeds.append(speed)
        if in_force(tick) != (0.0, 0.0) or tick.condition.touching or step > 0.1:
            # A robot that is pushed, or carried off, does not move by itself.
            self._since = None
            return None
        if self._since is None:
            self._since, self._speed, self._way = tick.stamp, max(self._speeds), 0.0
        self._way += step
        braking = self.facts.braking
        needed = self._speed / braking + _MARGIN_TIME
        elapsed = (tick.stamp - self._since) / SECOND
        if elapsed > needed and (speed > _REST or abs(twist.angular[2]) > 2.0 * _REST):
            return f"{elapsed:.2f} s after its command became zero it moves at {speed:.2f} m/s"
        if elapsed < 3.0 and self._way > self._speed**2 / (2.0 * braking) + _MARGIN_WAY:
            return f"it rolled {self._way:.2f} m from {self._speed:.2f} m/s after its command became zero"
        return None


class MovesAsTold(Rule):
    """A robot that is free to move follows the command in force."""

    name = "obeys"
    sentence = "the robot drives and turns as the command in force says, unless something holds it or the ground is steep"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run at rest."""
        super().__init__(facts)
        self._recent: deque[tuple[float, float]] = deque(maxlen=round(_REACTION * SECOND / TICK))
        self._wrong = 0

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        forward, turn = in_force(tick)
        self._recent.append((forward, turn))
        condition = tick.condition
        held = (
            bool(condition.touching)
            or condition.left_stalled
            or condition.right_stalled
            or condition.grounded
            or math.hypot(condition.roll, condition.pitch) > _STEEP
        )
        if held or len(self._recent) < (self._recent.maxlen or 0):
            self._wrong = 0
            return None
        speed, rate = float(tick.truth.twist.linear[0]), float(tick.truth.twist.angular[2])
        ahead = _steady([each[0] for each in self._recent], 0.1)
        turning = _steady([each[1] for each in self._recent], 0.2)
        opposed = speed * ahead < -0.02 or rate * turning < -0.1
        # Servos reach 0.5 m/s^2 for more than a second: only a robot that moves not at all is found idle.
        idle = ahead != 0.0 and abs(speed) < 0.02 and abs(rate) < 0.05
        self._wrong = self._wrong + 1 if opposed or idle else 0
        if self._wrong * TICK < SECOND // 2:
            return None
        return f"commanded {forward:.2f} m/s and {turn:.2f} rad/s, it moves at {speed:.2f} and {rate:.2f}"


def _steady(values: list[float], least: float) -> float:
    """Return the sign of values that all have the same one and are larger than ``least``; 0 if they are not so."""
    if min(values) > least:
        return 1.0
    return -1.0 if max(values) < -least else 0.0
