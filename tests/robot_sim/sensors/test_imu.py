"""The inertial unit's errors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest

from localization.types import Inertial, Twist
from robot_sim.errors import SimulationError
from robot_sim.sensors.imu import READING_SECONDS, InertialConfig, InertialUnit
from robot_sim.sensors.imu_models import INERTIAL_UNITS, InertialModel
from robot_sim.sensors.imu_noise import Drift, allan_deviation
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds.world import World


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


@pytest.fixture(scope="module", params=["xsens_mti630", "bosch_bmi088"])
def at_rest(request: pytest.FixtureRequest) -> tuple[InertialModel, np.ndarray]:
    """Six hours of a unit's readings at rest, (N, 2, 3), without the steps of its output."""
    model = INERTIAL_UNITS[request.param]
    config = InertialConfig.of(request.param)
    config = replace(
        config,
        gyro_drift=replace(config.gyro_drift, quantum=0.0),
        force_drift=replace(config.force_drift, quantum=0.0),
    )
    unit = InertialUnit(config, np.random.SeedSequence(4))
    hour = round(3600.0 / READING_SECONDS)
    return model, np.vstack([unit.readings(np.zeros((hour, 2, 3))) for _ in range(6)])


@pytest.mark.slow
@pytest.mark.parametrize("kind", [0, 1], ids=["gyro", "accelerometer"])
def test_allan_deviation_gives_the_data_sheets_numbers_back(
    at_rest: tuple[InertialModel, np.ndarray], kind: int
) -> None:
    model, readings = at_rest
    drift = (model.gyro, model.force)[kind]
    times = np.array([0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 60.0, 120.0, 189.0, 300.0])
    # Three axes are three units of one make: their variances are averaged.
    variance = (allan_deviation(readings[:, kind], READING_SECONDS, times) ** 2).mean(axis=1)
    measured = np.sqrt(variance)
    # Noise density: the slope of -1/2, read at 1 s, as data sheets do. 65 000 terms: 1 %.
    assert measured[2] == pytest.approx(drift.noise, rel=0.02)
    np.testing.assert_allclose(measured[:4] / drift.allan_deviation(times[:4]), 1.0, atol=0.03)
    # Bias instability: what the floor has over noise and walk. At 189 s there are 114 clusters on each
    # of three axes, so the deviation is good to some 5 %, and the part of it that is the floor to 10 %.
    floor = times == 189.0
    rest = drift.noise**2 / times[floor] + drift.walk**2 * times[floor] / 3.0
    assert np.sqrt(variance[floor] - rest) == pytest.approx(drift.instability, rel=0.2)
    np.testing.assert_allclose(measured[4:] / drift.allan_deviation(times[4:]), 1.0, atol=0.12)


def test_allan_deviation_by_hand() -> None:
    values = np.array([[1.0], [3.0], [2.0], [6.0]])
    # Neighbours differ by 2, -1 and 4; pairs of means by 2: half the mean square, and its root.
    expected = [[math.sqrt((4.0 + 1.0 + 16.0) / 3.0 / 2.0)], [math.sqrt(2.0**2 / 2.0)]]
    np.testing.assert_allclose(allan_deviation(values, 0.5, np.array([0.5, 1.0])), expected)


@pytest.mark.slow
def test_rate_random_walk_is_the_configured_one() -> None:
    walk = Drift(noise=0.0, walk=2e-4)
    unit = InertialUnit(
        InertialConfig(gyro_noise=0.0, gyro_bias_sigma=0.0, gyro_drift=walk),
        np.random.SeedSequence(1),
    )
    ends = np.array([unit.readings(np.zeros((500, 2, 3)))[-1, 0] for _ in range(2000)])
    # Ten seconds apart: sigma is walk x sqrt(10).
    steps = np.diff(ends, axis=0)
    assert steps.std() == pytest.approx(2e-4 * np.sqrt(10.0), rel=0.03)
    slope = allan_deviation(ends, 10.0, np.array([200.0, 800.0])).mean(axis=1)
    assert slope[1] / slope[0] == pytest.approx(2.0, rel=0.35)


def test_batch_of_readings_equals_single_readings() -> None:
    config = InertialConfig.of("bosch_bmi088")
    truths = np.random.default_rng(1).standard_normal((150, 2, 3))
    at_once = InertialUnit(config, np.random.SeedSequence(7)).readings(truths)
    unit = InertialUnit(config, np.random.SeedSequence(7))
    one_by_one = [unit.read(i, *truth) for i, truth in enumerate(truths)]
    np.testing.assert_allclose(
        at_once, [[r.angular_velocity, r.specific_force] for r in one_by_one], atol=1e-12
    )


def test_drifting_bias_does_not_change_the_noise() -> None:
    still = np.zeros((100, 2, 3))
    plain = InertialUnit(InertialConfig(), np.random.SeedSequence(3)).readings(still)
    drift = Drift(0.0, instability=1e-3, walk=1e-4)
    unit = InertialUnit(InertialConfig(gyro_drift=drift), np.random.SeedSequence(3))
    wandering = unit.readings(still)
    np.testing.assert_array_equal(wandering[:, 1], plain[:, 1])
    # What is left without the noise moves slowly.
    assert np.abs(np.diff(wandering[:, 0] - plain[:, 0], axis=0)).max() < 1.5e-4


def test_readings_are_limited_to_full_scale_and_quantised() -> None:
    drift = Drift(0.0, full_scale=2.0, quantum=0.25)
    config = InertialConfig(
        gyro_noise=0.0, gyro_bias_sigma=0.0, force_noise=0.0, force_bias_sigma=0.0, gyro_drift=drift
    )
    unit = InertialUnit(config, np.random.SeedSequence(0))
    reading = unit.read(0, np.array([0.3, -5.0, 1.9]), np.array([0.3, 9.0, 100.0]))
    np.testing.assert_array_equal(reading.angular_velocity, [0.25, -2.0, 2.0])
    np.testing.assert_array_equal(reading.specific_force, [0.3, 9.0, 100.0])


def test_zeroed_gyro_bias_has_the_noise_of_its_average() -> None:
    raw = InertialConfig.of("bosch_bmi088", zeroed=False)
    zeroed = InertialConfig.of("bosch_bmi088")
    assert raw.gyro_bias_sigma == pytest.approx(math.radians(1.0))
    assert zeroed.gyro_bias_sigma == pytest.approx(math.radians(0.014) / math.sqrt(5.0))
    assert zeroed.force_bias_sigma == raw.force_bias_sigma


def test_units_name_the_source_of_every_figure() -> None:
    figures = {f.name for f in fields(Drift)}
    for model in INERTIAL_UNITS.values():
        assert set(model.sources) == figures
        assert all(model.sources.values())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: InertialConfig.of("mpu6050"), "no inertial unit named 'mpu6050'.*xsens_mti630"),
        (lambda: InertialConfig(gyro_noise=-1.0), "gyro_noise must be >= 0"),
        (lambda: InertialConfig(force_bias_sigma=float("nan")), "force_bias_sigma must be >= 0"),
        (lambda: Drift(noise=-0.1), "noise must be >= 0"),
        (lambda: Drift(0.0, correlation=0.0), "correlation must be > 0"),
        (lambda: Drift(0.0, full_scale=1.0, quantum=2.0), "quantum must be at most full_scale, 1"),
    ],
)
def test_invalid_units_are_rejected_by_name(make: Callable[[], object], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        make()
