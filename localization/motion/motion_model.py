"""Motion model: readings of whatever sensors a robot has, brought to one form.

Everything becomes an ``Increment``. With a gyro that is mean rates and rim speeds over the time since the
last one; wheels alone, and odometry that comes as poses, give displacements, whatever the time. Where a
sensor is missing, others substitute for it, and the filter is set to trust that less.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from localization.geometry import FloatArray
from localization.motion.displacement import arc_step, odometry_step, rolled_arc
from localization.motion.gyro_turn import GyroStep, GyroTurn
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import (
    GRAVITY,
    SECOND,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)

_NO_RATE = np.zeros(3)
_LEVEL_FORCE = np.array([0.0, 0.0, GRAVITY])
for _constant in (_NO_RATE, _LEVEL_FORCE):
    _constant.flags.writeable = False


@dataclass(frozen=True, slots=True, eq=False)
class Increment:
    """How the robot moved since the last increment, as far as its sensors measure it."""

    stamp: int
    """End of the interval that it covers [ns]."""
    rate: FloatArray
    """(3,) mean angular velocity [rad/s]."""
    force: FloatArray
    """(3,) mean specific force [m/s^2]."""
    left: float
    """Rim speed of the left wheels [m/s]."""
    right: float
    """Rim speed of the right wheels [m/s]."""
    rolling: bool
    """Whether the rim speeds are recent measurements."""
    witnessed: bool
    """Whether gyro and wheels both have new readings, so that they can be compared."""
    witness: FloatArray
    """(3,) mean angular velocity over the time that the rim speeds cover [rad/s]; wheels may be read
    less often than the gyro."""
    covered: float
    """Length of that time [s]."""
    step: Pose | None = None
    """Planar displacement ``base_then_from_base_now`` that the wheels counted; None where rates and rim speeds
    measure the motion."""
    gyro: GyroStep | None = None
    """What an inertial unit measured during the displacement; None without one, and while it is silent."""


class MotionModel(NamedTuple):
    """Turns readings into increments; a value that holds the readings not used up yet."""

    sensors: SensorConfiguration
    """The sensors that the robot has."""
    track: float
    """Effective track, by which a difference of rim speeds is a turn [m]."""
    silence: int
    """Rim speeds older than this are not used [ns]."""
    wheels: WheelSpeeds | None = None
    """The newest rim speeds."""
    fresh: bool = False
    """Whether they are newer than the last increment."""
    rate_sum: FloatArray = _NO_RATE
    """(3,) sum of the angular velocities since the rim speeds were last compared with the gyro [rad/s]."""
    rate_count: int = 0
    """Number of angular velocities in that sum."""
    compared: int = 0
    """Stamp at which the rim speeds were last compared with the gyro [ns]."""
    odometry: Odometry | None = None
    """The newest odometry."""
    gyro: GyroTurn = GyroTurn()
    """What the inertial unit measured since then."""

    def take(
        self, reading: Reading, velocity: tuple[float, float]
    ) -> tuple[MotionModel, Increment | None]:
        """Return the model after a reading, and an increment if the reading advances time.

        Args:
            reading: any.
            velocity: forward speed [m/s] and yaw rate [rad/s] as KISS-ICP observed them last.
        """
        motion = self.sensors.motion
        match reading:
            case WheelSpeeds() if self.sensors.wheels:
                model = self._replace(wheels=reading, fresh=True)
                return model, self._counted(reading) if motion is Motion.WHEELS else None
            case Inertial() if motion is Motion.ODOMETRY_AND_GYRO:
                return self._replace(gyro=self.gyro.received(self._levelled(reading))), None
            case Inertial() if self.sensors.gyro:
                return self._measured(reading)
            case Odometry() if motion is Motion.ODOMETRY:
                return self._replace(odometry=reading), self._displaced(reading)
            case Odometry() if motion is Motion.ODOMETRY_AND_GYRO:
                increment = self._displaced(reading)
                gyro, turned = self.gyro.at(reading.stamp, increment.step or Pose.identity())
                return self._replace(odometry=reading, gyro=gyro), replace(increment, gyro=turned)
            case Scan() | PointScan() if motion is Motion.SCANNER:
                speed, across = velocity[0], 0.5 * self.track * velocity[1]
                return self, self._rolled(
                    reading.end_stamp, speed - across, speed + across, rolling=False
                )
        return self, None

    def _measured(self, reading: Inertial) -> tuple[MotionModel, Increment]:
        wheels, witnessed = self.wheels, self.fresh
        rolling = wheels is not None and reading.stamp - wheels.stamp < self.silence
        left, right = (wheels.left, wheels.right) if wheels is not None and rolling else (0.0, 0.0)
        force = _LEVEL_FORCE if self.sensors.flat else reading.specific_force
        rate = reading.angular_velocity
        rate_sum, rate_count = self.rate_sum + rate, self.rate_count + 1
        witness, covered = rate_sum / rate_count, (reading.stamp - self.compared) / SECOND
        increment = Increment(
            reading.stamp, rate, force, left, right, rolling, witnessed, witness, covered
        )
        compared = self.compared
        if witnessed:
            rate_sum, rate_count, compared = _NO_RATE, 0, reading.stamp
        model = MotionModel(
            self.sensors, self.track, self.silence, wheels, False, rate_sum, rate_count, compared,
            self.odometry, self.gyro,
        )  # fmt: skip
        return model, increment

    def _levelled(self, reading: Inertial) -> Inertial:
        """Return a reading without what a level floor rules out: turning about other axes than the vertical."""
        if not self.sensors.flat:
            return reading
        rate = reading.angular_velocity * (0.0, 0.0, 1.0)
        return replace(reading, angular_velocity=rate, specific_force=_LEVEL_FORCE)

    def _displaced(self, reading: Odometry) -> Increment:
        """However long ago the pose before was, the difference is what the wheels counted since then."""
        before = self.odometry
        if before is None:
            return _stepped(reading.stamp, Pose.identity())
        step = odometry_step(before, reading)
        return _stepped(reading.stamp, Pose.identity() if step is None else step)

    def _counted(self, reading: WheelSpeeds) -> Increment:
        seconds = (reading.stamp - self.wheels.stamp) / SECOND if self.wheels is not None else 0.0
        return _stepped(reading.stamp, arc_step(*rolled_arc(reading, seconds, self.track)))

    def _rolled(self, stamp: int, left: float, right: float, *, rolling: bool = True) -> Increment:
        rate = np.array([0.0, 0.0, (right - left) / self.track])
        return Increment(
            stamp, rate, _LEVEL_FORCE, left, right, rolling, False, witness=rate, covered=0.0
        )


def _stepped(stamp: int, step: Pose) -> Increment:
    return Increment(
        stamp, _NO_RATE, _LEVEL_FORCE, 0.0, 0.0, True, False, witness=_NO_RATE, covered=0.0,
        step=step,
    )  # fmt: skip
