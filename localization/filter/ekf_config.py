"""Settings of the filter: what each noise is, and where its number comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache

from scipy.special import chdtri

from localization.motion.odometry_noise import OdometryNoise
from localization.motion.sensor_configuration import Motion, SensorConfiguration


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
    tilt: float = math.radians(3.5)
    """The error of one tilt measurement at 10 Hz [rad]: an accelerometer's 0.35 degrees of bias, which the
    next hundred measurements share, so that each counts a hundredth. 0.06 m/s^2; data sheets have 0.03
    (Xsens MTi-630) to 0.2 (Bosch BMI088, not calibrated)."""
    level: float = math.radians(0.1)
    """The tilt of a floor that is said to be flat [rad], at each ``update_level``: 1 cm in 6 m."""
    still_speed: float = 0.002
    """Rim speeds below this mean that the wheels stand [m/s]: less than one tick of common encoders per
    reading at 50 Hz."""
    still_force: float = 0.05
    """The noise of one specific force against the mean of those since the robot stands [m/s^2]: 0.02 of a
    small MEMS unit at 50 Hz, the rest for vibration."""
    still_gate: float = 21.1
    """The largest squared departure of gyro or accelerometer from rest: chi-square, 3 degrees of freedom, 99.99 %:
    each reading is asked."""
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
    consistent: float = 0.999
    """The share of consistent errors that are believed: sweeps, tilts, wheels and gyros that are off by more than so
    many would be are in error themselves, as by slip. The bounds of squared errors are its chi-square quantiles."""
    range_bias: float = 0.017
    """The bias of a scanner's ranges before any was learned, one sigma [m]: the data sheets of SICK's LMS111 and
    Hokuyo's UTM-30LX give +-30 mm, evenly distributed."""

    def gate(self, dimensions: int) -> float:
        """Return the largest squared, normalised error of so many dimensions that is believed."""
        return _quantile(self.consistent, dimensions)

    @classmethod
    def of(cls, sensors: SensorConfiguration) -> EkfConfig:
        """Return the settings that suit a robot's sensors."""
        config = cls()
        along, _, lateral, ahead = config.skid_steer
        if sensors.motion is Motion.ODOMETRY_AND_GYRO:
            # Any base, with any unit: wheels may turn the robot by another ratio than the nominal one.
            config = replace(
                config,
                gyro_bias=_ANY_GYRO_BIAS,
                turn_share=_ANY_GYRO_SCALE,
                skid_steer=(along, _YAW_RATIO, lateral, ahead),
                odometry=replace(config.odometry, rocking=0.0),
            )
        elif not sensors.gyro:
            # The substitute of the gyro has no constant bias. Wheels that no gyro watches may turn the robot
            # by another ratio than the nominal one.
            config = replace(
                config,
                turn_share=_TURN_SHARE,
                turn_floor=_TURN_FLOOR,
                gyro_noise=_ROCKING,
                gyro_bias=1e-5,
                gyro_bias_walk=1e-6,
                skid_steer=(along, _YAW_RATIO, lateral, ahead),
                # Without a gyro nothing shows that a robot at rest is turned by hand.
                still_settle=_NEVER,
            )
        if sensors.flat:
            odometry = replace(config.odometry, heave=1e-4, rocking=_ROCKING_LEVEL)
            config = replace(config, heave_noise=1e-4, level=_LEVEL, odometry=odometry)
        return config


@lru_cache
def _quantile(share: float, dimensions: int) -> float:
    return float(chdtri(dimensions, 1.0 - share))


_ANY_GYRO_BIAS = math.radians(1.0)
"""Error of the bias of an inertial unit that nobody calibrated, at the start [rad/s]."""
_ANY_GYRO_SCALE = 0.01
"""Error of its scale, as a share of the turn: data sheets of small MEMS units have 0.5 to 3 %."""
_NEVER = 1e9
"""A time that no drive lasts [s]; unlike an infinite one, every program reads it from JSON."""
_LEVEL = math.radians(0.1)
"""Tilt of a floor that is said to be flat, at each sweep, one sigma [rad]."""
_ROCKING = math.radians(0.3)
"""Roll and pitch of a robot on an indoor floor that no gyro measures [rad/sqrt(s)]."""
_ROCKING_LEVEL = math.radians(0.1)
"""Roll and pitch on a floor that is said to be flat, with the distance [rad/sqrt(m)]."""
_YAW_RATIO = 0.33
"""Error of the logarithm of the yaw ratio at the start: skid-steer robots turn by 0.5 to 1.9 times what their
wheels count."""
_TURN_SHARE = 0.15
"""Error of a turn that only the scanner observed, as a share of it [1/sqrt(Hz)]."""
_TURN_FLOOR = math.radians(5.0)
"""Error of the heading in addition [rad/sqrt(s)]; without any sensor, a robot may begin a turn of 30 deg/s
within one sweep of 0.1 s."""
