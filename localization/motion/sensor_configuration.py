"""Which sensors a robot has besides its scanners, and how the filter is set for them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

from localization.errors import LocalizationError
from localization.filter.ekf_config import EkfConfig
from localization.types import Inertial, Odometry, PointScan, Reading, Scan, WheelSpeeds


class Motion(StrEnum):
    """The sensors that measure how the robot moves between sweeps."""

    WHEELS_AND_GYRO = "wheels-and-gyro"
    """Rim speeds and an inertial unit."""
    WHEELS = "wheels"
    """Rim speeds alone; their difference gives the yaw rate."""
    GYRO = "gyro"
    """An inertial unit alone; the speed is the one that KISS-ICP observed last."""
    ODOMETRY = "odometry"
    """Poses that the base integrates by itself."""
    ODOMETRY_AND_GYRO = "odometry-and-gyro"
    """The same for the way, and an inertial unit for the turn."""
    SCANNER = "scanner"
    """None; speed and yaw rate are those that KISS-ICP observed last."""


@dataclass(frozen=True, slots=True)
class SensorConfiguration:
    """Which sensors a robot has besides its scanners, and what its ground is like."""

    motion: Motion = Motion.WHEELS_AND_GYRO
    """The sensors that measure how the robot moves between sweeps."""
    flat: bool = False
    """Whether the ground is level, so that height, roll and pitch stay as they are."""

    def __post_init__(self) -> None:
        known = ", ".join(repr(m.value) for m in Motion)
        if self.motion not in list(Motion):
            raise LocalizationError(f"motion must be one of {known}, got {self.motion!r}")
        object.__setattr__(self, "motion", Motion(self.motion))

    @property
    def gyro(self) -> bool:
        """Whether the robot has an inertial unit."""
        return self.motion in (Motion.WHEELS_AND_GYRO, Motion.GYRO, Motion.ODOMETRY_AND_GYRO)

    @property
    def wheels(self) -> bool:
        """Whether the robot has wheel encoders."""
        return self.motion in (Motion.WHEELS_AND_GYRO, Motion.WHEELS)

    @property
    def leader(self) -> tuple[type[Reading], ...]:
        """The kinds of readings that advance the localiser's time."""
        return _LEADERS[self.motion]

    @property
    def expected(self) -> tuple[str, ...]:
        """Sources whose silence is reported, besides scanners and the readings that advance time."""
        return _EXPECTED.get(self.motion, ())

    @property
    def displaced(self) -> bool:
        """Whether the robot's motion comes as displacements, whose noise belongs to the way and not to the time."""
        return self.motion in (Motion.WHEELS, Motion.ODOMETRY, Motion.ODOMETRY_AND_GYRO)

    def ekf(self) -> EkfConfig:
        """Return the filter's settings for these sensors."""
        config = EkfConfig()
        along, _, lateral, ahead = config.skid_steer
        if self.motion is Motion.ODOMETRY_AND_GYRO:
            # Any base, with any unit: wheels may turn the robot by another ratio than the nominal one.
            config = replace(
                config,
                gyro_bias=_ANY_GYRO_BIAS,
                turn_share=_ANY_GYRO_SCALE,
                skid_steer=(along, _YAW_RATIO, lateral, ahead),
                odometry=replace(config.odometry, rocking=0.0),
            )
        elif not self.gyro:
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
                still_settle=math.inf,
            )
        if self.flat:
            odometry = replace(config.odometry, heave=1e-4, rocking=_ROCKING_LEVEL)
            config = replace(config, heave_noise=1e-4, level=_LEVEL, odometry=odometry)
        return config


_LEADERS: dict[Motion, tuple[type[Reading], ...]] = {
    Motion.WHEELS_AND_GYRO: (Inertial,),
    Motion.WHEELS: (WheelSpeeds,),
    Motion.GYRO: (Inertial,),
    Motion.ODOMETRY: (Odometry,),
    Motion.ODOMETRY_AND_GYRO: (Odometry,),
    Motion.SCANNER: (Scan, PointScan),
}
_EXPECTED: dict[Motion, tuple[str, ...]] = {
    Motion.WHEELS_AND_GYRO: ("wheels",),
    Motion.ODOMETRY_AND_GYRO: ("gyro",),
}
_ANY_GYRO_BIAS = math.radians(1.0)
"""Error of the bias of an inertial unit that nobody calibrated, at the start [rad/s]."""
_ANY_GYRO_SCALE = 0.01
"""Error of its scale, as a share of the turn: data sheets of small MEMS units have 0.5 to 3 %."""
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
