"""An operator whose hand leads an arm through a list of tasks; or who has the robot plan and do them."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.types import SECOND, Pose
from teleop.scenario.files.arm_tasks import (
    Clutch,
    Drive,
    Grip,
    Jog,
    Joints,
    Lose,
    Move,
    Pick,
    Put,
    Reach,
    Roam,
    Spot,
    Sweep,
    Task,
    Wait,
    WayOut,
)
from teleop.scenario.files.operator_settings import Hand
from teleop.scenario.operators.arm_link import ArmLink, Asked
from teleop.scenario.operators.hand_motions import losing, roaming, sweeping
from teleop.scenario.operators.hand_scripts import HandScripts, Script
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.simulated_hand import HandTraits
from teleop.scenario.operators.wire import Wire

_PATIENCE: Final = 20 * SECOND
"""Time after which a result is waited for no longer [ns]."""
_PASSING: Final = 5.0
"""By so much the tip may be further off where it only passes."""
_REST: Final = 1.2
"""Time after a drive [s]: the robot rests by then, and takes a stream of velocities again after a second."""
_WIDE: Final = 0.06
"""Opening with which the gripper comes [m]."""


class HandOperator(Operator):
    """Does one task after the other; the run is over after the last one."""

    ends_run = True

    def __init__(self, settings: Hand) -> None:
        """Take the tasks, and what the hand is like."""
        super().__init__()
        self._settings = settings

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Look at the arm."""
        given = self._settings
        self._chance = np.random.default_rng([briefing.seed, 25])
        traits = HandTraits(
            noise=given.noise,
            unrest=math.radians(given.unrest),
            reaction=max(1, round(given.reaction * SECOND)),
            speed=given.speed,
        )
        self._link = ArmLink(wire)
        self._hands = HandScripts(self._link, traits, self._chance)
        self._script = self._all()

    def act(self, wire: Wire, now: int) -> None:
        """Go on with the task."""
        self._hands.now = now
        if not self.done and next(self._script, self) is self:
            self.done = True

    def _all(self) -> Script:
        while self._link.tip is None:
            yield
        for task in self._settings.tasks:
            self._hands.take_up()
            yield from self._do(task)

    def _do(self, task: Task) -> Script:
        match task:
            case Pick():
                yield from self._pick(task)
            case Put():
                yield from self._put(task)
            case Reach():
                yield from self._hands.lead(
                    _tip(task.to, task.down, aside=task.aside), task.lasting
                )
            case Sweep():
                yield from self._hands.wave(sweeping(task), task.lasting)
            case Roam():
                yield from self._hands.wave(roaming(task, self._chance), task.lasting)
            case Lose():
                yield from self._hands.wave(*losing(task))
            case Clutch():
                yield from self._hands.wave(sweeping(Sweep("sweep")), 0.0)
                for _ in range(task.times):
                    yield from self._hands.wave(sweeping(Sweep("sweep")), task.each, 0.0)
            case Move():
                to = task.to if isinstance(task.to, str) else _tip(task.to, task.down)
                asked = self._link.move(to)
                yield from self._answer(asked if task.wait else None)
            case WayOut():
                yield from self._hands.open()
                yield from self._answer(self._link.way_out())
            case Joints():
                angles = [[math.radians(angle) for angle in row] for row in task.angles]
                yield from self._answer(self._link.follow(task.times, angles, task.names))
            case Grip():
                yield from self._answer(self._link.grip(task.opening, task.effort))
            case Jog():
                yield from self._jog(task)
            case Drive():
                yield from self._drive(task)
            case Wait():
                yield from self._pause(task.lasting)

    # With the tip in view, or by the robot's plans

    def _pick(self, task: Pick) -> Script:
        above = _tip(task.at, task.down, task.above)
        yield from self._bring(above, _PASSING)
        yield from self._jaws(_WIDE, 0.0)
        yield from self._bring(_tip(task.at, task.down))
        yield from self._jaws(0.0, task.effort)
        yield from self._bring(above, _PASSING)

    def _put(self, task: Put) -> Script:
        above = _tip(task.at, task.down, task.above)
        yield from self._bring(above, _PASSING)
        yield from self._bring(_tip(task.at, task.down))
        yield from self._jaws(_WIDE, 0.0)
        yield from self._bring(above, _PASSING)

    def _bring(self, tip: Pose, care: float = 1.0) -> Script:
        if self._settings.planned:
            yield from self._answer(self._link.move(tip))
        else:
            yield from self._hands.lead(tip, 8.0, care)

    def _jaws(self, opening: float, effort: float) -> Script:
        if self._settings.planned:
            yield from self._answer(self._link.grip(opening, effort))
            return
        closed = 0.0 if opening else 1.0
        # A trigger takes the jaws over where they are: closed ones are first pressed.
        if not closed and not self._hands.trigger and self._link.opening < 0.9 * opening:
            yield from self._hands.pull(1.0)
        yield from self._hands.pull(closed)

    def _jog(self, task: Jog) -> Script:
        end = self._hands.now + round(task.lasting * SECOND)
        while self._hands.now < end:
            self._link.jog(task.rates)
            yield
        self._link.jog([0.0] * 5)
        yield from self._pause(0.1)

    def _drive(self, task: Drive) -> Script:
        end = self._hands.now + round(task.lasting * SECOND)
        while self._hands.now < end:
            self._link.drive(task.speed, task.turn)
            yield from self._pause(0.1)
        self._link.drive(0.0, 0.0)
        yield from self._pause(_REST)

    def _answer(self, asked: Asked | None) -> Script:
        """Wait for a result, if one is waited for."""
        begun = self._hands.now
        while asked is not None and not asked.answered and self._hands.now - begun < _PATIENCE:
            yield

    def _pause(self, seconds: float) -> Script:
        end = self._hands.now + round(seconds * SECOND)
        while self._hands.now < end:
            yield


def _tip(at: Spot, down: float, above: float = 0.0, aside: float = 0.0) -> Pose:
    """Return a pose of the tip that points away from the arm's foot, so far down and to the left of that [degrees]."""
    x, y, z = at
    place = np.array([x, y, z + above])
    return Pose.from_euler(
        place, pitch=math.radians(down), yaw=math.atan2(y, x) + math.radians(aside)
    )
