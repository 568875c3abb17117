"""Rule of the robot's answers: every hint gets one."""

from __future__ import annotations

from typing import Final

from localization.types import SECOND
from teleop.robot.inbox import PoseHint
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import ScannerDead
from teleop.scenario.referee.rules.rule import Rule, RunFacts

_PATIENCE: Final = 5 * SECOND
"""Time within which a hint is answered [ns]: one looks for it in at most a few sweeps."""
_PERIOD: Final = SECOND
"""Hints of a client that follow each other faster are refused (docs/teleoperation.md) [ns]."""


class HintsAreAnswered(Rule):
    """An operator who gives a hint gets an answer."""

    name = "hint-answered"
    sentence = (
        "every hint that arrives is answered by a verdict within 5 s, or replaced by another hint"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run without hints."""
        super().__init__(facts)
        self._read = 0
        self._waiting: int | None = None
        self._heard: dict[int, int] = {}
        # Without a scanner there is nothing to compare a hint with.
        self._blind = any(isinstance(fault, ScannerDead) for fault in facts.scenario.fault)

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        if self._blind:
            return None
        said = self.facts.wire.said
        for each in said[self._read :]:
            if each.what != "/initialpose":
                continue
            last = self._heard.get(each.client)
            if last is None or each.arrived - last >= _PERIOD:
                self._heard[each.client] = self._waiting = each.arrived
        self._read = len(said)
        if any(isinstance(message, PoseHint) for message in tick.inbox):
            self._waiting = tick.stamp
        if any(estimate.verdict is not None for estimate in tick.estimates):
            self._waiting = None
        if self._waiting is not None and tick.stamp - self._waiting > _PATIENCE:
            since, self._waiting = (tick.stamp - self._waiting) / SECOND, None
            return f"a hint has had no answer for {since:.1f} s"
        return None
