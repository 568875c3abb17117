"""The referee: sees each tick with its ground truth, notes what happens, and judges at the end.

It stands beside the robot and listens to nobody: what a client publishes cannot change its mind.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from localization.types import SECOND, Health
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.inbox import DriveCommand, PoseHint
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.limits import Limits
from teleop.scenario.files.scenario import Mission
from teleop.scenario.referee.arm_log import ArmLog
from teleop.scenario.referee.judging import figures_of, judge
from teleop.scenario.referee.outcome import Event, EventKind, LimitCheck, TimeLines
from teleop.scenario.referee.run_log import RunLog
from teleop.scenario.referee.silences import Silences

_NOTHING: Final = Mission()
_CLEAR: Final = SECOND
"""Time without contact after which an obstacle is touched anew [ns]: a hull that scrapes along a wall, or is pressed
against one, loses contact for ticks on end."""


@dataclass(frozen=True, slots=True)
class GoalPoint:
    """A goal, with its place in ``map``."""

    name: str
    """Its name or coordinates, for people."""
    x: float
    """x in ``map`` [m]."""
    y: float
    """y in ``map`` [m]."""
    within: float
    """Distance at which it counts as reached [m]."""
    stay: int
    """How long the robot must stay within this distance [ns]."""


class Referee:
    """Owns what is known of a run so far."""

    def __init__(
        self,
        goals: Sequence[GoalPoint],
        limits: Limits,
        start: tuple[float, float] = (0.0, 0.0),
        arm: ArmFit | None = None,
        mission: Mission = _NOTHING,
    ) -> None:
        """Watch for the goals in their order; the limits are judged at the end.

        Args:
            goals: The goals.
            limits: The limits.
            start: Where the robot stands before the first tick, in ``map`` [m].
            arm: The arm that it carries, if it does.
            mission: What the arm has to do.
        """
        self.goals, self.limits = tuple(goals), limits
        self.log = RunLog()
        """What is kept of each tick."""

        self.events: list[Event] = []
        """What has happened so far, in order."""

        self.reached = 0
        """Number of goals that have been reached."""

        self.command_ages: list[float] = []
        """Age of each drive command at the robot, as far as it can be known [s]."""

        self.mirror_error = math.nan
        """Largest error of a second arm at rest, which who has it sets [rad]."""

        self._arm = (
            None
            if arm is None
            else ArmLog(arm, mission, lambda text: self.note(EventKind.ARM, text))
        )
        self._silences = Silences()
        self._contacts = self._hints = self._violations = self._rules = 0
        self._touched: dict[str, int] = {}
        self._health = Health.WAITING
        self._near_since: int | None = None
        self._goal_time = math.nan
        self._place = start
        self._stamp = 0

    @property
    def all_reached(self) -> bool:
        """Whether there are goals, and the last one has been reached."""
        return bool(self.goals) and self.reached == len(self.goals)

    @property
    def contacts(self) -> int:
        """Number of contacts with obstacles so far."""
        return self._contacts

    @property
    def violations(self) -> int:
        """Number of things so far that a client tried and may not do."""
        return self._violations

    def note(self, kind: EventKind, text: str) -> None:
        """Note an event at the present time and place."""
        self.events.append(Event(self._stamp, kind, text, *self._place))
        self._violations += kind is EventKind.VIOLATION
        self._rules += kind is EventKind.RULE

    def take(self, tick: TickRecord) -> None:
        """Take one tick."""
        x, y = tick.truth.map_from_base.position[:2].tolist()
        self._place, self._stamp = (x, y), tick.stamp
        self.log.take(tick)
        self._follow_inbox(tick)
        self._follow_contacts(tick.condition.touching)
        self._follow_health(tick)
        if self._arm is not None:
            self._arm.take(tick)
        if reason := self._silences.take(tick):
            self.note(EventKind.STOP, reason)
        self._follow_goal(x, y)

    def _follow_inbox(self, tick: TickRecord) -> None:
        for message in tick.inbox:
            if isinstance(message, DriveCommand):
                self.command_ages.append(message.age / SECOND)
            elif isinstance(message, PoseHint) and message.client:
                self._hints += 1
                self.note(EventKind.HINT, f"hint by {message.client}")
        for estimate in tick.estimates:
            if estimate.verdict is not None:
                verdict = estimate.verdict
                self.note(EventKind.HINT, f"hint {verdict.verdict.value}: {verdict.reason}")

    def _follow_contacts(self, touching: Sequence[str]) -> None:
        for name in touching:
            if self._stamp - self._touched.get(name, -_CLEAR) >= _CLEAR:
                self._contacts += 1
                self.note(EventKind.CONTACT, f"touched {name}")
            self._touched[name] = self._stamp

    def _follow_health(self, tick: TickRecord) -> None:
        health = tick.estimate.health
        if health is not self._health:
            why = f": {tick.estimate.reasons[0]}" if tick.estimate.reasons else ""
            self.note(EventKind.HEALTH, f"{health.value}{why}")
            self._health = health

    def _follow_goal(self, x: float, y: float) -> None:
        if self.reached == len(self.goals):
            return
        goal = self.goals[self.reached]
        if math.hypot(x - goal.x, y - goal.y) > goal.within:
            self._near_since = None
            return
        self._near_since = self._stamp if self._near_since is None else self._near_since
        if self._stamp - self._near_since >= goal.stay:
            self.reached += 1
            self._near_since = None
            self._goal_time = self._stamp / SECOND
            self.note(EventKind.GOAL, f"reached goal {self.reached}: {goal.name}")

    def figures(self, lines: TimeLines) -> dict[str, float]:
        """Return all figures of the run so far; SI units and radians."""
        return {
            **figures_of(lines, self.limits.grace),
            "goals": float(len(self.goals)),
            "goals_reached": float(self.reached),
            # Without goals nothing had to be reached, and a limit of the time for it is kept.
            "goal_time": (math.inf if not self.all_reached else self._goal_time)
            if self.goals
            else 0.0,
            "contacts": float(self._contacts),
            "hints": float(self._hints),
            "stops": float(self._silences.count),
            "stopping_time": self._silences.longest_time,
            "runaway": self._silences.longest_way,
            "oldest_command": self._silences.oldest_command,
            "violations": float(self._violations),
            "rules": float(self._rules),
            **({} if self._arm is None else self._arm.figures()),
            **({} if self._arm is None else {"mirror_error": self.mirror_error}),
        }

    def judged(self) -> tuple[TimeLines, dict[str, float], tuple[LimitCheck, ...]]:
        """Return the time lines, the figures, and which limits they keep."""
        lines = self.log.lines()
        figures = self.figures(lines)
        return lines, figures, judge(self.limits, figures)
