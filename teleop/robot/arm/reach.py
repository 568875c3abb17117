"""Where the tip shall be, and how far the arm reaches: a goal beyond is brought to where its wrist can be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.geometry import FloatArray, quaternion_from_rotation
from localization.types import Pose
from localization.types.arrays import read_only
from robot_sim.arm.kinematics import Kinematics

_BEND: Final = math.radians(18.0)
"""The elbow stays bent by at least this, and from folding up as far: beyond, the arm's tip hardly moves for large angles,
and a stretched arm shakes at 1.3 to 1.8 rad/s."""


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Where the tip shall be and point, in ``arm_base``; its turn about the gripper's own axis is left free."""

    position: FloatArray
    """(3,) of the tip [m]."""
    pointing: FloatArray
    """(3,) unit vector along the gripper."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", read_only(self.position, (3,), "position"))
        object.__setattr__(self, "pointing", read_only(self.pointing, (3,), "pointing"))

    @classmethod
    def of(cls, arm_base_from_tool0: FloatArray) -> Target:
        """Return where a tip is, given as a matrix (4, 4)."""
        return cls(arm_base_from_tool0[:3, 3], arm_base_from_tool0[:3, 0])

    def pose(self, upright: FloatArray) -> Pose:
        """Return ``arm_base_from_tool0``, with that turn about its axis which is nearest to a rotation (3, 3)."""
        x = self.pointing
        # The axis of the other two that is less in line with x stays as it is, as far as it can.
        keep = 2 if abs(x @ upright[:, 2]) < abs(x @ upright[:, 1]) else 1
        kept = upright[:, keep] - (x @ upright[:, keep]) * x
        kept /= math.sqrt(kept @ kept)
        y, z = (np.cross(kept, x), kept) if keep == 2 else (kept, np.cross(x, kept))
        rotation = np.column_stack([x, y, z])
        return Pose(self.position, quaternion_from_rotation(rotation))


class Reach:
    """The shell around the shoulder in which the wrist can be, from an arm's table."""

    def __init__(self, kinematics: Kinematics) -> None:
        """Work out the shell."""
        joints = kinematics.table.joints
        upper, forearm, self._gripper = joints[1].a, joints[3].d, joints[4].a
        self._shoulder = np.array([0.0, 0.0, kinematics.table.links[0].length + joints[0].d])
        self.inner, self.outer = (
            math.sqrt(upper**2 + forearm**2 + 2.0 * upper * forearm * math.cos(bend))
            for bend in (math.pi - _BEND, _BEND)
        )

    def wrist(self, target: Target) -> FloatArray:
        """Return where the wrist must be for a target, seen from the shoulder (3,) [m]."""
        wrist: FloatArray = target.position - self._gripper * target.pointing - self._shoulder
        return wrist

    def distance(self, target: Target) -> float:
        """Return how far from the shoulder the wrist must be for a target [m]."""
        wrist = self.wrist(target)
        return math.sqrt(wrist @ wrist)

    def clamped(self, target: Target, standing: Target) -> tuple[Target, float]:
        """Bring a target into reach, its pointing kept.

        The shell is widened to where the arm stands, so that nothing moves when a hand takes an arm that stands beyond,
        and narrows again as it comes back.

        Args:
            target: What is wanted.
            standing: Where the tip is.

        Returns:
            The target, and how far it was moved [m].
        """
        wrist, now = self.wrist(target), self.distance(standing)
        distance = math.sqrt(wrist @ wrist)
        allowed = max(min(distance, max(self.outer, now)), min(self.inner, now))
        if allowed == distance:
            return target, 0.0
        if distance < 1e-6:  # the target leaves the direction open
            wrist, distance = self.wrist(standing), now
        moved = self._shoulder + wrist * (allowed / distance) + self._gripper * target.pointing
        return Target(moved, target.pointing), float(np.linalg.norm(moved - target.position))
