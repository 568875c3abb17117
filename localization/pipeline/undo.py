"""The former estimate: what a placement replaced, carried along so that it can be taken back.

A hint may point to the wrong place, and a search may find it. What was believed before goes on beside, by
wheels, gyro and KISS-ICP's motion alone: nothing that was matched from the new place touches it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from localization.filter.ekf import EkfSnapshot, SkidSteerEkf
from localization.geometry import FloatArray, hat, so3_exp, wrap_angle
from localization.types import Pose

_PLANAR = np.zeros((3, 6))
_PLANAR[(0, 1, 2), (0, 1, 5)] = 1.0
"""x, y and yaw of an error (position, rotation)."""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A motion ``base_then_from_base_now``, and how well it is known."""

    motion: Pose
    covariance: FloatArray
    """(6, 6) of (position error in base then [m], rotation error in base now [rad])."""

    @classmethod
    def of(cls, then: Pose, now: Pose, accrued: FloatArray, attitude: FloatArray) -> Step:
        """Return the step between two poses of ``odom_from_base``.

        Args:
            then: at its beginning.
            now: at its end.
            accrued: (6, 6) that the process added meanwhile, its position part along the axes of ``map``.
            attitude: (3, 3) rotation from base then to ``map`` in which that is so.
        """
        turn = np.eye(6)
        turn[:3, :3] = attitude.T
        return cls(then.inverse() @ now, turn @ accrued @ turn.T)

    def seen(self, motion: Pose, covariance: FloatArray) -> Step:
        """Return the step as it is after it was also seen.

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
"""The way since the placement, newest step first; a list that is shared and never changed."""


@dataclass(frozen=True, slots=True, eq=False)
class Former:
    """An estimate that was replaced, and the way since then."""

    stamp: int
    """When it was replaced [ns]."""
    what: str
    """What replaced it."""
    placed: bool
    """Whether it was one."""
    ekf: EkfSnapshot
    health: Mapping[str, object]
    odom: Pose
    """``odom_from_base`` at the end of the way."""
    steps: Steps = None

    def went(
        self,
        odom: Pose,
        ekf: SkidSteerEkf,
        attitude: FloatArray,
        seen: tuple[Pose, FloatArray] | None,
    ) -> Former:
        """Return it with one more step.

        Args:
            odom: ``odom_from_base`` now.
            ekf: whose process accrued error since the step before.
            attitude: (3, 3) rotation of ``map_from_base`` at the step before.
            seen: how KISS-ICP saw the robot move since then, if it did: x, y, yaw and their covariance.
        """
        step = Step.of(self.odom, odom, ekf.accrued, attitude)
        if seen is not None:
            step = step.seen(*seen)
        return replace(self, odom=odom, steps=(self.steps, step))

    def carried(self) -> tuple[Pose, FloatArray]:
        """Return its ``map_from_base`` and (6, 6) covariance at the end of the way."""
        way: list[Step] = []
        steps = self.steps
        while steps is not None:
            steps, step = steps
            way.append(step)
        pose, covariance = self.ekf.pose, np.array(self.ekf.covariance[:6, :6])
        for step in reversed(way):
            pose, covariance = step.carry(pose, covariance)
        return pose, covariance

    def bring_back(self, ekf: SkidSteerEkf) -> None:
        """Let a filter believe what it would, had nothing been matched since."""
        was, (pose, covariance) = self.ekf, self.carried()
        ekf.restore(
            replace(
                ekf.snapshot(),
                gyro_bias=was.gyro_bias,
                kappa=was.kappa,
                covariance=was.covariance,
            )
        )
        ekf.reset_pose(pose, 0.5 * (covariance + covariance.T))
