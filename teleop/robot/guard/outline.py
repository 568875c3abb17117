"""The robot's outline on the floor, and how near points are to it along a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray


@dataclass(frozen=True, slots=True)
class Outline:
    """A rectangle around the robot in ``base_link``."""

    front: float
    """Distance of the front from ``base_link`` [m]."""
    rear: float
    """Distance of the rear from it [m]."""
    half_width: float
    """Half its width, wheels included [m]."""

    def __post_init__(self) -> None:
        for name in ("front", "rear", "half_width"):
            if not 0.0 < getattr(self, name) < 5.0:
                raise ValueError(f"outline {name} must be > 0 and < 5 m, got {getattr(self, name)}")

    @property
    def radius(self) -> float:
        """Distance of its farthest corner from ``base_link`` [m]."""
        return math.hypot(max(self.front, self.rear), self.half_width)

    def gaps(self, poses: FloatArray, points: FloatArray) -> FloatArray:
        """Return the distances (..., N) of points from the outline at poses [m], negative inside it.

        Args:
            poses: (..., 3) x, y [m] and yaw [rad].
            points: (N, 2) in the frame of the poses [m].
        """
        dx = points[:, 0] - poses[..., 0:1]
        dy = points[:, 1] - poses[..., 1:2]
        c, s = np.cos(poses[..., 2:3]), np.sin(poses[..., 2:3])
        middle, half_length = 0.5 * (self.front - self.rear), 0.5 * (self.front + self.rear)
        ahead = np.abs(c * dx + s * dy - middle) - half_length
        aside = np.abs(c * dy - s * dx) - self.half_width
        gap: FloatArray = np.hypot(np.maximum(ahead, 0.0), np.maximum(aside, 0.0))
        gap += np.minimum(np.maximum(ahead, aside), 0.0)
        return gap

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
