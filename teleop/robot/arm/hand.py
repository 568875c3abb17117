"""The clutch between an operator's hand and the tip: relative, scaled, and open while the hand is not to be trusted.

In a room of the operator's own, "ahead" is where the hand points when the clutch first closes, and means ahead of the
arm; it stays so until the operator or the frame changes, so that a hand may be turned when it takes the arm again.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Final

import numpy as np

from localization.geometry import FloatArray, rotation_from_euler
from localization.types import SECOND, Pose
from teleop.robot.arm.arm_commands import BASE_FRAMES, Hand
from teleop.robot.arm.reach import Target
from teleop.robot.arm.steady import SteadyPose

_FASTEST: Final = 3.0
"""Speed that no hand on an arm has [m/s]; beyond it tracking has jumped. People reach at 1 to 2 m/s."""
_SPINNING: Final = 25.0
"""The same for turning it [rad/s]."""
_SHORTEST: Final = 0.02
"""Time over which its way is judged at least [s], so that noise between two samples is no jump."""
_GAP: Final = 0.1
"""Time between two samples after which the tip does not catch up with the hand [s]."""
_STEEP: Final = math.cos(math.radians(60.0))
"""Level part of a pointing below which its heading is read from the hand's upper side."""


class Grip(StrEnum):
    """Whether the tip follows the hand."""

    OPEN = "open"
    """The operator has let go."""
    CLOSED = "closed"
    """It does."""
    LOST = "lost"
    """The hand is not tracked; goes on from where both are as soon as it is."""
    JUMPED = "jumped"
    """The hand was somewhere else at once; the operator must open the clutch and close it."""


class Clutch:
    """Turns poses of the hand into targets of the tip, from where both were when the clutch closed."""

    def __init__(self, base_from_arm_base: Pose, tick: float) -> None:
        """Begin open.

        Args:
            base_from_arm_base: Mount of the arm.
            tick: Time between two calls of ``take`` [s].
        """
        self.grip = Grip.OPEN
        self.jump = 0.0
        """Way of the hand that opened the clutch [m]."""
        self.velocity = np.zeros(3), np.zeros(3)
        """Of the target [m/s], and the change of its pointing [1/s]."""
        self._tick, self._mount = tick, base_from_arm_base.rotation.T
        self._last: Hand | None = None
        self._since = 0.0
        self._room = ""
        self._ahead = np.eye(3)
        self._anchor = Pose.identity()
        self._steady = SteadyPose(self._anchor)
        self._hold: FloatArray = np.eye(4)
        self._target: Target | None = None

    def pause(self) -> None:
        """Hold the tip; the hand goes on from where both are as soon as it counts again."""
        self._target = None

    def let_go(self) -> None:
        """Note that the operator has opened the clutch."""
        self.grip, self._target = Grip.OPEN, None

    def reset(self) -> None:
        """Forget the operator, and where "ahead" is in the operator's room."""
        self.let_go()
        self._last, self._room = None, ""

    def take(self, hand: Hand, tip: FloatArray) -> Target | None:
        """Return where a hand wants the tip; None while it does not count.

        Args:
            hand: The newest sample, which may be the same as a tick ago.
            tip: ``arm_base_from_tool0`` (4, 4) of where the tip stands, from where it goes on if the clutch closes now.
        """
        self._since += self._tick
        last, before = self._last, self._target
        if hand is last and before is not None:
            return before
        passed = self._since
        if last is not None and hand.stamp and last.stamp:
            passed = (hand.stamp - last.stamp) / SECOND
        self._last, self._since = hand, 0.0
        self.grip = self._judged(hand, last, passed)
        if self.grip is not Grip.CLOSED:
            self._target = None
            return None
        if before is None or last is None or not self._goes_on(hand, last, passed):
            self._close(hand, tip)
            before = None
        else:
            self._steady.take(hand.pose, passed)
        self._target = now = self._wanted(hand.scale)
        self.velocity = np.zeros(3), np.zeros(3)
        if before is not None:
            moved, turned = now.position - before.position, now.pointing - before.pointing
            self.velocity = moved / passed, turned / passed
        return now

    def _judged(self, hand: Hand, last: Hand | None, passed: float) -> Grip:
        """Return the grip after a new sample."""
        if not hand.engaged:
            return Grip.OPEN
        if self.grip is Grip.JUMPED:
            return Grip.JUMPED
        if not hand.tracked:
            return Grip.LOST
        if self.grip is Grip.CLOSED and last is not None and last.frame == hand.frame:
            way = float(np.linalg.norm(hand.pose.position - last.pose.position))
            cosine = 0.5 * (float(np.sum(hand.pose.rotation * last.pose.rotation)) - 1.0)
            time = max(abs(passed), _SHORTEST)
            if way > _FASTEST * time or math.acos(max(-1.0, min(1.0, cosine))) > _SPINNING * time:
                self.jump = way
                return Grip.JUMPED
        return Grip.CLOSED

    @staticmethod
    def _goes_on(hand: Hand, last: Hand, passed: float) -> bool:
        """Return whether the tip may go on as before; else it begins anew from where both are."""
        same = (last.scale, last.frame) == (hand.scale, hand.frame)
        return same and 0.0 < passed <= _GAP

    def _close(self, hand: Hand, tip: FloatArray) -> None:
        """Note where hand and tip are, and what is ahead."""
        if hand.frame == "base_link":
            self._ahead = self._mount
        elif hand.frame in BASE_FRAMES:
            self._ahead = np.eye(3)
        elif hand.frame != self._room:
            self._ahead = rotation_from_euler(0.0, 0.0, -heading(hand.pose.rotation))
        self._room, self._anchor, self._hold = hand.frame, hand.pose, tip
        self._steady = SteadyPose(hand.pose)

    def _wanted(self, scale: float) -> Target:
        """Return where the tip is wanted: moved as the hand was, scaled, and turned as it was."""
        now, anchor = self._steady, self._anchor
        moved = self._ahead @ (now.position - anchor.position)
        turned = self._ahead @ now.rotation @ anchor.rotation.T @ self._ahead.T
        return Target(self._hold[:3, 3] + scale * moved, turned @ self._hold[:3, 0])


def heading(rotation: FloatArray) -> float:
    """Return where a hand (3, 3) points on the level [rad]; if it points steeply, where its upper or lower side does."""
    pointing = rotation[:, 0]
    if math.hypot(pointing[0], pointing[1]) < _STEEP:
        # Pointing down, the upper side looks ahead; pointing up, the lower one.
        pointing = -math.copysign(1.0, pointing[2]) * rotation[:, 2]
    return math.atan2(pointing[1], pointing[0])
