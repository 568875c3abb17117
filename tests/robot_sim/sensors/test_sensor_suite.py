"""Sensor suites by the names of scanner and inertial unit."""

from __future__ import annotations

import pytest

from robot_sim.errors import SensorError
from robot_sim.sensors.imu import InertialConfig
from robot_sim.sensors.lidar_effects import Effects
from robot_sim.sensors.lidar_models import LIDARS
from robot_sim.sensors.sensor_suite import sensor_suite
from robot_sim.simulation import SimulationConfig


def test_default_suite_is_the_simulations_own() -> None:
    suite, config = sensor_suite(), SimulationConfig()
    assert suite.scanners == config.scanners
    assert suite.inertial == config.inertial


@pytest.mark.parametrize("model", LIDARS)
def test_suite_mounts_a_model_twice(model: str) -> None:
    suite = sensor_suite(model, "xsens_mti630", realistic=True)
    assert [s.name for s in suite.scanners] == ["laser_horizontal", "laser_vertical"]
    assert {s.model for s in suite.scanners} == {model}
    assert all(s.effects.panes is not None for s in suite.scanners)
    # Indoors there is no effect of daylight.
    assert all(s.effects.sunlight is None for s in suite.scanners)
    assert suite.inertial == InertialConfig.of("xsens_mti630")


def test_default_scanner_can_be_realistic_under_the_sun() -> None:
    (scanner, _) = sensor_suite(realistic=True, sun=0.5).scanners
    assert scanner.period_ns == 100_000_000
    assert scanner.effects.sunlight is not None
    assert scanner.effects.sunlight.level == 0.5
    assert sensor_suite(sun=0.5).scanners[0].effects == Effects()


def test_invalid_suite_is_rejected_by_name() -> None:
    with pytest.raises(SensorError, match="no lidar model named 'velodyne'"):
        sensor_suite("velodyne")
    with pytest.raises(SensorError, match="no inertial unit named 'gyro'"):
        sensor_suite(inertial="gyro")
    with pytest.raises(SensorError, match=r"default scanner has 10 Hz.*sick_lms111"):
        sensor_suite(rate_hz=25.0)
    with pytest.raises(SensorError, match="level must be a share"):
        sensor_suite("sick_lms111", realistic=True, sun=3.0)
