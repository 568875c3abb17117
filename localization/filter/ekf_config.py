"""Settings of the filter: what each noise is, and where its number comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""


@dataclass(frozen=True, slots=True)
class EkfConfig:
    """Noise of the process and of the proprioceptive measurements; one sigma unless said otherwise.

    A density [unit/sqrt(Hz)] is the error of a rate: over t seconds its integral errs by density times
    sqrt(t). Where no source is named, the number was chosen; ``python -m benchmarks localization
    consistency`` shows how honest the covariances are that they make.
    """

    effective_track: float = 0.578
    """Distance of the wheel tracks that turns as a skid-steered robot does [m]: a P3-AT's 0.394 m times
    1.466, the ratio that a model of its four contact patches gives."""
    speed_noise: float = 0.013
    """Of forward speed, as a fraction of speed [1/sqrt(Hz)]: 4 % over 0.1 s."""
    speed_floor: float = 0.003
    """Of forward speed while moving [m/s/sqrt(Hz)]: 1 cm/s over 0.1 s."""
    turn_noise: float = 0.010
    """Of forward speed by turning [m/sqrt(Hz)]: times the yaw rate [rad/s]; 3 cm/s at 1 rad/s, over
    0.1 s."""
    side_noise: float = 0.006
    """Of lateral speed while moving [m/s/sqrt(Hz)]: 2 cm/s over 0.1 s."""
    heave_noise: float = 0.006
    """Of vertical speed while moving [m/s/sqrt(Hz)]: 2 cm/s over 0.1 s, a slope of 4 % at 0.5 m/s."""
    still_noise: float = 0.0005
    """Of every speed while neither wheels nor gyro move [m/s/sqrt(Hz)]: 1.2 cm in ten minutes."""
    still_turn: float = math.radians(0.002)
    """Of every turn rate while the robot stands [rad/sqrt(s)]: 0.05 degrees in ten minutes."""
    slip_forward: float = 0.16
    """Of forward speed while the wheels slip [m/s/sqrt(Hz)]: 0.5 m/s over 0.1 s."""
    slip_side: float = 0.03
    """Of lateral speed while the wheels slip [m/s/sqrt(Hz)]: 0.1 m/s over 0.1 s."""
    gyro_noise: float = math.radians(0.02)
    """Angle random walk [rad/sqrt(s)]: small MEMS units have 0.007 (Xsens MTi-630 data sheet) to 0.014
    degrees (Bosch BMI088 data sheet); vibration adds to it."""
    turn_share: float = 0.0
    """Of the yaw rate besides, as a fraction of it [1/sqrt(Hz)]; for what stands in for a gyro."""
    turn_floor: float = 0.0
    """Of the yaw rate besides, however small it is [rad/sqrt(s)]."""
    gyro_bias_walk: float = math.radians(0.003)
    """Random walk of the gyro's bias [rad/s/sqrt(s)]: with temperature, some 0.01 degrees/s in 10 s."""
    gyro_bias: float = math.radians(0.3)
    """Of the gyro's bias at the start [rad/s]: 0.2 degrees/s over a year (Xsens MTi-630 data sheet)."""
    kappa: tuple[float, float, float, float] = (0.04, 0.06, 0.02, 0.02)
    """Of (s, B, y0, xv) at the start [1, m, m, m]: 4 % of tyre radius, 10 % of track; a P3-AT's track
    differs that much between floors and curves (Wang et al., Sensors 2015, 15, 9681)."""
    kappa_walk: tuple[float, float, float, float] = (0.0005, 0.002, 0.0005, 0.0005)
    """Random walk of (s, B, y0, xv) [1, m, m, m, each /sqrt(s)]: the track follows a new floor within
    some ten seconds."""
    wheel_yaw_floor: float = math.radians(1.2)
    """Of the wheels' yaw rate against the gyro's, over 0.1 s [rad/s]."""
    wheel_yaw_share: float = 0.05
    """The same as a fraction of the yaw rate: the track changes by 5 % with the curve (Wang et al. 2015)."""
    wheel_yaw_gate: float = 9.0
    """chi-square, 1 degree of freedom, 99.7 %; beyond it one side's wheels slip."""
    tilt: float = math.radians(3.5)
    """Of one tilt measurement at 10 Hz [rad]: an accelerometer's 0.35 degrees of bias, which the next
    hundred measurements share, so that each counts a hundredth. 0.06 m/s^2; data sheets have 0.03 (Xsens
    MTi-630) to 0.2 (Bosch BMI088, not calibrated)."""
    level: float = math.radians(0.1)
    """How level a floor is that is known to be [rad], at each ``update_level``: 1 cm in 6 m."""
    tilt_gate: float = 13.8
    """chi-square, 2 degrees of freedom, 99.9 %."""
    still_speed: float = 0.002
    """Rim speeds below this mean that the wheels stand [m/s]: less than one tick of common encoders per
    reading at 50 Hz."""
    still_force: float = 0.05
    """Of one specific force against the mean of those since the robot stands [m/s^2]: 0.02 of a small
    MEMS unit at 50 Hz, the rest for what shakes a robot that stands."""
    still_gate: float = 21.1
    """chi-square, 3 degrees of freedom, 99.99 %: how far gyro or accelerometer may depart from rest."""
    still_settle: float = 0.2
    """A robot stands once nothing has moved for this long [s]: its body nods when it stops."""
    still_recover: float = 1.0
    """The same after a push or a lift [s]: who pushes a robot over its locked wheels does not speed it
    up evenly for longer."""
    still_position: float = 0.0025
    """However many sweeps a robot sees that stands, its position is known no better, one sigma [m]: they
    share the map's errors. Measured in the office: 2 to 4 mm."""
    still_angle: float = math.radians(0.04)
    """The same for roll, pitch and yaw [rad]. Measured: 0.02 to 0.05 degrees."""
    mount_position: float = 0.001
    """How well the scanners' mounts are known, added to each match [m]."""
    mount_angle: float = math.radians(0.02)
    """The same for angles [rad]."""
