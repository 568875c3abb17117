"""The inertial unit: mean rates and specific forces with biases that wander, noise, range and steps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from localization.types import Inertial
from robot_sim.array_types import FloatArray
from robot_sim.errors import SensorError

READING_SECONDS: Final = 0.02
"""One reading is the mean over one tick [s]."""

ZEROING_SECONDS: Final = 5.0
"""How long drivers average gyros at rest [s]; chosen."""

STANDARD_GRAVITY: Final = 9.80665
"""What data sheets call 1 g [m/s^2]; BIPM, SI brochure."""

PEAK: Final = 0.6183
"""Peak of the Allan deviation of a first-order Gauss-Markov process over its sigma; it is at 1.89
correlation times (IEEE Std 952, annex C: 0.437 q sqrt(T), with sigma = q sqrt(T / 2))."""


_BLOCK: Final = 64
"""Readings whose biases are worked out at once."""


@dataclass(frozen=True, slots=True)
class Drift:
    """How one kind of axis (gyro or accelerometer) errs; units are those of its readings, and seconds.

    Its Allan variance at t is noise^2 / t, and what the bias instability's process adds, and
    walk^2 t / 3.
    """

    noise: float
    """Random walk of the integral (angle, velocity): density of the white noise [unit sqrt(s)]."""
    bias_sigma: float = 0.0
    """Standard deviation of the bias at switch-on, drawn once per seed."""
    instability: float = 0.0
    """Bias instability: the height of the Allan deviation's floor."""
    correlation: float = 100.0
    """Of the first-order Gauss-Markov process that stands for it [s]."""
    walk: float = 0.0
    """Random walk of the bias (rate random walk) [unit / sqrt(s)]."""
    full_scale: float = math.inf
    """Greatest reading that can be told."""
    quantum: float = 0.0
    """Step of readings; 0 for none."""

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
    def wanders(self) -> bool:
        """Whether the bias changes at all."""
        return self.instability > 0.0 or self.walk > 0.0

    def allan_deviation(self, times: FloatArray) -> FloatArray:
        """Return the Allan deviation (N,) at averaging ``times`` (N,) [s], by IEEE Std 952, annex C."""
        x = times / self.correlation
        sigma = self.instability / PEAK
        markov = (
            2.0 * sigma**2 / x * (1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x))
        )
        return np.asarray(np.sqrt(self.noise**2 / times + markov + self.walk**2 * times / 3.0))


def allan_deviation(values: FloatArray, dt: float, times: FloatArray) -> FloatArray:
    """Return the overlapping Allan deviation (T, A) of readings that follow each other.

    Args:
        values: (N, A) readings of A axes, each the mean over ``dt``.
        dt: [s].
        times: (T,) averaging times [s], each at most half of N ``dt``; rounded to whole readings.
    """
    angles = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0) * dt])
    deviations = []
    for time in times:
        m = max(round(float(time) / dt), 1)
        ends = angles[2 * m :] - 2.0 * angles[m:-m] + angles[: -2 * m]
        deviations.append(np.sqrt((ends**2).mean(axis=0) / 2.0) / (m * dt))
    return np.array(deviations)


@dataclass(frozen=True, slots=True)
class InertialConfig:
    """Errors of an inertial unit; the defaults are a small MEMS unit's, with constant biases."""

    gyro_noise: float = math.radians(0.15)
    """Standard deviation of one reading [rad/s]; 0.02 deg/sqrt(s) at 50 Hz."""
    gyro_bias_sigma: float = math.radians(0.2)
    """Standard deviation of the bias at switch-on, drawn once per seed [rad/s]."""
    force_noise: float = 0.02
    """[m/s^2]."""
    force_bias_sigma: float = 0.03
    """[m/s^2]."""
    gyro_drift: Drift = Drift(0.0)
    """What else a gyro does; its ``noise`` and ``bias_sigma`` are told by the fields above."""
    force_drift: Drift = Drift(0.0)
    """What else an accelerometer does; as above."""
    model: str = ""
    """Name of the model this was made from."""

    @classmethod
    def of(cls, model: str, *, zeroed: bool = True) -> InertialConfig:
        """Build from a model's data sheet.

        Args:
            model: A key of ``INERTIAL_UNITS``.
            zeroed: Whether the driver has averaged the gyros over ``ZEROING_SECONDS`` at rest and takes
                that off, as drivers of bare sensors do; what is left of the bias at switch-on is
                that average's noise. Accelerometers cannot be zeroed so: they feel the floor's tilt.

        Raises:
            SensorError: There is no such model; the message lists those there are.
        """
        if model not in INERTIAL_UNITS:
            known = ", ".join(INERTIAL_UNITS)
            raise SensorError(f"no inertial unit named {model!r}; there are: {known}")
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
    """Adds the unit's errors to true means."""

    def __init__(self, config: InertialConfig, seed: np.random.SeedSequence) -> None:
        self._config = config
        self._rng = np.random.default_rng(seed)
        gyro = config.gyro_bias_sigma * self._rng.standard_normal(3)
        force = config.force_bias_sigma * self._rng.standard_normal(3)
        self._biases = np.stack([gyro, force])
        # A stream of its own: a bias that wanders leaves the noise as it is.
        self._drift_rng = np.random.default_rng(
            np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 0))
        )
        drifts = (config.gyro_drift, config.force_drift)
        self._noise = np.array([[config.gyro_noise], [config.force_noise]])
        self._wanders = any(drift.wanders for drift in drifts)
        self._decay = np.array([math.exp(-READING_SECONDS / d.correlation) for d in drifts])
        spread = np.array([d.instability / PEAK for d in drifts])
        self._kick = spread * np.sqrt(1.0 - self._decay**2)
        self._walk = np.array([d.walk * math.sqrt(READING_SECONDS) for d in drifts])
        self._markov = np.zeros((2, 3))
        if self._wanders:
            self._markov = spread[:, None] * self._drift_rng.standard_normal((2, 3))
        self._full_scale = np.array([d.full_scale for d in drifts])
        self._quantum = np.array([d.quantum for d in drifts])
        self._digital = bool((self._quantum > 0.0).any() or np.isfinite(self._full_scale).any())

    def read(self, stamp: int, rate: FloatArray, force: FloatArray) -> Inertial:
        """Return the reading for true means over the tick that ends at ``stamp`` [ns].

        Args:
            stamp: End of the tick [ns].
            rate: (3,) mean angular velocity in ``base_link`` [rad/s].
            force: (3,) mean specific force in ``base_link`` [m/s^2].
        """
        truth = np.empty((1, 2, 3))
        truth[0, 0], truth[0, 1] = rate, force
        told = self.readings(truth)
        return Inertial(stamp=stamp, angular_velocity=told[0, 0], specific_force=told[0, 1])

    def readings(self, truths: FloatArray) -> FloatArray:
        """Return the next N readings, (N, 2, 3): rates [rad/s] and specific forces [m/s^2].

        One call for hours gives what as many calls of ``read`` give, to rounding, and much faster.

        Args:
            truths: (N, 2, 3) true means over ticks that follow each other.
        """
        n = len(truths)
        noise = self._noise * self._rng.standard_normal((n, 2, 3))
        told = truths + self._biases + noise
        if self._wanders:
            told += self._wander(n)
        if self._digital:
            told = self._digitised(told)
        return np.asarray(told)

    def _wander(self, n: int) -> FloatArray:
        """Return the next n values (n, 2, 3) of what the biases add to their first value."""
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


@dataclass(frozen=True, slots=True)
class InertialModel:
    """An inertial unit one can buy."""

    name: str
    title: str
    gyro: Drift
    """[rad/s]."""
    force: Drift
    """[m/s^2]."""
    sources: Mapping[str, str]
    """By the figure's name. (M): from memory of the sheet, not checked against it."""


_DEGREE: Final = math.radians(1.0)
_MICRO_G: Final = 1e-6 * STANDARD_GRAVITY
_WALK: Final = "not on the sheet; chosen so that the walk reaches the bias instability after an hour's averaging"


def _hourly(instability: float) -> float:
    """Return the random walk whose Allan deviation is ``instability`` at an hour."""
    return instability / math.sqrt(3600.0 / 3.0)


_CATALOGUE: Final = (
    InertialModel(
        name="xsens_mti630",
        title="Xsens MTi-630",
        gyro=Drift(
            noise=0.007 * _DEGREE,
            bias_sigma=0.2 * _DEGREE,
            instability=8.0 * _DEGREE / 3600.0,
            walk=_hourly(8.0 * _DEGREE / 3600.0),
            full_scale=2000.0 * _DEGREE,
        ),
        force=Drift(
            noise=60.0 * _MICRO_G,
            bias_sigma=0.03,
            instability=15.0 * _MICRO_G,
            walk=_hourly(15.0 * _MICRO_G),
            full_scale=10.0 * STANDARD_GRAVITY,
        ),
        sources={
            "noise": "Xsens MTi 600-series data sheet: 0.007 deg/s/sqrt(Hz), 60 ug/sqrt(Hz)",
            "instability": "as above: in-run bias stability 8 deg/h, 10 (x, y) and 15 ug (z)",
            "bias_sigma": "as above: bias repeatability over a year 0.2 deg/s, 0.03 m/s^2 (M)",
            "full_scale": "as above: 2000 deg/s, 10 g (M)",
            "correlation": "not on the sheet; 100 s chosen, where such units' floors begin",
            "walk": _WALK,
            "quantum": "floating point numbers: none",
        },
    ),
    InertialModel(
        name="bosch_bmi088",
        title="Bosch Sensortec BMI088, at 250 deg/s and 6 g",
        gyro=Drift(
            noise=0.014 * _DEGREE,
            bias_sigma=1.0 * _DEGREE,
            instability=2.0 * _DEGREE / 3600.0,
            walk=_hourly(2.0 * _DEGREE / 3600.0),
            full_scale=250.0 * _DEGREE,
            quantum=_DEGREE / 131.072,
        ),
        force=Drift(
            noise=175.0 * _MICRO_G,
            bias_sigma=0.020 * STANDARD_GRAVITY,
            instability=40.0 * _MICRO_G,
            walk=_hourly(40.0 * _MICRO_G),
            full_scale=6.0 * STANDARD_GRAVITY,
            quantum=STANDARD_GRAVITY / 5460.0,
        ),
        sources={
            "noise": "BST-BMI088-DS001: 0.014 deg/s/sqrt(Hz); 160 (x, y) and 190 ug/sqrt(Hz) (z) (M)",
            "instability": "gyro < 2 deg/h (M); accelerometer not on the sheet, 40 ug chosen",
            "bias_sigma": "BST-BMI088-DS001: zero-rate offset 1 deg/s, zero-g offset 20 mg (M)",
            "full_scale": "BST-BMI088-DS001: settings 250 deg/s and 6 g",
            "correlation": "not on the sheet; 100 s chosen",
            "walk": _WALK,
            "quantum": "BST-BMI088-DS001: 131.072 steps per deg/s, 5460 per g (M)",
        },
    ),
)

INERTIAL_UNITS: Final = {model.name: model for model in _CATALOGUE}
"""By name."""
