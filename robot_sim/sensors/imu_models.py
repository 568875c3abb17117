"""Inertial units by name, with the figures of their data sheets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from robot_sim.sensors.imu_noise import Drift

STANDARD_GRAVITY: Final = 9.80665
"""Acceleration that data sheets call 1 g [m/s^2]; BIPM, SI brochure."""


@dataclass(frozen=True, slots=True)
class InertialModel:
    """A commercial inertial unit."""

    name: str
    """Key of the model."""
    title: str
    """Maker and product."""
    gyro: Drift
    """Errors of the gyros [rad/s]."""
    force: Drift
    """Errors of the accelerometers [m/s^2]."""
    sources: Mapping[str, str]
    """Source of each figure. (M): from memory of the sheet, not checked against it."""


_DEGREE: Final = math.radians(1.0)
_MICRO_G: Final = 1e-6 * STANDARD_GRAVITY
_WALK: Final = "not on the sheet; chosen so that the walk reaches the bias instability after an hour's averaging"


def _hourly(instability: float) -> float:
    """Return the random walk whose Allan deviation equals ``instability`` at one hour."""
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
"""Inertial units by name."""
