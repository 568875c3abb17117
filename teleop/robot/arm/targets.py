"""Where a wish wants the tip in this tick, and how fast that place moves: of a hand, a twist or a pose."""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np

from localization.geometry import FloatArray, so3_exp
from localization.types import Pose
from teleop.robot.arm.arm_commands import TOOL_FRAME, ArmTwist, Hand, TipTarget
from teleop.robot.arm.hand import Clutch
from teleop.robot.arm.reach import Target

_LEASH: Final = 0.006
"""A twist leads the tip by at most this [m], so that it turns back at once from where it cannot go on."""
_LEASH_TURN: Final = 0.06
"""The same of its pointing [rad]."""
_LEAP: Final = 3.0
"""Speed [m/s] beyond which poses that follow each other are no motion."""

Velocity: TypeAlias = tuple[FloatArray, FloatArray]
"""Of a target (3,) [m/s], and the change of its pointing (3,) [1/s]."""


class Targets:
    """Owns the clutch, and the target that a twist leads."""

    def __init__(self, base_from_arm_base: Pose, tick: float) -> None:
        """Begin with none."""
        self.clutch = Clutch(base_from_arm_base, tick)
        self._tick = tick
        self._arm_base_from_base = base_from_arm_base.inverse()
        self._last: Target | None = None

    def pause(self) -> None:
        """Forget where the tip was wanted; it begins anew from where it is."""
        self._last = None
        self.clutch.pause()

    def take(
        self, wish: Hand | ArmTwist | TipTarget, tip: FloatArray
    ) -> tuple[Target, Velocity] | None:
        """Return the target and its velocity; None while a hand does not count.

        Args:
            wish: The newest; of another kind than before only after ``pause``.
            tip: ``arm_base_from_tool0`` (4, 4) that the goal of the joints has.
        """
        if isinstance(wish, Hand):
            target = self.clutch.take(wish, tip)
            return None if target is None else (target, self.clutch.velocity)
        if isinstance(wish, ArmTwist):
            return self._lead(wish, tip)
        pose = wish.pose
        if wish.frame == "base_link":
            pose = self._arm_base_from_base @ pose
        target = Target(pose.position, pose.rotation[:, 0])
        last, self._last = self._last or target, target
        moved = (target.position - last.position) / self._tick
        turned = (target.pointing - last.pointing) / self._tick
        if math.sqrt(moved @ moved) > _LEAP:
            moved, turned = np.zeros(3), np.zeros(3)
        return target, (moved, turned)

    def _lead(self, twist: ArmTwist, tip: FloatArray) -> tuple[Target, Velocity]:
        """Move the target on, as far as its leash reaches."""
        linear, angular = np.array(twist.linear), np.array(twist.angular)
        if twist.frame == TOOL_FRAME:
            linear, angular = tip[:3, :3] @ linear, tip[:3, :3] @ angular
        elif twist.frame == "base_link":
            axes = self._arm_base_from_base.rotation
            linear, angular = axes @ linear, axes @ angular
        last = _leashed(self._last or Target.of(tip), Target.of(tip))
        pointing = so3_exp(angular * self._tick) @ last.pointing
        self._last = Target(last.position + linear * self._tick, pointing)
        return self._last, (linear, np.cross(angular, pointing))


def _leashed(target: Target, tip: Target) -> Target:
    """Return a target that is not too far from the tip."""
    away, turned = target.position - tip.position, target.pointing - tip.pointing
    far, askew = math.sqrt(away @ away), math.sqrt(turned @ turned)
    if far <= _LEASH and askew <= _LEASH_TURN:
        return target
    pointing = tip.pointing + turned * min(1.0, _LEASH_TURN / max(askew, 1e-9))
    return Target(
        tip.position + away * min(1.0, _LEASH / max(far, 1e-9)),
        pointing / math.sqrt(pointing @ pointing),
    )
