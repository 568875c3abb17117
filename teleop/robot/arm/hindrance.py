"""Why the tip is not where it is wanted, in words, and what leads on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.clearance import Clearance, Near
from robot_sim.arm.inverse import solutions
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.reach import Target

_OFF: Final = 0.005
"""Error of the tip [m] ..."""
_ASKEW: Final = math.radians(3.0)
"""... and of its pointing [rad] beyond which something is in the way."""
_CLOSE: Final = 0.008
"""Distance below which what is near may be it [m]."""
_AT_LIMIT: Final = math.radians(0.5)
"""Distance from a limit within which a joint is at it [rad]."""
_TREMBLING: Final = math.radians(4.0)
"""Way of a joint that is no progress [rad]: a hand that trembles by 1.5 mm and 0.5 degrees moves joints near their limits
by as much."""
_SLOW: Final = 0.05
"""Rate below which a joint stands [rad/s]."""
_STUCK: Final = 0.3
"""Time without progress after which a way out is looked for [s]; about a person's reaction."""
_AGAIN: Final = 0.5
"""Time after which it is looked for anew [s]."""
_OTHER: Final = math.radians(30.0)
"""Difference in a joint from which on angles are another branch [rad]."""


class Hindrance(StrEnum):
    """What is in the way."""

    NONE = "none"
    """Nothing."""
    UNTRACKED = "untracked"
    """The hand is not tracked."""
    JUMPED = "jumped"
    """The hand jumped, and its clutch must be opened."""
    REACH = "reach"
    """The target is out of reach."""
    LIMIT = "limit"
    """A joint is at its limit."""
    SINGULAR = "singular"
    """The arm stands where it cannot move as wanted in small steps."""
    NEAR = "near"
    """Something is near, so the arm goes slowly or not at all."""


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """What is in the way, and what leads on."""

    hindrance: Hindrance = Hindrance.NONE
    """What it is."""
    reason: str = ""
    """The same for people."""
    way_out: str = ""
    """``turn_over``: a planned motion to ``turned_over``; ``back_off``: away from what is near; or nothing."""
    turned_over: FloatArray | None = None
    """(5,) the other angles that meet the target [rad]."""


CLEAR: Final = Finding()
_SINGULAR: Final = Finding(
    Hindrance.SINGULAR, "stretched, or its wrist straight: it cannot go that way in small steps"
)


class Diagnosis:
    """Owns how long there was no progress, and the way out that was found."""

    def __init__(self, kinematics: Kinematics, clearance: Clearance | None, tick: float) -> None:
        """Take the arm, what is around it, and the time between two ticks [s]."""
        self._kinematics, self._clearance, self._tick = kinematics, clearance, tick
        self._stuck = 0.0
        self._anchor: FloatArray | None = None
        self._other: FloatArray | None = None

    def forget(self) -> None:
        """Begin anew."""
        self._stuck, self._anchor, self._other = 0.0, None, None

    def followed(
        self,
        angles: FloatArray,
        tip: FloatArray,
        target: Target,
        beyond: float,
        near: Sequence[Near],
    ) -> Finding:
        """Return what keeps the tip from a target.

        Args:
            angles: (5,) goal of the joints [rad].
            tip: ``arm_base_from_tool0`` (4, 4) there.
            target: Where the tip shall be, brought into reach.
            beyond: How far it was moved for that [m].
            near: Pairs that are near.
        """
        out_of_reach = Finding(Hindrance.REACH, f"{100.0 * beyond:.0f} cm out of reach")
        if _met(tip, target):
            self.forget()
            return out_of_reach if beyond > _OFF else CLEAR
        # A hand trembles, and the goal with it: what counts is how far it has come, not how fast it goes.
        if self._anchor is None or float(np.abs(angles - self._anchor).max()) > _TREMBLING:
            self._anchor, self._stuck = angles, 0.0
        else:
            self._stuck += self._tick
        if self._stuck < _STUCK:
            return CLEAR
        if self._other is None or self._stuck >= _STUCK + _AGAIN:
            self._stuck, self._other = _STUCK, self._turned_over(angles, target)
        if (found := self._close(near)) is not None:
            return found
        found = out_of_reach if beyond > _OFF else self._at_limit(angles) or _SINGULAR
        if self._other is None:
            return found
        return replace(found, way_out="turn_over", turned_over=self._other)

    def jogged(
        self, angles: FloatArray, step: FloatArray, rates: FloatArray, near: Sequence[Near]
    ) -> Finding:
        """Return what keeps joints from rates (5,) [rad/s]; the others as for ``followed``."""
        if (np.abs(step) >= 0.5 * self._tick * np.minimum(_SLOW, np.abs(rates))).all():
            return CLEAR
        return self._close(near) or self._at_limit(angles) or CLEAR

    def _close(self, near: Sequence[Near]) -> Finding | None:
        """Return that something is close, if anything is."""
        if not near or near[0].distance >= _CLOSE:
            return None
        part, other = near[0].names
        reason = f"{part} is {1e3 * near[0].distance:.0f} mm from {other}"
        return Finding(Hindrance.NEAR, reason, "back_off")

    def _at_limit(self, angles: FloatArray) -> Finding | None:
        """Return that a joint is at its limit, if any is."""
        for angle, joint in zip(angles.tolist(), self._kinematics.table.joints, strict=True):
            if not joint.lower + _AT_LIMIT < angle < joint.upper - _AT_LIMIT:
                reason = f"{joint.turns} is at its limit of {math.degrees(angle):.0f} degrees"
                return Finding(Hindrance.LIMIT, reason)
        return None

    def _turned_over(self, angles: FloatArray, target: Target) -> FloatArray | None:
        """Return the nearest other angles (5,) that meet a target and are free; None if there are none."""
        found = solutions(self._kinematics, target.position, target.pointing)
        ways = np.abs(found - angles).max(axis=1, initial=0.0)
        for k in np.argsort(ways):
            if ways[k] > _OTHER and (self._clearance is None or self._clearance.free(found[k])):
                other: FloatArray = found[k]
                return other
        return None


def _met(tip: FloatArray, target: Target) -> bool:
    away = tip[:3, 3] - target.position
    pointing = float(tip[:3, 0] @ target.pointing)
    return math.sqrt(away @ away) <= _OFF and pointing >= math.cos(_ASKEW)
