"""The robot's outline on the floor, and how near points are to it along a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from localization.geometry import FloatArray


class Box(NamedTuple):
    """A rectangle along the axes of ``base_link``."""

    rear: float
    """Its smallest x [m]."""
    front: float
    """Its largest x [m]."""
    right: float
    """Its smallest y [m]."""
    left: float
    """Its largest y [m]."""


@dataclass(frozen=True, slots=True)
class Outline:
    """A rectangle around the robot in ``base_link``, and one around its arm."""

    front: float
    """Distance of the front from ``base_link`` [m]."""
    rear: float
    """Distance of the rear from it [m]."""
    half_width: float
    """Half its width, wheels included [m]."""
    arm: Box | None = None
    """Around the arm; None without one."""

    def __post_init__(self) -> None:
        for name in ("front", "rear", "half_width"):
            if not 0.0 < getattr(self, name) < 5.0:
                raise ValueError(f"outline {name} must be > 0 and < 5 m, got {getattr(self, name)}")

    @property
    def radius(self) -> float:
        """Distance of its farthest corner from ``base_link`` [m]."""
        hull = math.hypot(max(self.front, self.rear), self.half_width)
        if self.arm is None:
            return hull
        rear, front, right, left = self.arm
        return max(hull, math.hypot(max(-rear, front), max(-right, left)))

    def gaps(self, poses: FloatArray, points: FloatArray) -> FloatArray:
        """Return the distances (..., N) of points from the outline at poses [m], negative inside it.

        Args:
            poses: (..., 3) x, y [m] and yaw [rad].
            points: (N, 2) in the frame of the poses [m].
        """
        dx = points[:, 0] - poses[..., 0:1]
        dy = points[:, 1] - poses[..., 1:2]
        c, s = np.cos(poses[..., 2:3]), np.sin(poses[..., 2:3])
        x, y = c * dx + s * dy, c * dy - s * dx
        gaps = _gaps(Box(-self.rear, self.front, -self.half_width, self.half_width), x, y)
        return gaps if self.arm is None else np.minimum(gaps, _gaps(self.arm, x, y))

    def gaps_to_arm(self, points: FloatArray) -> FloatArray:
        """Return the distances (N,) of points (N, 2) in ``base_link`` from the arm [m]; infinite without one."""
        if self.arm is None:
            return np.full(len(points), np.inf)
        return _gaps(self.arm, points[:, 0], points[:, 1])

    def swept(self, poses: FloatArray) -> FloatArray:
        """Return the corners (M, 2) of a polygon around what is covered at poses (S, 3) of one motion."""
        x = np.array([self.front, -self.rear, -self.rear, self.front])
        y = np.array([self.half_width, self.half_width, -self.half_width, -self.half_width])
        c, s = np.cos(poses[:, 2:3]), np.sin(poses[:, 2:3])
        tracks = np.stack((poses[:, 0:1] + c * x - s * y, poses[:, 1:2] + s * x + c * y), -1)
        forward, turn = poses[-1, 0], poses[-1, 2]
        if abs(forward) < self.half_width * abs(
            turn
        ):  # around a point inside: each corner draws an arc
            return np.concatenate([tracks[:: 1 if turn > 0.0 else -1, i] for i in range(4)])
        left, right = (0, 3) if forward > 0.0 else (2, 1)
        begin = tracks[0, [2, 1]] if forward > 0.0 else tracks[0, [0, 3]]
        return np.concatenate((begin[:1], tracks[:, right], tracks[::-1, left], begin[1:]))


def _gaps(box: Box, x: FloatArray, y: FloatArray) -> FloatArray:
    ahead = np.abs(x - 0.5 * (box.front + box.rear)) - 0.5 * (box.front - box.rear)
    aside = np.abs(y - 0.5 * (box.left + box.right)) - 0.5 * (box.left - box.right)
    gap: FloatArray = np.hypot(np.maximum(ahead, 0.0), np.maximum(aside, 0.0))
    gap += np.minimum(np.maximum(ahead, aside), 0.0)
    return gap
