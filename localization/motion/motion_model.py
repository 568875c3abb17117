"""Sensor suites: what besides its scanners tells a robot how it moves, brought to one form.

Everything becomes an ``Increment``: mean rates and rim speeds over the time since the last one. Where a
sensor is missing, the others stand in for it, and the filter is told to trust that less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from localization.errors import LocalizationError
from localization.filter.ekf import GRAVITY, EkfConfig
from localization.geometry import FloatArray
from localization.types import (
    SECOND,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)


class Motion(StrEnum):
    """What tells how the robot moves between sweeps."""

    WHEELS_AND_GYRO = "wheels-and-gyro"
    WHEELS = "wheels"
    """Rim speeds alone; turning is read from their difference."""
    GYRO = "gyro"
    """An inertial unit alone; speed is what KISS-ICP saw last."""
    ODOMETRY = "odometry"
    """Poses that the base adds up by itself."""
    SCANNER = "scanner"
    """Nothing: speed and turning are what KISS-ICP saw last."""


@dataclass(frozen=True, slots=True)
class SensorConfiguration:
    """Which sensors a robot has besides its scanners, and what its ground is like."""

    motion: Motion = Motion.WHEELS_AND_GYRO
    """What tells how the robot moves between sweeps."""
    flat: bool = False
    """Whether the ground is level: height, roll and pitch then stay as they are."""

    def __post_init__(self) -> None:
        known = ", ".join(repr(m.value) for m in Motion)
        if self.motion not in list(Motion):
            raise LocalizationError(f"motion must be one of {known}, got {self.motion!r}")
        object.__setattr__(self, "motion", Motion(self.motion))

    @property
    def gyro(self) -> bool:
        """Whether an inertial unit is there."""
        return self.motion in (Motion.WHEELS_AND_GYRO, Motion.GYRO)

    @property
    def wheels(self) -> bool:
        """Whether encoders are there."""
        return self.motion in (Motion.WHEELS_AND_GYRO, Motion.WHEELS)

    @property
    def leader(self) -> tuple[type[Reading], ...]:
        """The kinds of readings that move time on."""
        return _LEADERS[self.motion]

    @property
    def expected(self) -> tuple[str, ...]:
        """What is missed when it falls silent, besides scanners and what moves time on."""
        return ("wheels",) if self.motion is Motion.WHEELS_AND_GYRO else ()

    def ekf(self) -> EkfConfig:
        """Return the filter's settings as they suit these sensors."""
        config = EkfConfig()
        if not self.gyro:
            # What stands in for the gyro has no constant bias, and errs by a share of the turning.
            share = _TURN_SHARE[self.motion]
            config = replace(
                config,
                turn_share=share,
                turn_floor=_TURN_FLOOR[self.motion],
                gyro_noise=_ROCKING,
                gyro_bias=1e-5,
                gyro_bias_walk=1e-6,
                # Nothing else shows that a robot whose wheels stand is not turned by hand.
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
"""How level a flat ground is believed to be, at each sweep [rad]."""
_ROCKING = math.radians(0.3)
"""Rolling and pitching that no gyro sees, of a robot on an indoor floor [rad/sqrt(s)]."""
_TURN_SHARE = {Motion.WHEELS: 0.06, Motion.ODOMETRY: 0.08, Motion.SCANNER: 0.15}
"""Error of a turn as a share of it [1/sqrt(Hz)]. A skid-steered robot's wheels err by 5 % with
the curve it drives (Wang et al., Sensors 2015, 15, 9681), for longer than a sweep."""
_TURN_FLOOR = {
    Motion.WHEELS: math.radians(0.3),
    Motion.ODOMETRY: math.radians(0.5),
    Motion.SCANNER: math.radians(5.0),
}
"""Error of the heading besides [rad/sqrt(s)]; without any sensor, a robot may begin a turn of 30 deg/s
within one sweep of 0.1 s."""
_LONGEST_GAP = SECOND
"""Odometry that pauses for longer says nothing of how the robot moved meanwhile [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class Increment:
    """How the robot moved since the last increment, as far as sensors say."""

    stamp: int
    """End of the time it covers [ns]."""
    rate: FloatArray
    """(3,) mean angular velocity [rad/s]."""
    force: FloatArray
    """(3,) mean specific force [m/s^2]."""
    left: float
    """Rim speed [m/s]."""
    right: float
    """[m/s]."""
    rolling: bool
    """Whether the rim speeds were measured, and lately."""
    witnessed: bool
    """Whether gyro and wheels are both new, so that they can be compared."""
    witness: FloatArray
    """(3,) mean angular velocity over the time that the rim speeds cover [rad/s]; wheels may be read
    less often than the gyro."""
    covered: float
    """How long that time is [s]."""


class MotionModel:
    """Turns readings into increments, as a suite has them."""

    def __init__(self, suite: SensorConfiguration, *, track: float, silence: int) -> None:
        """Build.

        Args:
            suite: what there is.
            track: effective track [m], by which a difference of rim speeds is a turn.
            silence: rim speeds older than this are not used [ns].
        """
        self.sensors = suite
        self._track, self._silence = track, silence
        self._wheels: WheelSpeeds | None = None
        self._fresh = False
        self._turned = np.zeros(3)
        self._turns = 0
        self._since = 0
        self._before: Odometry | None = None

    def take(self, reading: Reading, seen: tuple[float, float]) -> Increment | None:
        """Take a reading; return an increment if it moves time on.

        Args:
            reading: any.
            seen: forward speed [m/s] and yaw rate [rad/s] as KISS-ICP saw them last.
        """
        motion = self.sensors.motion
        match reading:
            case WheelSpeeds() if self.sensors.wheels:
                self._wheels, self._fresh = reading, True
                if motion is Motion.WHEELS:
                    return self._rolled(reading.stamp, reading.left, reading.right)
            case Inertial() if self.sensors.gyro:
                return self._measured(reading)
            case Odometry() if motion is Motion.ODOMETRY:
                return self._added_up(reading)
            case Scan() | PointScan() if motion is Motion.SCANNER:
                across = 0.5 * self._track * seen[1]
                return self._rolled(
                    reading.end_stamp, seen[0] - across, seen[0] + across, rolling=False
                )
        return None

    def _measured(self, reading: Inertial) -> Increment:
        wheels, witnessed = self._wheels, self._fresh
        self._fresh = False
        rolling = wheels is not None and reading.stamp - wheels.stamp < self._silence
        left, right = (wheels.left, wheels.right) if wheels is not None and rolling else (0.0, 0.0)
        force = _level_force() if self.sensors.flat else reading.specific_force
        rate = reading.angular_velocity
        self._turned, self._turns = self._turned + rate, self._turns + 1
        witness, covered = self._turned / self._turns, (reading.stamp - self._since) / SECOND
        if witnessed:
            self._turned, self._turns, self._since = np.zeros(3), 0, reading.stamp
        return Increment(
            reading.stamp, rate, force, left, right, rolling, witnessed, witness, covered
        )

    def _added_up(self, reading: Odometry) -> Increment:
        before, self._before = self._before, reading
        if before is None or reading.stamp - before.stamp > _LONGEST_GAP:
            return self._rolled(reading.stamp, 0.0, 0.0, rolling=before is None)
        seconds = (reading.stamp - before.stamp) / SECOND
        step: Pose = before.odom_from_base.inverse() @ reading.odom_from_base
        # A chord is shorter than its arc, and points half the turn aside.
        half = 0.5 * step.yaw
        chord = step.position[0] * math.cos(half) + step.position[1] * math.sin(half)
        arc = chord * (half / math.sin(half) if abs(half) > 1e-6 else 1.0)
        across = self._track * half
        return self._rolled(reading.stamp, (arc - across) / seconds, (arc + across) / seconds)

    def _rolled(self, stamp: int, left: float, right: float, *, rolling: bool = True) -> Increment:
        rate = np.array([0.0, 0.0, (right - left) / self._track])
        return Increment(
            stamp, rate, _level_force(), left, right, rolling, False, witness=rate, covered=0.0
        )


def _level_force() -> FloatArray:
    return np.array([0.0, 0.0, GRAVITY])
