"""The encoders: from turning wheels to rim speeds."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.types import WheelSpeeds
from robot_sim.arrays import FloatArray
from robot_sim.drive import DriveConfig
from robot_sim.skid_steer import SkidSteer

COUNTS_PER_TURN: Final = 500 * 4 * 49.8
"""Encoder edges per wheel turn: 500 lines, four edges each, gear 49.8:1 (the manual, as
quoted by others)."""


class Encoders:
    """Count the edges of both sides and report their mean rim speeds."""

    def __init__(self, config: DriveConfig, robot: SkidSteer, seed: np.random.SeedSequence) -> None:
        self._config = config
        self._metres_per_count = 2.0 * math.pi * robot.rolling_radius / COUNTS_PER_TURN
        self._rng = np.random.default_rng(seed)
        self._scale = 1.0 + config.encoder_scale_sigma * self._rng.standard_normal(2)
        self._angles: FloatArray = np.zeros(2)

    def read(self, stamp: int, angles: FloatArray, dt: float) -> WheelSpeeds:
        """Return the speeds over the ``dt`` [s] that end at ``stamp`` [ns].

        Args:
            stamp: End of the interval [ns].
            angles: (2,) angle of the left and the right wheels [rad].
            dt: Length of the interval [s].
        """
        to_counts = COUNTS_PER_TURN / (2.0 * math.pi)
        counts = np.rint(angles * to_counts) - np.rint(self._angles * to_counts)
        self._angles = np.array(angles, dtype=float)
        speeds = self._scale * counts * self._metres_per_count / dt
        for slip in self._config.slips:
            if slip.active(stamp):
                speeds = slip.factor * speeds
        noise = self._config.encoder_noise * self._rng.standard_normal(2)
        # Wheels that did not move give no edges, hence no noise.
        measured = np.where(counts != 0.0, speeds + noise, 0.0).astype(np.float32)
        return WheelSpeeds(stamp, float(measured[0]), float(measured[1]))
