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
from tests.teleop.scenario.fuzzing import robot_mutants


def _patch(owner: Any, name: str, value: Any) -> None:
    robot_mutants.patch(owner, name, value)


def arm_clutch_absolute() -> None:
    """The tip goes to where the hand is, instead of as far as it moves."""

    def wanted(self: Clutch, scale: float) -> Target:
        now = self._steady
        return Target(scale * now.position, now.rotation[:, 0])

    _patch(Clutch, "_wanted", wanted)


def arm_watchdog_absent() -> None:
    """What moves the arm stays in force though no command comes."""
    _patch(ArmDeadman, "expire", lambda self, now: None)


def arm_jumps_followed() -> None:
    """A hand that is somewhere else at once is followed there."""

    def judged(self: Clutch, hand: Any, last: Any, passed: float) -> Grip:
        if not hand.engaged:
            return Grip.OPEN
        return Grip.CLOSED if hand.tracked else Grip.LOST

    _patch(Clutch, "_judged", judged)


def arm_untracked_followed() -> None:
    """A pose that is only guessed counts."""
    original = Clutch._judged

    def judged(self: Clutch, hand: Any, last: Any, passed: float) -> Grip:
        return original(self, replace(hand, tracked=True), last, passed)

    _patch(Clutch, "_judged", judged)


def arm_unchecked() -> None:
    """The next state is not checked for what is near."""
    original = NextState.__init__

    def begin(self: NextState, table: Any, limiter: Any, clearance: Any) -> None:
        original(self, table, limiter, None)

    _patch(NextState, "__init__", begin)


def arm_jerk_unbounded() -> None:
    """A hand's wish is followed with any jerk."""
    original = JerkLimiter.__init__

    def begin(self: JerkLimiter, table: Any, tick: float) -> None:
        original(self, table, tick)
        self._ruckig.given.max_jerk = [1e5] * len(table.joints)

    _patch(JerkLimiter, "__init__", begin)


def arm_estop_deaf() -> None:
    """The e-stop stops the wheels, and not what a client moves the arm by."""
    original = ArmDeadman.stop

    def stop(self: ArmDeadman, reason: str) -> None:
        if not reason.startswith("e-stop by"):
            original(self, reason)

    _patch(ArmDeadman, "stop", stop)


def arm_stow_ignored() -> None:
    """The vehicle drives as fast as ever with its arm out."""
    original = ArmDrive.measure

    def measure(self: ArmDrive) -> Any:
        state = original(self)
        self._safety.narrow = None
        return state

    _patch(ArmDrive, "measure", measure)


def arm_two_masters() -> None:
    """The arm follows everybody's commands."""
    original = ArmDrive.obey

    def obey(self: ArmDrive, message: Any, now: int) -> Any:
        holder = self._safety.controller
        if holder and message.client != holder and getattr(message.wish, "engaged", False):
            self._control.follow(message.client, message.wish, 1.0)
            return None
        return original(self, message, now)

    _patch(ArmDrive, "obey", obey)


def arm_held_by_a_step() -> None:
    """What stops the arm stops it at once, without braking."""

    def stop(self: JerkLimiter, motion: Motion) -> Motion:
        return Motion.at_rest(np.asarray(motion.angles))

    _patch(JerkLimiter, "stop", stop)


def arm_let_go_ignored() -> None:
    """An opened clutch does not end what the hand moved."""
    original = ArmControl.tick

    def tick(self: ArmControl, now: int, permit: Any) -> Any:
        return original(self, now, replace(permit, engaged=permit.engaged or not permit.stopped))

    _patch(ArmControl, "tick", tick)


ARM_MUTANTS: Final[dict[str, Callable[[], None]]] = {
    mutant.__name__: mutant
    for mutant in (
        arm_clutch_absolute,
        arm_watchdog_absent,
        arm_jumps_followed,
        arm_untracked_followed,
        arm_unchecked,
        arm_jerk_unbounded,
        arm_estop_deaf,
        arm_stow_ignored,
        arm_two_masters,
        arm_held_by_a_step,
        arm_let_go_ignored,
    )
}
"""All mutants by name."""
