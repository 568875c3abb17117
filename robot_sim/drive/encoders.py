"""Wheel encoders: counts of the turning wheels, reported as rim speeds."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.types import WheelSpeeds
from robot_sim.array_types import FloatArray
from robot_sim.drive.drivetrain import DriveConfig
from robot_sim.robot.skid_steer_parameters import SkidSteer

COUNTS_PER_TURN: Final = 500 * 4 * 49.8
"""Encoder edges per wheel turn: 500 lines, four edges each, gear 49.8:1 (the manual, as quoted by
others)."""
_PER_RADIAN: Final = COUNTS_PER_TURN / (2.0 * math.pi)


class Encoders:
    """Count the edges of both sides and report their mean rim speeds."""

    def __init__(self, config: DriveConfig, robot: SkidSteer, seed: np.random.SeedSequence) -> None:
        self._config = config
        self._metres_per_count = 2.0 * math.pi * robot.rolling_radius / COUNTS_PER_TURN
        self._rng = np.random.default_rng(seed)
        scale = 1.0 + config.encoder_scale_sigma * self._rng.standard_normal(2)
        self._scale: list[float] = scale.tolist()
        self._counts = [0, 0]
        self.slips = list(config.slips)
        """Injected faults."""

    def read(self, stamp: int, angles: FloatArray, dt: float) -> WheelSpeeds:
        """Return the rim speeds over the interval ``dt`` [s] that ends at ``stamp`` [ns].

        Args:
            stamp: End of the interval [ns].
            angles: (2,) angles of the left and the right wheels [rad].
            dt: Length of the interval [s].
        """
        noise = self._config.encoder_noise
        draws = self._rng.standard_normal(2).tolist()
        measured = []
        # For two sides plain numbers are three times faster than NumPy.
        for side, angle in enumerate(angles.tolist()):
            total = round(angle * _PER_RADIAN)
            counts, self._counts[side] = total - self._counts[side], total
            speed = self._scale[side] * counts * self._metres_per_count / dt
            for slip in self.slips:
                if slip.active(stamp):
                    speed = slip.factor * speed
            # Wheels that did not move give no edges, and hence no noise.
            measured.append(speed + noise * draws[side] if counts else 0.0)
        left, right = measured
        # Rounded to float32, the resolution of the message.
        return WheelSpeeds(stamp, float(np.float32(left)), float(np.float32(right)))
