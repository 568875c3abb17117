"""Windows around a hint or a lost estimate, in which the robot may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.relocalization.search_config import SearchConfig
from localization.types import Pose


@dataclass(frozen=True, slots=True)
class Window:
    """A square of positions in ``map`` and an interval of headings."""

    x: float
    """Middle [m]."""
    y: float
    """Middle [m]."""
    yaw: float
    """Middle of the headings [rad]."""
    half_width: float
    """Half width in x and in y [m]."""
    half_yaw: float
    """Half width in heading [rad]."""

    def holds(self, pose: Pose) -> bool:
        """Return whether a pose is in it."""
        x, y, _ = pose.position.tolist()
        near = max(abs(x - self.x), abs(y - self.y)) <= self.half_width
        return near and abs(wrap_angle(pose.yaw - self.yaw)) <= self.half_yaw


def window_of(
    pose: Pose,
    covariance: FloatArray,
    config: SearchConfig = SearchConfig(),  # noqa: B008  (frozen)
) -> Window:
    """Return the three-sigma window around a pose; all-zero covariance means the default sigma.

    Args:
        pose: centre, ``map_from_base``.
        covariance: (6, 6) in ROS's order. People are wrong by more than they say: the window reaches one default sigma.
        config: the default sigma.
    """
    if not covariance.any():
        sigma, sigma_yaw = config.default_sigma, config.default_sigma_yaw
    else:
        sigma = float(np.sqrt(max(covariance[0, 0], covariance[1, 1])))
        sigma_yaw = float(np.sqrt(covariance[5, 5]))
    return Window(
        float(pose.position[0]),
        float(pose.position[1]),
        pose.yaw,
        max(3.0 * sigma, config.default_sigma),
        float(np.clip(3.0 * sigma_yaw, config.default_sigma_yaw, np.pi)),
    )
