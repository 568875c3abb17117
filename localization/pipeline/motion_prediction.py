"""Prediction by whatever motion sensors a robot has: rates of a gyro with rim speeds, or displacements."""

from __future__ import annotations

import math

from localization.filter.displacement_prediction import predict_displacement
from localization.filter.ekf import FilterState
from localization.filter.prediction import predict
from localization.filter.updates import CORRELATION, update_standstill, update_wheel_yaw
from localization.monitoring.wheel_modes import WheelModes
from localization.motion.motion_model import Increment
from localization.types import GRAVITY, Pose


def predict_motion(
    filter_: FilterState, wheels: WheelModes, increment: Increment, seconds: float
) -> tuple[FilterState, WheelModes, Pose]:
    """Return filter and modes of the wheels after an increment, and the motion ``base_then_from_base_now``.

    Args:
        filter_: before.
        wheels: before.
        increment: what the sensors measured.
        seconds: that it covers.
    """
    ekf, left, right = wheels.ekf, increment.left, increment.right
    if increment.step is not None:
        filter_, motion = predict_displacement(
            filter_, ekf, increment.step, seconds, increment.gyro
        )
        return filter_, wheels.after(seconds), motion
    wheels = _felt(filter_, wheels, float(increment.force[0]), seconds)
    if increment.witnessed:
        # Rim speeds are means over a short time; after a pause of the encoders rates of the gyro are.
        witness, span = increment.witness, min(increment.covered, CORRELATION)
        wheels = wheels.wheels_read(filter_.rolling_speed(left, right), increment.covered)
        filter_, agree = update_wheel_yaw(filter_, ekf, witness, left, right, seconds=span)
        wheels = wheels if agree else wheels.contradicted()
        filter_ = update_standstill(filter_, ekf, witness, left, right, seconds=span)
    wheels = wheels.rolled_on(filter_.rolling_speed(left, right) * seconds)
    distrusted = wheels.slipping or not increment.rolling
    filter_, motion = predict(
        filter_,
        ekf,
        seconds,
        increment.rate,
        increment.force,
        left,
        right,
        slipping=distrusted,
        speed=wheels.speed if distrusted else None,
    )
    return filter_, wheels, motion


def _felt(filter_: FilterState, wheels: WheelModes, force: float, seconds: float) -> WheelModes:
    """Return the modes of the wheels after the robot felt how it speeds up: of a force along it, what is not gravity."""
    if not wheels.sensors.accelerometer or seconds > CORRELATION:
        return wheels.after(seconds)
    gravity = GRAVITY * float(filter_.pose.rotation[2, 0])
    sigma = GRAVITY * math.sqrt(float(filter_.full_covariance[4, 4]))
    return wheels.after(seconds, force - gravity, sigma)
