"""Settings of the filter: what each noise is, and where its number comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from localization.motion.odometry_noise import OdometryNoise

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""


@dataclass(frozen=True, slots=True)
class EkfConfig:
    """Noise of the process and of the proprioceptive measurements; one sigma unless stated otherwise.

    A density [unit/sqrt(Hz)] is the noise of a rate: the error of its integral over t seconds is density
    times sqrt(t). Where no source is named, the number was chosen; ``python -m benchmarks localization
    consistency`` shows how consistent the resulting covariances are.
    """

    effective_track: float = 0.578
    """The width between the wheels at which a robot without slip would turn like this one [m]: a P3-AT's
    0.394 m times 1.466, the ratio that a model of its four contact patches gives."""
    speed_noise: float = 0.013
    """The noise of forward speed as a fraction of speed [1/sqrt(Hz)]: 4 % over 0.1 s."""
    speed_floor: float = 0.003
    """The noise of forward speed of a moving robot, however slow [m/s/sqrt(Hz)]: 1 cm/s over 0.1 s."""
    turn_noise: float = 0.010
    """The noise of forward speed caused by turning [m/sqrt(Hz)], to be multiplied by the yaw rate [rad/s]:
    3 cm/s at 1 rad/s, over 0.1 s."""
    side_noise: float = 0.006
    """The noise of lateral speed of a moving robot [m/s/sqrt(Hz)]: 2 cm/s over 0.1 s."""
    heave_noise: float = 0.006
    """The noise of vertical speed of a moving robot [m/s/sqrt(Hz)]: 2 cm/s over 0.1 s, a slope of 4 % at
    0.5 m/s."""
    still_noise: float = 0.0005
    """The noise of every speed while neither wheels nor gyro move [m/s/sqrt(Hz)]: 1.2 cm in ten minutes."""
    still_turn: float = math.radians(0.002)
    """The noise of every turn rate while the robot stands [rad/sqrt(s)]: 0.05 degrees in ten minutes."""
    slip_forward: float = 0.16
    """The noise of forward speed while the wheels slip [m/s/sqrt(Hz)]: 0.5 m/s over 0.1 s."""
    slip_side: float = 0.03
    """The noise of lateral speed while the wheels slip [m/s/sqrt(Hz)]: 0.1 m/s over 0.1 s."""
    gyro_noise: float = math.radians(0.02)
    """The angle random walk of the gyro [rad/sqrt(s)]: small MEMS units have 0.007 (Xsens MTi-630 data
    sheet) to 0.014 degrees (Bosch BMI088 data sheet); vibration adds to it."""
    turn_share: float = 0.0
    """The additional noise of the yaw rate as a fraction of it [1/sqrt(Hz)]; for a substitute of the gyro."""
    turn_floor: float = 0.0
    """The additional noise of the yaw rate, however small it is [rad/sqrt(s)]."""
    gyro_bias_walk: float = math.radians(0.003)
    """The random walk of the gyro's bias [rad/s/sqrt(s)]: with temperature, some 0.01 degrees/s in 10 s."""
    gyro_bias: float = math.radians(0.3)
    """The error of the gyro's bias at the start [rad/s]: 0.2 degrees/s over a year (Xsens MTi-630 data
    sheet)."""
    skid_steer: tuple[float, float, float, float] = (0.04, 0.10, 0.02, 0.02)
    """The errors of (s, psi, y0, xv) at the start [1, 1, m, m]: 4 % of the tyre radius, 10 % of the track; a
    P3-AT's track differs that much between floors and curves (Wang et al., Sensors 2015, 15, 9681)."""
    skid_steer_walk: tuple[float, float, float, float] = (0.0005, 0.0035, 0.0005, 0.0005)
    """The random walks of (s, psi, y0, xv) [1, 1, m, m, each /sqrt(s)]: the track follows a new floor within
    some ten seconds."""
    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    """The noise of odometry that comes as poses, and of rim speeds that no gyro accompanies."""
    wheel_yaw_floor: float = math.radians(1.2)
    """The error of the wheels' yaw rate against the gyro's, over 0.1 s [rad/s]."""
    wheel_yaw_share: float = 0.05
    """The error of the wheels' yaw rate as a fraction of it: the track changes by 5 % with the curve (Wang
    et al. 2015)."""
    wheel_yaw_gate: float = 9.0
    """The largest squared error at which wheels and gyro agree: chi-square, 1 degree of freedom, 99.7 %;
    beyond it the wheels of one side slip."""
    tilt: float = math.radians(3.5)
    """The error of one tilt measurement at 10 Hz [rad]: an accelerometer's 0.35 degrees of bias, which the
    next hundred measurements share, so that each counts a hundredth. 0.06 m/s^2; data sheets have 0.03
    (Xsens MTi-630) to 0.2 (Bosch BMI088, not calibrated)."""
    level: float = math.radians(0.1)
    """The tilt of a floor that is said to be flat [rad], at each ``update_level``: 1 cm in 6 m."""
    tilt_gate: float = 13.8
    """The largest squared error at which a tilt measurement is believed: chi-square, 2 degrees of freedom,
    99.9 %."""
    still_speed: float = 0.002
    """Rim speeds below this mean that the wheels stand [m/s]: less than one tick of common encoders per
    reading at 50 Hz."""
    still_force: float = 0.05
    """The noise of one specific force against the mean of those since the robot stands [m/s^2]: 0.02 of a
    small MEMS unit at 50 Hz, the rest for vibration."""
    still_gate: float = 21.1
    """The largest squared departure of gyro or accelerometer from rest: chi-square, 3 degrees of freedom,
    99.99 %."""
    still_settle: float = 0.2
    """A robot stands once nothing has moved for this long [s]: its body nods when it stops."""
    still_recover: float = 1.0
    """After a push or a lift, a robot stands once nothing has moved for this long [s]: a push over locked
    wheels does not accelerate it evenly for longer."""
    still_position: float = 0.0025
    """The smallest error of the position of a standing robot, however many sweeps it receives, one sigma
    [m]: they share the map's errors. Measured in the office: 2 to 4 mm."""
    still_angle: float = math.radians(0.04)
    """The smallest error of roll, pitch and yaw of a standing robot, one sigma [rad]. Measured: 0.02 to 0.05
    degrees."""
    mount_position: float = 0.001
    """The error of the scanners' positions on the robot, added to each match, one sigma [m]."""
    mount_angle: float = math.radians(0.02)
    """The error of the scanners' orientations on the robot, added to each match, one sigma [rad]."""
