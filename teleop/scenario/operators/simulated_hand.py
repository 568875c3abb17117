"""A person's hand that leads the tip of an arm: reaches, waits, looks, corrects, and takes up the clutch anew."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from localization.geometry import FloatArray, quaternion_from_rotation, so3_exp, so3_log
from localization.types import SECOND, Pose

_NEAR_ENOUGH: Final = 0.003
"""Error of the tip that is not corrected [m]: as fine as a person sees it on a screen ..."""
_STRAIGHT_ENOUGH: Final = math.radians(2.0)
"""... and of its pointing [rad]."""


@dataclass(frozen=True, slots=True)
class HandTraits:
    """What a hand is like."""

    noise: float = 0.0015
    """Standard deviation of each coordinate that is measured of it [m]."""
    unrest: float = math.radians(0.5)
    """The same of its turn about each axis [rad]."""
    period: int = SECOND // 90
    """Time between two samples [ns]."""
    reaction: int = SECOND // 4
    """Time between seeing and moving [ns]."""
    span: float = 0.25
    """Way from where it is comfortable after which the clutch is opened and the hand brought back [m]."""
    turn: float = math.radians(60.0)
    """The same for turning it [rad]."""
    speed: float = 0.3
    """Mean speed of a reach [m/s]; its peak is 1.875 times that."""
    shortest: float = 0.3
    """Time that a reach takes at least [s]."""

    def __post_init__(self) -> None:
        for name in ("period", "reaction", "span", "turn", "speed", "shortest"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be > 0, got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, eq=False)
class HandSample:
    """What is measured of a hand."""

    stamp: int
    """When [ns]."""
    pose: Pose
    """``base_from_hand``, x pointing ahead."""
    engaged: bool
    """Whether the clutch is closed."""
    trigger: float
    """0 open, 1 closed."""


class _Does(StrEnum):
    REST = "rest"
    REACH = "reach"
    RETURN = "return"


class SimulatedHand:
    """Leads the tip to one goal after the other; owns where the hand is and what it does.

    It moves by reaches of minimum jerk, the way of people's arms (Flash and Hogan 1985), and sees the tip only as often
    and as late as ``see`` is called. Its frame has the axes in which the tip is seen.
    """

    def __init__(self, chance: np.random.Generator, traits: HandTraits | None = None) -> None:
        """Begin at rest where it is comfortable, with the clutch open.

        Args:
            chance: Source of the noise.
            traits: What it is like; a calm person's if not given.
        """
        self.traits = traits or HandTraits()
        self.trigger = 0.0
        """How far the trigger is pulled."""
        self.keeps = False
        """Whether the clutch stays closed though the tip is where it should be, so that the trigger counts."""
        self.clutches = 0
        """How often the clutch was closed."""
        self._chance = chance
        self._does, self._engaged = _Does.REST, False
        self._place, self._turn = np.zeros(3), np.eye(3)
        self._from: tuple[FloatArray, FloatArray] = self._place, self._turn
        self._way, self._twist = np.zeros(3), np.zeros(3)
        self._begun, self._lasts = 0, 0.0
        self._used_up, self._care = False, 1.0
        self._ready = 0
        self._goal: Pose | None = None
        self._seen: Pose | None = None

    @property
    def settled(self) -> bool:
        """Whether the tip was seen at the goal, and the hand rests."""
        return self._does is _Does.REST and self._missing() is None

    def aim(self, goal: Pose, stamp: int, care: float = 1.0) -> None:
        """Want the tip, whose turn about its own axis does not count, at another place from now on.

        Args:
            goal: Where.
            stamp: The time [ns].
            care: By so much more than what a person sees it may be off.
        """
        self._care = care
        self._goal, self._ready = goal, max(self._ready, stamp + self.traits.reaction)

    def let_go(self, stamp: int) -> None:
        """Open the clutch, bring the hand back and take the tip anew, as somebody does whom the robot has stopped."""
        self._used_up = True
        self._arrive(stamp)

    def see(self, tip: Pose) -> None:
        """See where the tip is, or was."""
        self._seen = tip

    def sample(self, stamp: int) -> HandSample:
        """Move on to a time [ns], which must rise from call to call, and return what is measured."""
        if self._does is _Does.REST:
            self._decide(stamp)
        share = 1.0
        if self._does is not _Does.REST:
            share = min(1.0, (stamp - self._begun) / SECOND / self._lasts)
            done = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            self._place = self._from[0] + done * self._way
            self._turn = so3_exp(done * self._twist) @ self._from[1]
            if share == 1.0:
                self._arrive(stamp)
        noise = self._chance.normal(size=6) * np.repeat((self.traits.noise, self.traits.unrest), 3)
        rotation = so3_exp(noise[3:]) @ self._turn
        pose = Pose(self._place + noise[:3], quaternion_from_rotation(rotation))
        return HandSample(stamp, pose, self._engaged, self.trigger)

    def _decide(self, stamp: int) -> None:
        """Begin what comes next, if anything does."""
        if stamp < self._ready:
            return
        if self._used_up:
            self._engaged, self._used_up = False, False
            self._move(_Does.RETURN, stamp, -self._place, -so3_log(self._turn))
            return
        missing = self._missing()
        if missing is None and not self.keeps:
            return
        if not self._engaged:
            self._engaged, self._ready = True, stamp + self.traits.reaction
            self.clutches += 1
            return
        if missing is None:
            return
        way, twist = missing
        for beyond, limit in (
            (np.linalg.norm(self._place + way), self.traits.span),
            (np.linalg.norm(so3_log(so3_exp(twist) @ self._turn)), self.traits.turn),
        ):
            if beyond > limit:
                shorter = max(0.2, 1.0 - (float(beyond) - limit) / float(beyond))
                way, twist, self._used_up = shorter * way, shorter * twist, True
        self._move(_Does.REACH, stamp, way, twist)

    def _missing(self) -> tuple[FloatArray, FloatArray] | None:
        """Return the way and the turn (3,) that the tip lacks, as far as it is seen; None if there are none."""
        if self._goal is None or self._seen is None:
            return None
        way = self._goal.position - self._seen.position
        here, there = self._seen.rotation[:, 0], self._goal.rotation[:, 0]
        axis = np.cross(here, there)
        sine = float(np.linalg.norm(axis))
        angle = math.atan2(sine, float(here @ there))
        near = float(np.linalg.norm(way)) < self._care * _NEAR_ENOUGH
        if near and angle < self._care * _STRAIGHT_ENOUGH:
            return None
        return way, axis * (angle / sine if sine > 1e-9 else 0.0)

    def _move(self, does: _Does, stamp: int, way: FloatArray, twist: FloatArray) -> None:
        self._does, self._begun = does, stamp
        self._from, self._way, self._twist = (self._place, self._turn), way, twist
        # A radian takes as long as 15 cm: the length of a hand.
        far = float(np.linalg.norm(way)) + 0.15 * float(np.linalg.norm(twist))
        self._lasts = max(self.traits.shortest, far / self.traits.speed)

    def _arrive(self, stamp: int) -> None:
        self._does, self._ready = _Does.REST, stamp + self.traits.reaction
