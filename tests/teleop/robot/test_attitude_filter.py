"""Attitude from gyro and accelerometer: against the truth of the courtyard's ramps, and in single cases."""

from __future__ import annotations

import numpy as np
import pytest

from localization.geometry import (
    euler_from_rotation,
    rotation_from_euler,
    rotation_from_quaternion,
)
from localization.types import GRAVITY, Health, Inertial
from robot_sim import Simulation, load_world
from teleop.robot.attitude_filter import AttitudeFilter
from teleop.scenario.tour_driver import TourDriver

_PERIOD = 20_000_000
_STILL = np.zeros(3)


def _level(roll: float, pitch: float) -> np.ndarray:
    """The specific force of a robot that stands at a tilt."""
    return rotation_from_euler(roll, pitch, 0.0).T @ (0.0, 0.0, GRAVITY)


def _stand(
    filter_: AttitudeFilter, seconds: float, rate: np.ndarray, force: np.ndarray
) -> AttitudeFilter:
    start = filter_.stamp or 0
    for k in range(1, round(seconds / 0.02) + 1):
        filter_ = filter_.after(Inertial(start + k * _PERIOD, rate, force))
    return filter_


def _euler(filter_: AttitudeFilter) -> tuple[float, float, float]:
    return euler_from_rotation(rotation_from_quaternion(filter_.quaternion))


@pytest.mark.long
@pytest.mark.slow
def test_tilt_on_the_courtyards_ramps_is_within_a_degree_and_within_its_sigma() -> None:
    world = load_world("courtyard")
    simulation, driver = Simulation(world, seed=0), TourDriver(world.tour)
    filter_, first = AttitudeFilter(), simulation.truth().map_from_base.yaw
    errors, sigmas, tilts = [], [], []
    while not driver.done and simulation.stamp < 90e9:
        pose = simulation.truth().map_from_base
        simulation.command(driver.command(pose, Health.TRACKING))
        for reading in simulation.step():
            if isinstance(reading, Inertial):
                filter_ = filter_.after(reading)
        true = simulation.truth().map_from_base.rotation
        off = (
            rotation_from_euler(0.0, 0.0, -first)
            @ true
            @ rotation_from_quaternion(filter_.quaternion).T
        )
        errors.append(0.5 * (off - off.T)[[2, 0, 1], [1, 2, 0]])
        sigmas.append(np.sqrt(np.diag(filter_.covariance)))
        tilts.append(euler_from_rotation(true)[:2])
    error, sigma = np.rad2deg(errors), np.rad2deg(sigmas)
    assert np.rad2deg(np.abs(tilts).max()) > 4.0  # there is something to measure
    assert np.sqrt((error[:, :2] ** 2).mean(axis=0)).max() < 0.7
    assert np.abs(error[:, :2]).max() < 3.0
    # Honest and not only wide: nearly all errors are within two sigma, and sigma is about a degree.
    assert (np.abs(error) < 2.0 * sigma + 1e-6).mean() > 0.95
    assert sigma[:, :2].mean() < 1.3
    # Nothing shows the heading: it drifts, and says so.
    assert sigma[-1, 2] > 10.0 > sigma[500, 2]


@pytest.mark.parametrize(
    ("roll", "pitch"), [(0.0, 0.0), (0.2, 0.0), (0.0, -0.3), (-1.2, 0.5), (3.0, 0.0)]
)
def test_robot_that_stands_shows_its_tilt_from_the_first_reading(roll: float, pitch: float) -> None:
    found = _euler(AttitudeFilter().after(Inertial(5, _STILL, _level(roll, pitch))))
    assert found == pytest.approx((roll, pitch, 0.0), abs=1e-9)


def test_bias_of_the_gyro_tilts_nothing_in_the_long_run() -> None:
    bias = np.array([0.01, -0.008, 0.0])
    filter_ = _stand(AttitudeFilter(), 60.0, bias, _level(0.1, 0.0))
    assert _euler(filter_)[:2] == pytest.approx((0.1, 0.0), abs=np.deg2rad(0.1))
    assert filter_.bias[:2] == pytest.approx(bias[:2], abs=0.001)


def test_turn_of_the_gyro_is_followed_at_once() -> None:
    filter_ = _stand(AttitudeFilter(), 1.0, _STILL, _level(0.0, 0.0))
    filter_ = _stand(filter_, 0.5, np.array([0.0, 0.0, 1.0]), _level(0.0, 0.0))
    assert _euler(filter_)[2] == pytest.approx(0.5, abs=0.01)


def test_braking_and_curves_are_not_taken_for_a_tilt() -> None:
    filter_ = _stand(AttitudeFilter(), 5.0, _STILL, _level(0.0, 0.0))
    braking = _stand(filter_, 0.7, _STILL, _level(0.0, 0.0) - (1.0, 0.0, 0.0))
    assert abs(_euler(braking)[1]) < np.deg2rad(1.5)  # the force alone would show 5.8
    curve = np.array([0.0, 0.0, 1.0])
    turning = _stand(filter_, 3.0, curve, _level(0.0, 0.0) + (0.0, 0.7, 0.0))
    assert abs(_euler(turning)[0]) < np.deg2rad(2.5)  # the force alone would show 4.1


def test_old_and_unusable_readings_change_nothing_and_a_gap_is_doubt() -> None:
    filter_ = _stand(AttitudeFilter(), 1.0, np.array([0.0, 0.0, 0.5]), _level(0.0, 0.0))
    assert filter_.stamp is not None
    assert filter_.after(Inertial(filter_.stamp, _STILL, _level(1.0, 0.0))) is filter_
    assert filter_.after(Inertial(filter_.stamp + 1, np.full(3, np.nan), _STILL)) is filter_
    late = filter_.after(
        Inertial(filter_.stamp + 3_000_000_000, np.array([0.0, 0.0, 0.5]), _level(0.0, 0.0))
    )
    assert late.covariance[2, 2] > 1.0
    # In free fall nothing points down: the gyro alone goes on.
    falling = filter_.after(Inertial(filter_.stamp + _PERIOD, _STILL, np.array([0.5, 0.0, 0.0])))
    assert _euler(falling)[:2] == pytest.approx(_euler(filter_)[:2], abs=1e-3)


def test_reading_gets_orientation_and_sigma_for_the_message() -> None:
    filter_ = _stand(AttitudeFilter(), 1.0, _STILL, _level(0.1, 0.2))
    reading = Inertial(filter_.stamp or 0, _STILL, _level(0.1, 0.2))
    given = filter_.applied(reading)
    assert given.orientation is not None
    assert given.orientation_sigma is not None
    assert euler_from_rotation(rotation_from_quaternion(given.orientation))[:2] == pytest.approx(
        (0.1, 0.2), abs=1e-6
    )
    assert given.specific_force is reading.specific_force
    assert (given.orientation_sigma[:2] > np.deg2rad(0.3)).all()
