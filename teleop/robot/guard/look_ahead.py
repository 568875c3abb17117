"""How long the motion that is asked for can go on: looked at as often as it is published."""

from __future__ import annotations

from typing import Final

from localization.types import Twist
from teleop.robot.guard.guard import Guard
from teleop.robot.guard.verdict import FARTHEST

_EVERY: Final = 5
"""Ticks between two looks along the arc of a command that stays: those between two of ``/teleop/state``."""
_TURNS: Final = 0.1
"""Forward speed below which a turning robot counts as turning on the spot, as a share of its rim's speed: chosen."""


class LookAhead:
    """Owns the last answer of a guard."""

    def __init__(self, guard: Guard) -> None:
        """Look with a guard's eyes."""
        self._guard = guard
        self._asked, self._ticks, self._time = (0.0, 0.0), 0, FARTHEST

    def time(self, twist: Twist) -> float:
        """Return for how long a command goes on along its arc [s]; at most ``FARTHEST``."""
        asked = float(twist.linear[0]), float(twist.angular[2])
        self._ticks += 1
        if asked != self._asked or self._ticks >= _EVERY:
            self._asked, self._ticks = asked, 0
            self._time = self._look(*asked) if any(asked) else FARTHEST
        return self._time

    def _look(self, forward: float, turn: float) -> float:
        in_place = abs(forward) < _TURNS * self._guard.outline.radius * abs(turn)
        command = (0.0 if in_place else forward, turn)
        speed = abs(turn) if in_place else abs(forward)
        return self._guard.room(command, FARTHEST * speed).length / speed
