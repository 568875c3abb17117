"""The inertial unit: mean rates and specific forces with constant bias and white noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from localization.types import Inertial
from robot_sim.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class InertialConfig:
    """Errors of a small MEMS unit; one reading is the mean over one tick."""

    gyro_noise: float = math.radians(0.15)
    """Standard deviation of one reading [rad/s]; 0.02 deg/sqrt(s) at 50 Hz."""
    gyro_bias_sigma: float = math.radians(0.2)
    """Standard deviation of the constant bias, drawn once per seed [rad/s]."""
    force_noise: float = 0.02
    """[m/s^2]."""
    force_bias_sigma: float = 0.03
    """[m/s^2]."""


class InertialUnit:
    """Adds the unit's errors to true means."""

    def __init__(self, config: InertialConfig, seed: np.random.SeedSequence) -> None:
        self._config = config
        self._rng = np.random.default_rng(seed)
        self._gyro_bias = config.gyro_bias_sigma * self._rng.standard_normal(3)
        self._force_bias = config.force_bias_sigma * self._rng.standard_normal(3)

    def read(self, stamp: int, rate: FloatArray, force: FloatArray) -> Inertial:
        """Return the reading for true means over the tick that ends at ``stamp`` [ns].

        Args:
            stamp: End of the tick [ns].
            rate: (3,) mean angular velocity in ``base_link`` [rad/s].
            force: (3,) mean specific force in ``base_link`` [m/s^2].
        """
        c = self._config
        noise = self._rng.standard_normal((2, 3))
        return Inertial(
            stamp=stamp,
            angular_velocity=rate + self._gyro_bias + c.gyro_noise * noise[0],
            specific_force=force + self._force_bias + c.force_noise * noise[1],
        )
