"""The inertial unit's errors."""

from __future__ import annotations

import numpy as np
import pytest

from localization.types import Inertial, Twist
from robot_sim.inertial import InertialConfig, InertialUnit
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds import World


def test_noise_and_bias_have_the_configured_size() -> None:
    config = InertialConfig(gyro_noise=0.01, force_noise=0.05)
    means = []
    for seed in range(60):
        unit = InertialUnit(config, np.random.SeedSequence(seed))
        readings = [unit.read(i, np.zeros(3), np.zeros(3)) for i in range(100)]
        rates = np.array([r.angular_velocity for r in readings])
        forces = np.array([r.specific_force for r in readings])
        assert rates.std(axis=0).mean() == pytest.approx(0.01, rel=0.2)
        assert forces.std(axis=0).mean() == pytest.approx(0.05, rel=0.2)
        means.append(rates.mean(axis=0))
    assert np.std(means) == pytest.approx(np.hypot(config.gyro_bias_sigma, 0.001), rel=0.2)


def test_gyro_integrates_to_the_true_turn(field: World) -> None:
    quiet = InertialConfig(gyro_noise=0.0, gyro_bias_sigma=0.0)
    simulation = Simulation(field, config=SimulationConfig(inertial=quiet, scanners=()))
    simulation.command(Twist.planar(0.3, 0.9))
    turned = sum(
        0.02 * r.angular_velocity[2]
        for _ in range(150)
        for r in simulation.step()
        if isinstance(r, Inertial)
    )
    yaw = simulation.truth().map_from_base.yaw
    assert (turned - yaw + np.pi) % (2.0 * np.pi) - np.pi == pytest.approx(0.0, abs=1e-5)
