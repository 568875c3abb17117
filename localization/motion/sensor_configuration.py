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
        return self.motion in (Motion.WHEELS_AND_GYRO, Motion.GYRO)

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
        return ("wheels",) if self.motion is Motion.WHEELS_AND_GYRO else ()

    def ekf(self) -> EkfConfig:
        """Return the filter's settings for these sensors."""
        config = EkfConfig()
        if not self.gyro:
            # The substitute of the gyro has no constant bias, and its error is a share of the turn.
            share = _TURN_SHARE[self.motion]
            config = replace(
                config,
                turn_share=share,
                turn_floor=_TURN_FLOOR[self.motion],
                gyro_noise=_ROCKING,
                gyro_bias=1e-5,
                gyro_bias_walk=1e-6,
                # Without a gyro nothing shows that a robot at rest is turned by hand.
                still_settle=math.inf,
            )
        if self.motion is Motion.ODOMETRY:
            config = replace(config, speed_noise=0.05, side_noise=0.02, speed_floor=0.01)
        if self.flat:
            config = replace(config, heave_noise=1e-4, level=_LEVEL)
        return config


_LEADERS: dict[Motion, tuple[type[Reading], ...]] = {
    Motion.WHEELS_AND_GYRO: (Inertial,),
    Motion.WHEELS: (WheelSpeeds,),
    Motion.GYRO: (Inertial,),
    Motion.ODOMETRY: (Odometry,),
    Motion.SCANNER: (Scan, PointScan),
}
_LEVEL = math.radians(0.1)
"""Tilt of a floor that is said to be flat, at each sweep, one sigma [rad]."""
_ROCKING = math.radians(0.3)
"""Roll and pitch of a robot on an indoor floor that no gyro measures [rad/sqrt(s)]."""
_TURN_SHARE = {Motion.WHEELS: 0.06, Motion.ODOMETRY: 0.08, Motion.SCANNER: 0.15}
"""Error of a turn as a share of it [1/sqrt(Hz)]. The wheels of a skid-steered robot err by 5 % with the
curve it drives (Wang et al., Sensors 2015, 15, 9681), for longer than a sweep."""
_TURN_FLOOR = {
    Motion.WHEELS: math.radians(0.3),
    Motion.ODOMETRY: math.radians(0.5),
    Motion.SCANNER: math.radians(5.0),
}
"""Error of the heading in addition [rad/sqrt(s)]; without any sensor, a robot may begin a turn of 30 deg/s
within one sweep of 0.1 s."""
