"""Turn of a robot between two poses of its odometry, as an inertial unit measured it.

Rates are summed up over the unit's own stamps. What lies between its last reading and a pose is taken at the last
rate and made good with the next reading, so that no error adds up. Over a pause of the unit nothing is known of the
turn, and the wheels' has to serve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from localization.geometry import (
    FloatArray,
    euler_from_rotation,
    rotation_from_quaternion,
    so3_log,
)
from localization.types import SECOND, Inertial, Pose

_LONGEST_MEAN = SECOND // 2
"""A rate is a mean over at most this time [ns]; after a longer pause the turn in between is not known."""
_LONGEST_CARRY = SECOND // 5
"""The last rate is carried on for at most this time to a pose [ns]; later the unit counts as silent."""
_LONGEST_REPORT = SECOND
"""Two reported orientations farther apart than this are not compared with the gyro [ns]."""
_WITNESS = 0.5
"""Wheels and gyro are compared over at least this time [s]: over less, stamps of poses are too rough."""
_REPORT = 1.0
"""Reported orientations and gyro are compared over at least this time [s]."""
_NOTHING = np.zeros(3)
_NOTHING.flags.writeable = False


class TurnWitness(NamedTuple):
    """Turns of the wheels and of the gyro over the same time."""

    wheels: float
    """Turn that the wheels counted [rad]."""
    gyro: float
    """Turn that the gyro measured, its bias included [rad]."""
    seconds: float
    """The time [s]."""
    distance: float
    """Length of the way [m]."""


class ReportedTilt(NamedTuple):
    """Roll and pitch that the unit's own filter reports."""

    roll: float
    """Roll [rad]."""
    pitch: float
    """Pitch [rad]."""
    sigma: float
    """Standard deviation of either [rad]; 0 if it is unknown."""


@dataclass(frozen=True, slots=True, eq=False)
class GyroStep:
    """What an inertial unit measured between two poses of an odometry."""

    turn: FloatArray
    """(3,) rotation vector in the base's axes, the gyro's bias included [rad]."""
    seconds: float
    """Time over which the bias acted [s]."""
    force: FloatArray
    """(3,) mean specific force [m/s^2]."""
    tilt: ReportedTilt | None = None
    """Roll and pitch, if the unit reports an orientation."""
    bias: FloatArray | None = None
    """(3,) bias of the gyro by comparison with the reported orientations, over one second or more [rad/s]; None if
    there is none, or not yet."""
    witness: TurnWitness | None = None
    """The turns of wheels and gyro; None while too little time has passed."""


class GyroTurn(NamedTuple):
    """Sums up what an inertial unit measures until a pose of the odometry takes it; a value."""

    heard: int | None = None
    """Stamp of the last reading [ns]."""
    until: int | None = None
    """Stamp up to which the turn is known [ns]."""
    rate: FloatArray = _NOTHING
    """(3,) last angular velocity [rad/s]."""
    turn: FloatArray = _NOTHING
    """(3,) rotation vector since the last pose [rad]; what was carried ahead to that pose is taken off."""
    broken: bool = True
    """Whether a part of the turn since the last pose is missing."""
    force: tuple[FloatArray, int] = (_NOTHING, 0)
    """(3,) sum of the specific forces since the last pose [m/s^2], and their number."""
    taken: int | None = None
    """Stamp of the last pose [ns]."""
    report: Inertial | None = None
    """The last reading with an orientation that is not a repeated one."""
    own: tuple[FloatArray, FloatArray, float] = (_NOTHING, _NOTHING, 0.0)
    """(3,) rotation vectors by gyro and by reported orientations [rad] over the same time [s]."""
    since_report: FloatArray = _NOTHING
    """(3,) rotation vector by the gyro since the last reported orientation [rad]."""
    witness: TurnWitness = TurnWitness(0.0, 0.0, 0.0, 0.0)
    """Turns of wheels and gyro that were not compared yet."""

    def received(self, reading: Inertial) -> GyroTurn:
        """Return the sum after a reading; one that is not newer than the last adds nothing."""
        if self.heard is not None and reading.stamp <= self.heard:
            return self
        until = self.until
        passed = None if until is None else reading.stamp - until
        force, count = self.force
        after = self._replace(
            heard=reading.stamp,
            until=reading.stamp,
            rate=reading.angular_velocity,
            force=(force + reading.specific_force, count + 1),
        )
        if passed is None or passed > _LONGEST_MEAN:
            after = after._replace(broken=True, report=None)
        elif passed > 0:
            turn = reading.angular_velocity * (passed / SECOND)
            after = after._replace(turn=self.turn + turn, since_report=self.since_report + turn)
        else:
            # Until the last pose, which is newer, the wheels' turn has served.
            after = after._replace(until=until)
        return after._compared(reading)

    def _compared(self, reading: Inertial) -> GyroTurn:
        """Add the reported orientation to those that are compared with the gyro."""
        orientation, last = reading.orientation, self.report
        if orientation is None:
            return self
        begun = self._replace(report=reading, since_report=_NOTHING)
        if last is None or last.orientation is None:
            return begun
        if np.array_equal(orientation, last.orientation):
            # Drivers without a filter of their own write the same quaternion into each message.
            return self
        if reading.stamp - last.stamp > _LONGEST_REPORT:
            return begun._replace(own=(_NOTHING, _NOTHING, 0.0))
        then, now = (rotation_from_quaternion(q) for q in (last.orientation, orientation))
        gyro, reported, seconds = self.own
        passed = (reading.stamp - last.stamp) / SECOND
        own = gyro + self.since_report, reported + so3_log(then.T @ now), seconds + passed
        return begun._replace(own=own)

    def at(self, stamp: int, step: Pose) -> tuple[GyroTurn, GyroStep | None]:
        """Return the sum after a pose of the odometry, and what was measured since the one before.

        Args:
            stamp: of the pose [ns].
            step: displacement of the wheels since the pose before.

        Returns:
            The sum, and the step; None where the unit was silent, so that only the wheels measured the turn.
        """
        before, heard, until = self.taken, self.heard, self.until
        begun = self._replace(taken=stamp, turn=_NOTHING, force=(_NOTHING, 0), broken=False)
        known = heard is not None and until is not None and stamp - heard <= _LONGEST_CARRY
        if not known or self.broken or before is None or until is None:
            # A unit that speaks again continues from here.
            later = stamp if until is None else max(stamp, until)
            return begun._replace(
                until=later, broken=heard is None, witness=TurnWitness(0.0, 0.0, 0.0, 0.0)
            ), None
        carried = self.rate * ((stamp - until) / SECOND)
        turn, seconds = self.turn + carried, max(0.0, (stamp - before) / SECOND)
        force, count = self.force
        gyro, reported, span = self.own
        bias = None
        if span >= _REPORT:
            bias = (gyro - reported) / span
            begun = begun._replace(own=(_NOTHING, _NOTHING, 0.0))
        w = self.witness
        witness = TurnWitness(
            w.wheels + step.yaw,
            w.gyro + float(turn[2]),
            w.seconds + seconds,
            w.distance + float(np.hypot(*step.position[:2])),
        )
        complete = witness.seconds >= _WITNESS
        after = begun._replace(
            turn=-carried,
            witness=TurnWitness(0.0, 0.0, 0.0, 0.0) if complete else witness,
        )
        return after, GyroStep(
            turn=turn,
            seconds=seconds,
            force=force / count if count else _NOTHING,
            tilt=self._tilt(stamp),
            bias=bias,
            witness=witness if complete else None,
        )

    def _tilt(self, stamp: int) -> ReportedTilt | None:
        """Return roll and pitch as reported last, if that was lately."""
        last = self.report
        if last is None or last.orientation is None or stamp - last.stamp > _LONGEST_CARRY:
            return None
        roll, pitch, _ = euler_from_rotation(rotation_from_quaternion(last.orientation))
        sigma = 0.0 if last.orientation_sigma is None else float(last.orientation_sigma[:2].max())
        return ReportedTilt(roll, pitch, sigma)
