"""Sensor suite: all sensors of the robot from the names of a scanner and an inertial unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from robot_sim.errors import SensorError
from robot_sim.robot.p3at import MOUNTS
from robot_sim.sensors.imu import InertialConfig
from robot_sim.sensors.lidar_effects import NO_EFFECTS
from robot_sim.sensors.lidar_models import LIDARS, lidar_model
from robot_sim.sensors.scanner_config import ScannerConfig

DEFAULT_SENSORS: Final = "default"
"""Name of the default sensors of a simulation."""


@dataclass(frozen=True, slots=True)
class SensorSuite:
    """Sensors for ``SimulationConfig(scanners=s.scanners, inertial=s.inertial)``."""

    scanners: tuple[ScannerConfig, ...]
    """Configurations of the scanners."""
    inertial: InertialConfig
    """Configuration of the inertial unit."""


def sensor_suite(
    scanner: str = DEFAULT_SENSORS,
    inertial: str = DEFAULT_SENSORS,
    *,
    rate_hz: float | None = None,
    resolution_deg: float | None = None,
    realistic: bool = False,
    sun: float = 0.0,
) -> SensorSuite:
    """Build both scanners and the inertial unit from their models' names.

    Args:
        scanner: A key of ``LIDARS``, or ``default``: an LMS1xx at 10 Hz that sees from 0.1 m.
        inertial: A key of ``INERTIAL_UNITS``, or ``default``.
        rate_hz: Pictures per second of a scanner; the model's default if not given.
        resolution_deg: Resolution of a scanner [deg]; the model's default if not given.
        realistic: Whether the scanners have all effects, with their model's figures. Effects of the
            default scanner are the LMS111's.
        sun: Irradiance as a share of full sun, for the effect of daylight; 0 is indoors.

    Raises:
        SensorError: There is no such name, or no such rate or resolution of that model.
    """
    unit = InertialConfig() if inertial == DEFAULT_SENSORS else InertialConfig.of(inertial)
    if scanner != DEFAULT_SENSORS:
        scanners = tuple(
            ScannerConfig.of(
                name,
                scanner,
                rate_hz=rate_hz,
                resolution_deg=resolution_deg,
                realistic=realistic,
                sun=sun,
            )
            for name in MOUNTS
        )
        return SensorSuite(scanners, unit)
    if rate_hz is not None or resolution_deg is not None:
        raise SensorError(
            "rate_hz and resolution_deg: the default scanner has 10 Hz and 0.5 deg only; for others name"
            f" a model: {', '.join(LIDARS)}"
        )
    effects = lidar_model("sick_lms111").effects(sun=sun) if realistic else NO_EFFECTS
    return SensorSuite(tuple(ScannerConfig(name, effects=effects) for name in MOUNTS), unit)
