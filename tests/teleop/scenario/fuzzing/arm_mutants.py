"""Mutants of the arm's control, each one small change that a programmer could make; applied as ``robot_mutants`` are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from teleop.robot.arm.arm_control import ArmControl
from teleop.robot.arm.hand import Clutch, Grip
from teleop.robot.arm.limits import JerkLimiter, Motion
from teleop.robot.arm.next_state import NextState
from teleop.robot.arm.reach import Target
from teleop.robot.arm_drive import ArmDrive
from teleop.robot.safety.arm_deadman import ArmDeadman
from tests.teleop.scenario.fuzzing.robot_mutants import around

ARM_MUTANTS: Final[dict[str, Callable[[], None]]] = {}
"""What applies each mutant, by name."""


@around(Clutch, "_wanted", ARM_MUTANTS)
def arm_clutch_absolute(_: Any, self: Clutch, scale: float) -> Target:
    """The tip goes to where the hand is, instead of as far as it moves."""
    now = self._steady
    return Target(scale * now.position, now.rotation[:, 0])


@around(ArmDeadman, "expire", ARM_MUTANTS)
def arm_watchdog_absent(_: Any, self: ArmDeadman, now: int) -> None:
    """What moves the arm stays in force though no command comes."""


@around(Clutch, "_judged", ARM_MUTANTS)
def arm_jumps_followed(_: Any, self: Clutch, hand: Any, last: Any, passed: float) -> Grip:
    """A hand that is somewhere else at once is followed there."""
    if not hand.engaged:
        return Grip.OPEN
    return Grip.CLOSED if hand.tracked else Grip.LOST


@around(Clutch, "_judged", ARM_MUTANTS)
def arm_untracked_followed(original: Any, self: Clutch, hand: Any, last: Any, passed: float) -> Any:
    """A pose that is only guessed counts."""
    return original(self, replace(hand, tracked=True), last, passed)


@around(NextState, "__init__", ARM_MUTANTS)
def arm_unchecked(original: Any, self: NextState, table: Any, limiter: Any, clearance: Any) -> None:
    """The next state is not checked for what is near."""
    original(self, table, limiter, None)


@around(JerkLimiter, "__init__", ARM_MUTANTS)
def arm_jerk_unbounded(original: Any, self: JerkLimiter, table: Any, tick: float) -> None:
    """A hand's wish is followed with any jerk."""
    original(self, table, tick)
    self._ruckig.given.max_jerk = [1e5] * len(table.joints)


@around(ArmDeadman, "stop", ARM_MUTANTS)
def arm_estop_deaf(original: Any, self: ArmDeadman, reason: str) -> None:
    """The e-stop stops the wheels, and not what a client moves the arm by."""
    if not reason.startswith("e-stop by"):
        original(self, reason)


@around(ArmDrive, "measure", ARM_MUTANTS)
def arm_stow_ignored(original: Any, self: ArmDrive) -> Any:
    """The vehicle drives as fast as ever with its arm out."""
    state = original(self)
    self._safety.narrow = None
    return state


@around(ArmDrive, "obey", ARM_MUTANTS)
def arm_two_masters(original: Any, self: ArmDrive, message: Any, now: int) -> Any:
    """The arm follows everybody's commands."""
    holder = self._safety.controller
    if holder and message.client != holder and getattr(message.wish, "engaged", False):
        self._control.follow(message.client, message.wish, 1.0)
        return None
    return original(self, message, now)


@around(JerkLimiter, "stop", ARM_MUTANTS)
def arm_held_by_a_step(_: Any, self: JerkLimiter, motion: Motion) -> Motion:
    """What stops the arm stops it at once, without braking."""
    return Motion.at_rest(np.asarray(motion.angles))


@around(ArmControl, "tick", ARM_MUTANTS)
def arm_let_go_ignored(original: Any, self: ArmControl, now: int, permit: Any) -> Any:
    """An opened clutch does not end what the hand moved."""
    return original(self, now, replace(permit, engaged=permit.engaged or not permit.stopped))
