"""The goals of the arm: at most one that moves it and one of its gripper, and the results until they are confirmed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from localization.types import SECOND
from teleop.robot.arm.arm_commands import Goal, GripperGoal
from teleop.robot.arm.goal_results import (
    NO_PATH,
    GoalOutcome,
    GoalProgress,
    GoalReport,
    GoalResult,
    Grip,
    TimedPath,
)

_MAX_UNANSWERED: Final = 1000
"""Results that are kept for the gateway; so many wait only if it takes none."""


@dataclass(frozen=True, slots=True)
class Patience:
    """How long a client with a goal may give no sign of life."""

    watchdog: int = SECOND // 2
    """Time without one after which its goal ends [ns]."""
    pings: int = SECOND
    """Age of a ping without an answer after which it ends [ns]."""
    tick: int = SECOND // 50
    """Period of the ticks [ns]."""

    def silence(self, client: str, alive: int, age: int, now: int) -> str:
        """Return why a client counts as gone at a time [ns]; empty if it does not.

        Args:
            client: Name of the client.
            alive: Its newest sign of life [ns].
            age: Age of its oldest ping without an answer, then [ns]; 0 if it had answered all.
            now: The time [ns].
        """
        age = age + now - alive if age else 0
        if age > self.pings:
            return f"{client} has not answered pings for {age / SECOND:.1f} s"
        if (quiet := now - alive + self.tick) > self.watchdog:
            return f"no sign of {client} for {quiet / SECOND:.2f} s"
        return ""


@dataclass(slots=True)
class OpenGoal:
    """A goal under way."""

    client: str
    """Name of its client."""
    goal: Goal
    """What is wanted."""
    alive: int
    """Newest sign of life [ns]."""
    age: int = 0
    """Age of the client's oldest ping without an answer, then [ns]."""
    state: str = "waiting"
    """``planning``, ``waiting`` or ``moving``."""
    share: float = 0.0
    """Of the motion that is done."""
    path: TimedPath = NO_PATH
    """Its way, once it is known."""
    shown: bool = False
    """Whether a report had the way."""
    cancelled: bool = False
    """Whether its client has cancelled it."""


class GoalDesk:
    """Owns goals and results; what they do to the arm is decided elsewhere."""

    def __init__(self) -> None:
        """Begin empty."""
        self.arm: OpenGoal | None = None
        """The goal that moves the arm."""
        self.gripper: OpenGoal | None = None
        """The goal of the gripper."""
        self._unanswered: deque[GoalResult] = deque(maxlen=_MAX_UNANSWERED)

    def open(self, client: str, goal: Goal, now: int, age: int) -> None:
        """Begin a goal; one that is under way is cancelled for it."""
        new = OpenGoal(client, goal, now, age)
        if isinstance(goal, GripperGoal):
            self.end_gripper(GoalOutcome.CANCELLED, "a newer goal took its place")
            self.gripper = new
        else:
            self.end_arm(GoalOutcome.CANCELLED, "a newer goal took its place")
            self.arm = new

    def refuse(self, client: str, goal: Goal, why: str) -> None:
        """Answer a goal that is not begun."""
        self._unanswered.append(GoalResult(client, goal.number, GoalOutcome.REFUSED, why))

    def end_arm(self, outcome: GoalOutcome, message: str = "") -> None:
        """Answer the goal that moves the arm, if there is one."""
        if (ended := self.arm) is not None:
            self.arm = None
            self._unanswered.append(
                GoalResult(ended.client, ended.goal.number, outcome, message, ended.path)
            )

    def end_gripper(
        self, outcome: GoalOutcome, message: str = "", grip: Grip | None = None
    ) -> None:
        """Answer the goal of the gripper, if there is one."""
        if (ended := self.gripper) is not None:
            self.gripper = None
            self._unanswered.append(
                GoalResult(ended.client, ended.goal.number, outcome, message, grip=grip)
            )

    def cancel(self, client: str, number: int) -> None:
        """Note that a client cancels one of its goals."""
        for each in (self.arm, self.gripper):
            if each is not None and (each.client, each.goal.number) == (client, number):
                each.cancelled = True

    def alive(self, client: str, arrival: int, age: int) -> None:
        """Note a sign of life of a client."""
        for each in (self.arm, self.gripper):
            if each is not None and each.client == client:
                each.alive, each.age = max(each.alive, arrival), age

    def answered(self, number: int) -> None:
        """Forget a result that the gateway has taken."""
        self._keep(lambda result: result.number != number)

    def disconnected(self, client: str) -> None:
        """Forget the results of a client that has left: nobody waits for them."""
        self._keep(lambda result: result.client != client)

    def forget(self) -> None:
        """Forget everything: the gateway has ended, and with it all its clients."""
        self.arm = self.gripper = None
        self._unanswered.clear()

    def report(self, grip: Grip) -> GoalReport:
        """Return the goals after a tick."""
        moving = []
        if (arm := self.arm) is not None:
            path = NO_PATH if arm.shown else arm.path
            arm.shown = arm.path is not NO_PATH
            moving.append(GoalProgress(arm.goal.number, arm.state, arm.share, path))
        if (gripper := self.gripper) is not None:
            moving.append(GoalProgress(gripper.goal.number, "moving", grip=grip))
        return GoalReport(tuple(moving), tuple(self._unanswered))

    def _keep(self, wanted: Callable[[GoalResult], bool]) -> None:
        self._unanswered = deque(filter(wanted, self._unanswered), maxlen=_MAX_UNANSWERED)
