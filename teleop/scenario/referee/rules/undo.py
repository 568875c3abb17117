"""Rule of an undo: it goes back to the pose before the placement."""

from __future__ import annotations

import math
from typing import Final

from localization.pipeline.event_queue import PLACED_ANEW
from localization.types import Pose, Verdict
from teleop.robot.inbox import Undo
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.rule import Rule, RunFacts

_UNDONE: Final = 0.3
"""Distance from the expected place within which an undo has undone [m]."""


class UndoUndoes(Rule):
    """An undo puts the robot back to where it believed to be before."""

    name = "undo"
    sentence = "after an undo the pose is the one before the placement, moved on by dead reckoning, or none"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run without a placement."""
        super().__init__(facts)
        self._last: tuple[Pose | None, Pose] | None = None
        self._before: tuple[Pose | None, Pose] | None = None

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        estimate = tick.estimate
        now = estimate.map_from_base, estimate.odom_from_base
        undone = any(isinstance(message, Undo) for message in tick.inbox)
        broken = None
        if undone and self._before is not None:
            way = _apart(self._before, now)
            if _accepted(tick):
                pass  # the hint came after the undo, and moved the robot in the same tick
            elif way is not None and way > _UNDONE:
                broken = f"after an undo it is {way:.2f} m from where it was"
            elif self._before[0] is None and now[0] is not None:
                broken = "after an undo of its first pose it still has one"
            self._before = None
        elif self._last is not None and self._placed(tick, now):
            self._before = self._last
        self._last = now
        return broken

    def _placed(self, tick: TickRecord, now: tuple[Pose | None, Pose]) -> bool:
        """Return whether a hint or a search has set the pose with this tick."""
        assert self._last is not None
        way = _apart(self._last, now)
        # A search may find the robot close to where it believed to be: then only the reason shows it.
        found = any(PLACED_ANEW in reason for each in tick.estimates for reason in each.reasons)
        return found or _accepted(tick) or (way is not None and way > _UNDONE)


def _accepted(tick: TickRecord) -> bool:
    """Return whether a hint was accepted with this tick."""
    verdicts = (estimate.verdict for estimate in tick.estimates)
    return any(each is not None and each.verdict is Verdict.ACCEPTED for each in verdicts)


def _apart(before: tuple[Pose | None, Pose], after: tuple[Pose | None, Pose]) -> float | None:
    """Return how far a pose is from where dead reckoning leads from an earlier one [m]; None without both."""
    (pose, odometry), (found, reckoned) = before, after
    if pose is None or found is None:
        return None
    off = (pose @ odometry.inverse() @ reckoned).position - found.position
    return math.hypot(off[0], off[1])
