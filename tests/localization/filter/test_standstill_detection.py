from __future__ import annotations

import numpy as np
import pytest

from localization.filter.ekf import EkfConfig
from localization.filter.standstill_detection import MOVING, Rest, quiet, rest_after, wheels_stand
from localization.monitoring.wheel_modes import WheelConfig, WheelModes
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import Pose
from tests.localization.filter.driven_filter import DrivenFilter

C = EkfConfig()
DOWN = (0.0, 0.0, 9.81)
SEEN = np.diag(np.square([0.003, 0.003, 0.002]))
"""Covariance of what KISS-ICP sees in a room with walls all round."""


def ekf_that(*, stands: bool) -> DrivenFilter:
    ekf = DrivenFilter()
    speed = 0.0 if stands else 0.3
    for _ in range(50):
        ekf.predict(0.02, np.zeros(3), np.array(DOWN), speed, speed, slipping=False)
    assert ekf.standing == stands
    return ekf


@pytest.mark.parametrize(
    ("way", "stands", "contradicted"),
    [
        ((0.0, 0.002, 0.0), True, False),
        ((0.0, 0.03, 0.0), True, True),
        ((0.0, -0.03, 0.0), True, True),
        ((0.03, 0.0, 0.0), True, True),
        # Wheels that roll say nothing about the side.
        ((0.03, 0.03, 0.0), False, False),
    ],
)
def test_kiss_sees_robot_that_is_shifted_over_its_standing_wheels(
    way: tuple[float, float, float], stands: bool, contradicted: bool
) -> None:
    modes = WheelModes.rolling_on(WheelConfig(), SensorConfiguration(), C).rolled_on(
        0.0 if stands else 0.03
    )
    _, misled = modes.compared((Pose.planar(*way), SEEN), 0.1, ekf_that(stands=stands).state)
    assert misled == contradicted


def test_wheels_stand_if_both_do() -> None:
    assert wheels_stand(0.001, -0.001, C)
    assert not wheels_stand(0.0, 0.01, C)
    assert not wheels_stand(-0.01, 0.0, C)


def test_gyro_is_as_quiet_as_its_bias_is_unknown() -> None:
    turn = np.deg2rad(0.9)
    vague, known = (np.deg2rad(0.3) ** 2,) * 3, (np.deg2rad(0.01) ** 2,) * 3
    for axis in range(3):
        rate = tuple(turn if k == axis else 0.0 for k in range(3))
        assert len(rate) == 3
        assert quiet(rate, vague, 0.02, C)
        assert not quiet(rate, known, 0.02, C)
        # Over a longer time noise explains less.
        assert not quiet(rate, (np.deg2rad(0.1) ** 2,) * 3, 0.5, C)


def test_rest_grows_with_time_and_follows_the_mean_force() -> None:
    rest = MOVING
    for i in range(100):
        rest = rest_after(rest, (0.01 * (-1) ** i, 0.0, 9.81), 0.02, C)
        if i != 9:  # just then, rounding decides
            assert rest.stands(C) == (0.02 * (i + 1) > C.still_settle)
    assert rest.seconds == pytest.approx(2.0)
    assert rest.force == pytest.approx(DOWN, abs=0.003)


def test_push_begins_a_rest_that_takes_longer() -> None:
    rest = Rest(10.0, DOWN)
    rest = rest_after(rest, (0.5, 0.0, 9.81), 0.02, C)
    assert rest.pushed
    assert not rest.undisturbed
    while rest.seconds < C.still_recover - 0.03:
        rest = rest_after(rest, (0.5, 0.0, 9.81), 0.02, C)
        assert not rest.stands(C)
    for _ in range(3):
        rest = rest_after(rest, (0.5, 0.0, 9.81), 0.02, C)
    assert rest.stands(C)
