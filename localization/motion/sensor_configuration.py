"""Which sensors a robot has besides its scanners."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from localization.errors import LocalizationError
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
    def accelerometer(self) -> bool:
        """Whether the forces of an inertial unit are used beside rim speeds: on a level floor they are those of a standstill."""
        return self.motion is Motion.WHEELS_AND_GYRO and not self.flat

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
