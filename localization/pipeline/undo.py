"""Undo: the estimate that a placement replaced, carried on by dead reckoning so that it can be restored.

A hint may point to the wrong place, and a search may find it. The estimate before goes on in parallel, by
wheels, gyro and KISS-ICP's motion alone, independent of whatever was matched from the new place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from localization.filter.ekf import FilterState, with_pose
from localization.geometry import FloatArray, hat, so3_exp, wrap_angle
from localization.monitoring.health import HealthMonitor
from localization.motion.kiss_odometry import ObservedMotion
from localization.types import Pose

_PLANAR = np.zeros((3, 6))
_PLANAR[(0, 1, 2), (0, 1, 5)] = 1.0
"""Selects x, y and yaw of an error (position, rotation)."""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A motion and its covariance."""

    motion: Pose
    """``base_then_from_base_now``."""
    covariance: FloatArray
    """(6, 6) of (position error in base then [m], rotation error in base now [rad])."""

    @classmethod
    def of(cls, then: Pose, now: Pose, accrued: FloatArray, attitude: FloatArray) -> Step:
        """Return the step between two poses of ``odom_from_base``.

        Args:
            then: the pose at its beginning.
            now: the pose at its end.
            accrued: (6, 6) that the process added meanwhile, its position part along the axes of ``map``.
            attitude: (3, 3) rotation from base then to ``map`` in which that is so.
        """
        turn = np.eye(6)
        turn[:3, :3] = attitude.T
        return cls(then.inverse() @ now, turn @ accrued @ turn.T)

    def corrected(self, motion: Pose, covariance: FloatArray) -> Step:
        """Return the step after it was also observed.

        Args:
            motion: observed; only x, y and yaw are used.
            covariance: (3, 3) of them [m, m, rad].
        """
        p = self.covariance
        gain = p @ _PLANAR.T @ np.linalg.inv(_PLANAR @ p @ _PLANAR.T + covariance)
        off = motion.position - self.motion.position
        shift = gain @ np.array([off[0], off[1], wrap_angle(motion.yaw - self.motion.yaw)])
        moved = Pose.from_rotation(
            self.motion.position + shift[:3], self.motion.rotation @ so3_exp(shift[3:])
        )
        return Step(moved, p - gain @ _PLANAR @ p)

    def carry(self, pose: Pose, covariance: FloatArray) -> tuple[Pose, FloatArray]:
        """Return a pose and its (6, 6) covariance after the step."""
        f = np.eye(6)
        f[:3, 3:] = -pose.rotation @ hat(self.motion.position)
        f[3:, 3:] = self.motion.rotation.T
        g = np.eye(6)
        g[:3, :3] = pose.rotation
        grown: FloatArray = f @ covariance @ f.T + g @ self.covariance @ g.T
        return pose @ self.motion, grown


Steps = tuple["Steps", Step] | None
"""The way since the placement, newest step first; a linked list, of which states share the tails."""


@dataclass(frozen=True, slots=True, eq=False)
class ReplacedEstimate:
    """The estimate before a placement, and the way since then; a value."""

    stamp: int
    """Time of the placement [ns]."""
    reason: str
    """Why the pose that replaced it was believed."""
    placed: bool
    """Whether it was a pose in the map."""
    filter: FilterState
    """The filter before the placement."""
    health: HealthMonitor
    """The evidence before the placement."""
    odom_from_base: Pose
    """Pose at the end of the way."""
    steps: Steps = None
    """The way."""

    def extended(
        self,
        odom_from_base: Pose,
        accrued: FloatArray,
        attitude: FloatArray,
        observed: ObservedMotion | None,
    ) -> ReplacedEstimate:
        """Return it with one more step.

        Args:
            odom_from_base: now.
            accrued: (6, 6) pose covariance that the process added since the step before.
            attitude: (3, 3) rotation of ``map_from_base`` at the step before.
            observed: the motion since then as KISS-ICP observed it, if it did.
        """
        step = Step.of(self.odom_from_base, odom_from_base, accrued, attitude)
        if observed is not None:
            step = step.corrected(*observed)
        return replace(self, odom_from_base=odom_from_base, steps=(self.steps, step))

    def carried(self) -> tuple[Pose, FloatArray]:
        """Return its ``map_from_base`` and (6, 6) covariance at the end of the way."""
        way: list[Step] = []
        steps = self.steps
        while steps is not None:
            steps, step = steps
            way.append(step)
        pose, covariance = self.filter.pose, self.filter.covariance
        for step in reversed(way):
            pose, covariance = step.carry(pose, covariance)
        return pose, covariance

    def restored(self, now: FilterState) -> FilterState:
        """Return the filter as it would be now, had nothing been matched since the placement."""
        was, (pose, covariance) = self.filter, self.carried()
        before = replace(
            now,
            gyro_bias=was.gyro_bias,
            kappa=was.kappa,
            full_covariance=was.full_covariance,
        )
        return with_pose(before, pose, 0.5 * (covariance + covariance.T))
