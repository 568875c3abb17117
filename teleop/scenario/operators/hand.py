"""An operator whose hand leads an arm through a list of tasks; or who has the robot plan and do them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, TypeAlias

import numpy as np

from localization.geometry import quaternion_from_rotation, so3_exp
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
from teleop.scenario.operators.hand_motions import Motion, losing, roaming, sweeping
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.simulated_hand import HandSample, HandTraits, SimulatedHand
from teleop.scenario.operators.wire import Wire

Script: TypeAlias = Iterator[None]
"""What is done tick by tick; the end of a tick is a ``yield``."""

_PATIENCE: Final = 20 * SECOND
"""Time after which a result is waited for no longer [ns]."""
_PASSING: Final = 5.0
"""By so much the tip may be further off where it only passes."""
_LOOK: Final = SECOND // 5
"""Time for which the tip must be seen to be where it should before the next thing is done [ns]."""
_SQUEEZE: Final = SECOND * 3 // 10
"""Time in which a trigger is pulled or let go [ns]."""
_STALL: Final = SECOND * 9 // 10
"""Time in which jaws close or open [ns]: 0.8 s for their whole way."""
_OPEN: Final = 0.2
"""Time for which the clutch is open before it closes [s]."""
_NOTICED: Final = SECOND
"""Time after closing the clutch in which the robot may still say that it had stopped the arm [ns]."""
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
        self._traits = HandTraits(
            noise=given.noise,
            unrest=math.radians(given.unrest),
            reaction=max(1, round(given.reaction * SECOND)),
            speed=given.speed,
        )
        self._hand = SimulatedHand(self._chance, self._traits)
        self._link = ArmLink(wire)
        self._now = self._due = self._engaged_since = 0
        self._script = self._all()

    def act(self, wire: Wire, now: int) -> None:
        """Go on with the task."""
        self._now = now
        if not self.done and next(self._script, self) is self:
            self.done = True

    def _all(self) -> Script:
        while self._link.tip is None:
            yield
        for task in self._settings.tasks:
            self._due = self._now
            yield from self._do(task)

    def _do(self, task: Task) -> Script:
        match task:
            case Pick():
                yield from self._pick(task)
            case Put():
                yield from self._put(task)
            case Reach():
                yield from self._lead(_tip(task.to, task.down, aside=task.aside), task.lasting)
            case Sweep():
                yield from self._wave(sweeping(task), task.lasting)
            case Roam():
                yield from self._wave(roaming(task, self._chance), task.lasting)
            case Lose():
                yield from self._wave(*losing(task))
            case Clutch():
                yield from self._wave(sweeping(Sweep("sweep")), 0.0)
                for _ in range(task.times):
                    yield from self._wave(sweeping(Sweep("sweep")), task.each, 0.0)
            case Move():
                to = task.to if isinstance(task.to, str) else _tip(task.to, task.down)
                asked = self._link.move(to)
                yield from self._answer(asked if task.wait else None)
            case WayOut():
                yield from self._open()
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
            yield from self._lead(tip, 8.0, care)

    def _jaws(self, opening: float, effort: float) -> Script:
        if self._settings.planned:
            yield from self._answer(self._link.grip(opening, effort))
            return
        closed = 0.0 if opening else 1.0
        # A trigger takes the jaws over where they are: closed ones are first pressed.
        if not closed and not self._hand.trigger and self._link.opening < 0.9 * opening:
            yield from self._pull(1.0)
        yield from self._pull(closed)

    def _pull(self, trigger: float) -> Script:
        """Pull the trigger, or let it go, with the clutch closed."""
        hand, before, begun = self._hand, self._hand.trigger, None
        hand.keeps = True
        while begun is None or self._now - begun < _STALL:
            if self._sample().engaged:
                begun = self._now if begun is None else begun
            share = 0.0 if begun is None else min(1.0, (self._now - begun) / _SQUEEZE)
            hand.trigger = before + share * (trigger - before)
            yield
        hand.keeps = False

    def _lead(self, tip: Pose, lasting: float, care: float = 1.0) -> Script:
        """Lead the tip to a place, until it is seen to rest there or the time is up [s]."""
        hand, begun = self._hand, self._now
        hand.aim(tip, self._now, care)
        settled = self._now
        while self._now - begun < lasting * SECOND and self._now - settled < _LOOK:
            self._sample()
            if not hand.settled:
                settled = self._now
            yield

    def _sample(self) -> HandSample:
        """Send all samples of the hand that are due; return the last one."""
        hand = self._hand
        if self._link.tip is not None:
            hand.see(self._link.tip)
        while True:
            sample = hand.sample(self._due)
            if not sample.engaged:
                self._engaged_since = self._due
            elif self._link.stopped and self._due - self._engaged_since > _NOTICED:
                hand.let_go(self._due)
                self._engaged_since = self._due
            self._link.hand(sample)
            self._due += self._traits.period
            if self._due > self._now:
                return sample

    # Without a look at the tip

    def _wave(self, motion: Motion, lasting: float, opened: float = _OPEN) -> Script:
        """Move the hand, with the clutch open at first, then closed for a time [s], and open again."""
        begun, noise = self._now, np.repeat((self._traits.noise, self._traits.unrest), 3)
        while (self._now - begun) / SECOND < opened + lasting:
            while self._due <= self._now:
                passed = (self._due - begun) / SECOND - opened
                place, turn, tracked = motion(max(0.0, passed))
                unsure = self._chance.normal(size=6) * noise
                rotation = so3_exp(unsure[3:]) @ so3_exp(turn)
                pose = Pose(place + unsure[:3], quaternion_from_rotation(rotation))
                sample = HandSample(self._due, pose, passed >= 0.0, self._hand.trigger)
                self._link.hand(sample, tracked=tracked)
                self._due += self._traits.period
            yield
        yield from self._open()

    def _open(self) -> Script:
        """Open the clutch."""
        self._hand.let_go(self._now)
        self._link.hand(HandSample(self._now, Pose.identity(), False, self._hand.trigger))
        yield

    def _jog(self, task: Jog) -> Script:
        end = self._now + round(task.lasting * SECOND)
        while self._now < end:
            self._link.jog(task.rates)
            yield
        self._link.jog([0.0] * 5)
        yield from self._pause(0.1)

    def _drive(self, task: Drive) -> Script:
        end = self._now + round(task.lasting * SECOND)
        while self._now < end:
            self._link.drive(task.speed, task.turn)
            yield from self._pause(0.1)
        self._link.drive(0.0, 0.0)
        yield from self._pause(_REST)

    def _answer(self, asked: Asked | None) -> Script:
        """Wait for a result, if one is waited for."""
        begun = self._now
        while asked is not None and not asked.answered and self._now - begun < _PATIENCE:
            yield

    def _pause(self, seconds: float) -> Script:
        end = self._now + round(seconds * SECOND)
        while self._now < end:
            yield


def _tip(at: Spot, down: float, above: float = 0.0, aside: float = 0.0) -> Pose:
    """Return a pose of the tip that points away from the arm's foot, so far down and to the left of that [degrees]."""
    x, y, z = at
    place = np.array([x, y, z + above])
    return Pose.from_euler(
        place, pitch=math.radians(down), yaw=math.atan2(y, x) + math.radians(aside)
    )
