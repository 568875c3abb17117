"""A person's hand on its clutch: leads the tip where it is wanted, pulls the trigger, or waves about.

Each is a script: a generator that is called with each tick, and ends when it is done.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, TypeAlias

import numpy as np

from localization.geometry import quaternion_from_rotation, so3_exp
from localization.types import SECOND, Pose
from teleop.scenario.operators.arm_link import ArmLink
from teleop.scenario.operators.hand_motions import Motion
from teleop.scenario.operators.simulated_hand import HandSample, HandTraits, SimulatedHand

Script: TypeAlias = Iterator[None]
"""What is done tick by tick; the end of a tick is a ``yield``."""

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


class HandScripts:
    """Owns the hand, and when its next sample is due."""

    def __init__(self, link: ArmLink, traits: HandTraits, chance: np.random.Generator) -> None:
        """Begin with the clutch open.

        Args:
            link: What is sent and seen.
            traits: What the hand is like.
            chance: Source of its noise.
        """
        self.now = 0
        """Robot time of the tick [ns]."""
        self._link, self._traits, self._chance = link, traits, chance
        self._hand = SimulatedHand(chance, traits)
        self._due = self._engaged_since = 0

    @property
    def trigger(self) -> float:
        """How far the trigger is pulled."""
        return self._hand.trigger

    def take_up(self) -> None:
        """Begin a task: what was not sent meanwhile is not sent any more."""
        self._due = max(self._due, self.now)

    def pull(self, trigger: float) -> Script:
        """Pull the trigger, or let it go, with the clutch closed."""
        hand, before, begun = self._hand, self._hand.trigger, None
        hand.keeps = True
        while begun is None or self.now - begun < _STALL:
            if self._sample().engaged:
                begun = self.now if begun is None else begun
            share = 0.0 if begun is None else min(1.0, (self.now - begun) / _SQUEEZE)
            hand.trigger = before + share * (trigger - before)
            yield
        hand.keeps = False

    def lead(self, tip: Pose, lasting: float, care: float = 1.0) -> Script:
        """Lead the tip to a place, until it is seen to rest there or the time is up [s]."""
        hand, begun = self._hand, self.now
        hand.aim(tip, self.now, care)
        settled = self.now
        while self.now - begun < lasting * SECOND and self.now - settled < _LOOK:
            self._sample()
            if not hand.settled:
                settled = self.now
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
            if self._due > self.now:
                return sample

    def wave(self, motion: Motion, lasting: float, opened: float = _OPEN) -> Script:
        """Move the hand, with the clutch open at first, then closed for a time [s], and open again."""
        begun, noise = self.now, np.repeat((self._traits.noise, self._traits.unrest), 3)
        while (self.now - begun) / SECOND < opened + lasting:
            while self._due <= self.now:
                passed = (self._due - begun) / SECOND - opened
                place, turn, tracked = motion(max(0.0, passed))
                unsure = self._chance.normal(size=6) * noise
                rotation = so3_exp(unsure[3:]) @ so3_exp(turn)
                pose = Pose(place + unsure[:3], quaternion_from_rotation(rotation))
                sample = HandSample(self._due, pose, passed >= 0.0, self._hand.trigger)
                self._link.hand(sample, tracked=tracked)
                self._due += self._traits.period
            yield
        yield from self.open()

    def open(self) -> Script:
        """Open the clutch."""
        self._hand.let_go(self.now)
        self._link.hand(HandSample(self.now, Pose.identity(), False, self._hand.trigger))
        yield
