"""Inertial unit: mean rates and specific forces with noise, drifting biases, range and resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.types import Inertial
from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError
from robot_sim.sensors.imu_models import INERTIAL_UNITS
from robot_sim.sensors.imu_noise import NO_DRIFT, PEAK, Drift

READING_SECONDS: Final = 0.02
"""Duration over which one reading is the mean: one tick [s]."""
ZEROING_SECONDS: Final = 5.0
"""Duration for which drivers average gyros at rest [s]; chosen."""
_BLOCK: Final = 64
"""Number of readings whose biases are computed at once."""


@dataclass(frozen=True, slots=True)
class InertialConfig:
    """Errors of an inertial unit; the defaults are those of a small MEMS unit with constant biases."""

    gyro_noise: float = math.radians(0.15)
    """Standard deviation of one angular velocity [rad/s]; 0.02 deg/sqrt(s) at 50 Hz."""
    gyro_bias_sigma: float = math.radians(0.2)
    """Standard deviation of the gyro bias at switch-on, drawn once per seed [rad/s]."""
    force_noise: float = 0.02
    """Standard deviation of one specific force [m/s^2]."""
    force_bias_sigma: float = 0.03
    """Standard deviation of the accelerometer bias at switch-on, drawn once per seed [m/s^2]."""
    gyro_drift: Drift = NO_DRIFT
    """Further errors of a gyro; ``noise`` and ``bias_sigma`` of it are replaced by the fields above."""
    force_drift: Drift = NO_DRIFT
    """Further errors of an accelerometer; ``noise`` and ``bias_sigma`` as for ``gyro_drift``."""
    model: str = ""
    """Name of the model that this was built from."""

    @classmethod
    def of(cls, model: str, *, zeroed: bool = True) -> InertialConfig:
        """Build from a model's data sheet.

        Args:
            model: A key of ``INERTIAL_UNITS``.
            zeroed: Whether the driver has averaged the gyros over ``ZEROING_SECONDS`` at rest and
                subtracts the mean, as drivers of bare sensors do; the noise of that mean remains of
                the bias. Accelerometers cannot be zeroed this way: they measure the floor's tilt.

        Raises:
            SensorError: There is no such model; the message lists the available ones.
        """
        if model not in INERTIAL_UNITS:
            known = ", ".join(INERTIAL_UNITS)
            raise SensorError(f"no inertial unit named {model!r}; available: {known}")
        sheet = INERTIAL_UNITS[model]
        per_reading = 1.0 / math.sqrt(READING_SECONDS)
        rest = sheet.gyro.noise / math.sqrt(ZEROING_SECONDS)
        return cls(
            gyro_noise=sheet.gyro.noise * per_reading,
            gyro_bias_sigma=min(rest, sheet.gyro.bias_sigma) if zeroed else sheet.gyro.bias_sigma,
            force_noise=sheet.force.noise * per_reading,
            force_bias_sigma=sheet.force.bias_sigma,
            gyro_drift=sheet.gyro,
            force_drift=sheet.force,
            model=model,
        )

    def __post_init__(self) -> None:
        for name in ("gyro_noise", "gyro_bias_sigma", "force_noise", "force_bias_sigma"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise SensorError(f"{name} must be >= 0 and finite, got {getattr(self, name)}")


class InertialUnit:
    """Adds the unit's errors to true means of angular velocity and specific force."""

    def __init__(self, config: InertialConfig, seed: np.random.SeedSequence) -> None:
        self._config = config
        self._rng = np.random.default_rng(seed)
        gyro = config.gyro_bias_sigma * self._rng.standard_normal(3)
        force = config.force_bias_sigma * self._rng.standard_normal(3)
        self._biases = np.stack([gyro, force])
        # A stream of its own, so that a drifting bias does not change the noise.
        self._drift_rng = np.random.default_rng(
            np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 0))
        )
        drifts = (config.gyro_drift, config.force_drift)
        self._noise = np.array([[config.gyro_noise], [config.force_noise]])
        self._drifts = any(drift.drifts for drift in drifts)
        self._decay = np.array([math.exp(-READING_SECONDS / d.correlation) for d in drifts])
        spread = np.array([d.instability / PEAK for d in drifts])
        self._kick = spread * np.sqrt(1.0 - self._decay**2)
        self._walk = np.array([d.walk * math.sqrt(READING_SECONDS) for d in drifts])
        self._markov = np.zeros((2, 3))
        if self._drifts:
            self._markov = spread[:, None] * self._drift_rng.standard_normal((2, 3))
        self._full_scale = np.array([d.full_scale for d in drifts])
        self._quantum = np.array([d.quantum for d in drifts])
        self._digital = bool((self._quantum > 0.0).any() or np.isfinite(self._full_scale).any())

    def read(self, stamp: int, rate: FloatArray, force: FloatArray) -> Inertial:
        """Return the reading for the true means over the tick that ends at ``stamp`` [ns].

        Args:
            stamp: End of the tick [ns].
            rate: (3,) mean angular velocity in ``base_link`` [rad/s].
            force: (3,) mean specific force in ``base_link`` [m/s^2].
        """
        truth = np.empty((1, 2, 3))
        truth[0, 0], truth[0, 1] = rate, force
        reading = self.readings(truth)
        return Inertial(stamp=stamp, angular_velocity=reading[0, 0], specific_force=reading[0, 1])

    def readings(self, truths: FloatArray) -> FloatArray:
        """Return the next N readings, (N, 2, 3): rates [rad/s] and specific forces [m/s^2].

        One call for N readings gives the same as N calls of ``read``, up to rounding, and much faster.

        Args:
            truths: (N, 2, 3) true means over consecutive ticks.
        """
        n = len(truths)
        noise = self._noise * self._rng.standard_normal((n, 2, 3))
        values = truths + self._biases + noise
        if self._drifts:
            values += self._drift(n)
        if self._digital:
            values = self._digitised(values)
        return np.asarray(values)

    def _drift(self, n: int) -> FloatArray:
        """Return the next n deviations (n, 2, 3) of the biases from their first value."""
        draws = self._drift_rng.standard_normal((n, 2, 2, 3))
        walked = np.cumsum(self._walk[:, None] * draws[:, 1], axis=0)
        values = np.empty((n, 2, 3))
        kicks = self._kick[:, None] * draws[:, 0]
        # In blocks, x_k = a^k (x_0 + sum of w_j / a^j); short ones, so that a^k stays far from zero.
        for first in range(0, n, _BLOCK):
            block = slice(first, min(first + _BLOCK, n))
            powers = self._decay[:, None] ** np.arange(1, block.stop - first + 1)[:, None, None]
            values[block] = powers * (self._markov + np.cumsum(kicks[block] / powers, axis=0))
            self._markov = values[block.stop - 1].copy()
        values += walked
        self._biases = self._biases + walked[-1]
        return values

    def _digitised(self, values: FloatArray) -> FloatArray:
        steps = np.where(self._quantum > 0.0, self._quantum, 1.0)[:, None]
        whole = np.rint(values / steps) * steps
        values = np.where((self._quantum > 0.0)[:, None], whole, values)
        limits = self._full_scale[:, None]
        return np.clip(values, -limits, limits)
