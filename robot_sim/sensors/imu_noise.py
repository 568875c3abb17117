"""Noise and bias drift of gyros and accelerometers, and their Allan deviation."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError

PEAK: Final = 0.6183
"""Peak of the Allan deviation of a first-order Gauss-Markov process over its sigma, at 1.89
correlation times (IEEE Std 952, annex C: 0.437 q sqrt(T), with sigma = q sqrt(T / 2))."""


@dataclass(frozen=True, slots=True)
class Drift:
    """Errors of one kind of axis (gyro or accelerometer), in units of its readings and seconds.

    The Allan variance at t is noise^2 / t, plus that of the bias instability's process, plus
    walk^2 t / 3.
    """

    noise: float
    """Random walk of the integral (angle, velocity): density of the white noise [unit sqrt(s)]."""
    bias_sigma: float = 0.0
    """Standard deviation of the bias at switch-on, drawn once per seed [unit]."""
    instability: float = 0.0
    """Bias instability: minimum of the Allan deviation [unit]."""
    correlation: float = 100.0
    """Correlation time of the first-order Gauss-Markov process that models it [s]."""
    walk: float = 0.0
    """Random walk of the bias (rate random walk) [unit / sqrt(s)]."""
    full_scale: float = math.inf
    """Greatest absolute reading [unit]."""
    quantum: float = 0.0
    """Resolution of readings [unit]; 0 for none."""

    def __post_init__(self) -> None:
        for name in (f.name for f in fields(self)):
            value = getattr(self, name)
            if not value >= 0.0 or (math.isinf(value) and name != "full_scale"):
                raise SensorError(f"{name} must be >= 0 and finite, got {value}")
        for name in ("correlation", "full_scale"):
            if getattr(self, name) <= 0.0:
                raise SensorError(f"{name} must be > 0, got {getattr(self, name)}")
        if self.quantum > self.full_scale:
            raise SensorError(
                f"quantum must be at most full_scale, {self.full_scale:g}, got {self.quantum:g}"
            )

    @property
    def drifts(self) -> bool:
        """Whether the bias changes with time."""
        return self.instability > 0.0 or self.walk > 0.0

    def allan_deviation(self, times: FloatArray) -> FloatArray:
        """Return the Allan deviation (N,) at averaging ``times`` (N,) [s], by IEEE Std 952, annex C."""
        x = times / self.correlation
        sigma = self.instability / PEAK
        markov = (
            2.0 * sigma**2 / x * (1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x))
        )
        return np.asarray(np.sqrt(self.noise**2 / times + markov + self.walk**2 * times / 3.0))


NO_DRIFT: Final = Drift(0.0)
"""An axis without errors."""


def allan_deviation(values: FloatArray, dt: float, times: FloatArray) -> FloatArray:
    """Return the overlapping Allan deviation (T, A) of consecutive readings.

    Args:
        values: (N, A) readings of A axes, each the mean over ``dt``.
        dt: Interval of the readings [s].
        times: (T,) averaging times [s], at most half of N ``dt``; rounded to integer readings.
    """
    angles = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0) * dt])
    deviations = []
    for time in times:
        m = max(round(float(time) / dt), 1)
        ends = angles[2 * m :] - 2.0 * angles[m:-m] + angles[: -2 * m]
        deviations.append(np.sqrt((ends**2).mean(axis=0) / 2.0) / (m * dt))
    return np.array(deviations)
