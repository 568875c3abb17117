"""Dead reckoning: the wheels' displacement along the attitude of an inertial unit, without scanner and map.

A step of the base is the difference of two poses of its odometry, or what its rims rolled. It counts as a displacement
in the base's own axes, whatever its stamps are, and is turned into the world by the best attitude at hand: the
orientation that the unit's own filter reports, its gyro between such reports, and the wheels' own turning where the
unit is silent. Everything is a frozen value; ``DeadReckoner.take`` returns the next one.

The covariance is that of a linear error state with the constant errors that dominate dead reckoning: of the wheels'
scale, of the reported attitude, of the gyro's bias and of the wheels' turns (Kelly, "Linearized error propagation in
odometry", IJRR 23(2), 2004). They are correlated over time, so that their share grows with the distance from the start
and not with the length of the way. Once the heading is wrong by
more than a radian, as by wheels alone after a few turns, a covariance says no more than the size of the error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from localization.filter.dead_reckoning_config import DeadReckoningConfig
from localization.filter.ekf_config import EkfConfig
from localization.geometry import (
    FloatArray,
    hat,
    rotation_from_euler,
    rotation_from_quaternion,
    so3_exp,
    so3_log,
    wrap_angle,
)
from localization.motion.displacement_step import Displacement
from localization.motion.odometry_noise import OdometryNoise, step_variance
from localization.types import SECOND, Inertial, Pose

_P: Final = slice(0, 3)
_TILT: Final = slice(3, 5)
_F: Final = slice(3, 6)
_G: Final = 6
_SCALE: Final = 7
_BIAS: Final = 8
_TURN: Final = 9
"""Error states: position [m], error of the reported or assumed attitude about the world's axes [rad], error of the
heading since the last report [rad], of the distance's scale, of the gyro's bias [rad/s], of the wheels' turns."""
_SILENCE: Final = 0.5
"""A gyro's rate is a mean over at most this time [s]; after a longer pause its turn is not known."""
_AHEAD: Final = 0.2
"""The gyro's last rate is carried on for at most this long, to the time of the wheels' reading [s]; later the unit
counts as silent."""
_UNKNOWN_YAW: Final = 0.5
"""A heading with a larger sigma than this is no heading: drivers write 1 rad^2 or more for a unit without compass
[rad]."""
_ANY_HEADING: Final = math.pi**2 / 3.0
"""Variance of a heading of which nothing is known, uniform over the circle [rad^2]."""
_REST: Final = 1.0
"""The gyro's mean over this time at rest shows its bias [s]."""
_REST_STEP: Final = 1e-3
"""Wheels that roll less than this [m], or turn by less [rad], in that time rest."""
_RANDOM: Final = OdometryNoise(along=0.02, aside=0.02, heading_share=0.0074, shift=0.02)
"""Smaller along and across the way than the localiser's, for the constant errors of way and turn are states here."""
_REST_GATE: Final = 3.0
"""A rate at rest beyond this many sigmas of the bias is no bias: the robot is being turned."""


@dataclass(frozen=True, slots=True, eq=False)
class DeadReckoner:
    """Pose by dead reckoning with its covariance; a value, of which ``take`` returns the next one."""

    config: DeadReckoningConfig = field(default_factory=DeadReckoningConfig)
    """Errors of wheels and of reported orientations."""
    gyro: EkfConfig = field(default_factory=EkfConfig)
    """Errors of the gyro."""
    random: OdometryNoise = _RANDOM
    """Random errors of the wheels, of which those with time and of height and tilt are not used."""
    flat: bool = False
    """Whether the ground is level, so that only the heading of a reported orientation counts."""
    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,) position in ``odom`` [m]."""
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """(3, 3) attitude in ``odom``: with a reported orientation the frame's x axis has heading zero of the unit."""
    errors: FloatArray | None = None
    """(10, 10) covariance of the error state; None before the first reading."""
    distance: float = 0.0
    """Length of the way so far [m]."""
    speed: float = 0.0
    """Forward speed over the last step [m/s]."""
    rate: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,) angular velocity that the gyro measured last, without its bias [rad/s]."""
    oriented: bool = False
    """Whether an orientation was reported so far."""
    headed: bool = False
    """Whether a heading was reported so far."""
    first_yaw: float = 0.0
    """Heading in ``odom`` at which the drive began [rad]: the first one that was reported, otherwise 0."""
    wheel_turned: int = 0
    """Number of steps whose turn only the wheels measured."""
    bias: float = 0.0
    """Estimate of the bias of the gyro's z axis [rad/s]."""
    inertial_stamp: int | None = None
    """Stamp of the last inertial reading [ns]."""
    turned_until: int | None = None
    """Stamp up to which the attitude contains the robot's turn [ns]."""
    fresh: bool = False
    """Whether an inertial reading has come since the last step."""
    before: FloatArray | None = None
    """(3, 3) attitude at the end of the last step."""
    rest: tuple[float, float, float, float, int] = (0.0, 0.0, 0.0, 0.0, 0)
    """Since the wheels began to rest: time [s], way [m], turn [rad], sum [rad/s] and number of the gyro's rates."""

    def take(self, reading: Inertial | Displacement) -> DeadReckoner:
        """Return the state after a reading, in the order in which they were recorded."""
        begun = self if self.errors is not None else replace(self, errors=self._initial_errors())
        return begun._turned(reading) if isinstance(reading, Inertial) else begun._moved(reading)

    @property
    def pose(self) -> Pose:
        """``odom_from_base``."""
        return Pose.from_rotation(self.position, self.rotation)

    @property
    def covariance(self) -> FloatArray:
        """Covariance (6, 6) of the position in ``odom`` [m] and the rotation in ``base_link`` [rad]."""
        errors = self._errors
        pick = np.zeros((6, 10))
        pick[:3, _P] = np.eye(3)
        pick[3:, _F] = self.rotation.T
        pick[3:, _G] = self.rotation.T[:, 2]
        covariance: FloatArray = pick @ errors @ pick.T
        return covariance

    @property
    def bias_sigma(self) -> float:
        """Error of the gyro's bias, one sigma [rad/s]."""
        return math.sqrt(self._errors[_BIAS, _BIAS])

    @property
    def _errors(self) -> FloatArray:
        return self._initial_errors() if self.errors is None else self.errors

    def _initial_errors(self) -> FloatArray:
        c = self.config
        sigma = np.zeros(10)
        sigma[_TILT] = 1e-4 if self.flat else c.ground_sigma
        sigma[[_SCALE, _BIAS, _TURN]] = c.distance_scale, self.gyro.gyro_bias, c.wheel_turn_scale
        return np.diag(np.square(sigma))

    # Turning

    def _turned(self, reading: Inertial) -> DeadReckoner:
        """Return the state with the attitude after an inertial reading."""
        until = self.turned_until
        passed = 0.0 if until is None else (reading.stamp - until) / SECOND
        state = replace(
            self,
            rate=reading.angular_velocity - (0.0, 0.0, self.bias),
            inertial_stamp=reading.stamp,
            turned_until=reading.stamp,
            fresh=True,
        )
        if 0.0 < passed < _SILENCE:
            state = state._integrated(passed)
        if reading.orientation is not None:
            state = state._reported(reading.orientation, reading.orientation_sigma)
        rest_time, way, turn, total, count = state.rest
        total += float(reading.angular_velocity[2])
        rested = (rest_time + min(max(passed, 0.0), _SILENCE), way, turn, total, count + 1)
        state = replace(state, rest=rested)
        return state._bias_learned() if rested[0] >= _REST else state

    def _integrated(self, seconds: float) -> DeadReckoner:
        """Return the state turned by the gyro's rate for a time [s]."""
        c, errors = self.config, self._errors.copy()
        errors[_G] += seconds * errors[_BIAS]
        errors[:, _G] += seconds * errors[:, _BIAS]
        errors[_G, _G] += self.gyro.gyro_noise**2 * seconds
        errors[_BIAS, _BIAS] += self.gyro.gyro_bias_walk**2 * seconds
        if self.headed:
            errors[5, 5] += c.heading_drift**2 * seconds
        return replace(self, rotation=self._carried(seconds), errors=errors)

    def _carried(self, seconds: float) -> FloatArray:
        """Return the attitude (3, 3) after a time [s] at the gyro's last rate: its yaw alone where tilt is unknown."""
        rate = self.rate if self.oriented and not self.flat else self.rate * (0.0, 0.0, 1.0)
        turned: FloatArray = self.rotation @ so3_exp(rate * seconds)
        return turned

    def _reported(self, quaternion: FloatArray, sigma: FloatArray | None) -> DeadReckoner:
        """Return the state with the attitude that the unit reports; the first one turns what was driven before."""
        c, errors = self.config, self._errors.copy()
        reported = rotation_from_quaternion(quaternion / np.linalg.norm(quaternion))
        given = np.array([c.tilt_sigma, c.tilt_sigma, c.heading_sigma]) if sigma is None else sigma
        heading = bool(given[2] < _UNKNOWN_YAW)
        own, yaw = (math.atan2(r[1, 0], r[0, 0]) for r in (self.rotation, reported))
        if not heading:
            # Its roll and pitch are as good as any; only the heading stays that of gyro or wheels.
            reported = rotation_from_euler(0.0, 0.0, own - yaw) @ reported
        if self.flat:
            reported = rotation_from_euler(0.0, 0.0, yaw if heading else own)
        state = self
        if not self.oriented and not self.flat:
            errors[_TILT] = errors[:, _TILT] = 0.0
            errors[_TILT, _TILT] = np.diag(np.square(given[:2]))
        if heading:
            if not self.headed:
                late = wrap_angle(yaw - own)
                turn = rotation_from_euler(0.0, 0.0, late)
                state = replace(
                    state,
                    position=turn @ self.position,
                    first_yaw=wrap_angle(self.first_yaw + late),
                )
                errors[5] = errors[:, 5] = 0.0
                errors[5, 5] = given[2] ** 2
            errors[_G] = errors[:, _G] = 0.0
        return replace(
            state,
            rotation=reported,
            before=reported if not self.headed and heading else state.before,
            errors=errors,
            oriented=True,
            headed=self.headed or heading,
        )

    def _bias_learned(self) -> DeadReckoner:
        """Return the state after a second in which the wheels rested; the gyro's mean then shows its bias."""
        begun = replace(self, rest=(0.0, 0.0, 0.0, 0.0, 0))
        _, way, turn, total, count = self.rest
        if way > _REST_STEP or turn > _REST_STEP or not count:
            return begun
        errors, c = self._errors, self.config
        surprise = total / count - self.bias
        variance = float(errors[_BIAS, _BIAS]) + c.rest_noise**2
        if surprise**2 > _REST_GATE**2 * variance:
            return begun
        gain = errors[:, _BIAS] / variance
        change = gain * surprise
        # A bias was added to every heading since: what it added is taken back, with the position that followed from it.
        return replace(
            begun,
            errors=errors - np.outer(gain, errors[_BIAS]),
            bias=self.bias + float(change[_BIAS]),
            position=self.position - change[_P],
            rotation=rotation_from_euler(0.0, 0.0, -float(change[_G])) @ self.rotation,
        )

    # Moving

    def _moved(self, step: Displacement) -> DeadReckoner:
        """Return the state after a step of the wheels."""
        c, errors = self.config, self._errors.copy()
        begin = self.rotation if self.before is None else self.before
        end, by_wheels = self._attitude_at(step)
        relative = so3_log(begin.T @ end)
        middle = begin @ so3_exp(0.5 * relative)
        # The chord of an arc is shorter than the arc by this factor.
        half = 0.5 * float(np.linalg.norm(relative))
        shorter = math.sin(half) / half if half > 1e-6 else 1.0
        along = np.array([step.forward, step.left, 0.0])
        moved: FloatArray = shorter * (middle @ along)
        way = float(np.hypot(step.forward, step.left))
        turned = Pose.planar(step.forward, step.left, float(relative[2]))
        added = step_variance(turned, 0.0, self.random)
        if by_wheels:
            errors[_G] += step.turn * errors[_TURN]
            errors[:, _G] += step.turn * errors[:, _TURN]
            errors[_G, _G] += added.heading
            if max(errors[_G, _G], self._errors[_G, _G]) >= _ANY_HEADING:
                # Nothing more can be unknown of a heading, and turning back makes none known again.
                errors = _rescaled(errors, _G, _ANY_HEADING)
            # A heading that is wrong by e shortens the way along it by e^2 / 2, which no linear state holds.
            shortened = min(0.75 * errors[_G, _G] ** 2, 1.0)
            errors[_SCALE, _SCALE] = max(errors[_SCALE, _SCALE], c.distance_scale**2 + shortened)
        transition = np.eye(10)
        transition[_P, _F] = -hat(moved)
        transition[_P, _G] = -hat(moved)[:, 2]
        transition[_P, _SCALE] = moved
        errors = transition @ errors @ transition.T
        errors[_P, _P] += (middle * (added.along, added.aside, 0.0)) @ middle.T
        rest = self.rest
        return replace(
            self,
            position=self.position + moved,
            rotation=end if by_wheels else self.rotation,
            # The gyro shall not add the turn that the wheels have made.
            turned_until=step.stamp if by_wheels else self.turned_until,
            before=end,
            errors=errors,
            distance=self.distance + way,
            speed=step.forward / step.seconds if step.seconds > 0.0 else self.speed,
            wheel_turned=self.wheel_turned + int(by_wheels),
            fresh=False,
            rest=(rest[0], rest[1] + way, rest[2] + abs(step.turn), rest[3], rest[4]),
        )

    def _attitude_at(self, step: Displacement) -> tuple[FloatArray, bool]:
        """Return the attitude (3, 3) at the end of a step, and whether only the wheels measured its turn."""
        stamp = self.inertial_stamp
        since = math.inf if stamp is None else (step.stamp - stamp) / SECOND
        if stamp is not None and (self.fresh or abs(since) < _AHEAD):
            # A unit that is fresh and far away by its stamps has another clock.
            return self._carried(max(since, 0.0) if since < _AHEAD else 0.0), False
        begin = self.rotation if self.before is None else self.before
        turned: FloatArray = begin @ rotation_from_euler(0.0, 0.0, step.turn)
        return turned, True


def _rescaled(errors: FloatArray, state: int, variance: float) -> FloatArray:
    """Return a covariance with another variance of one state, its correlations unchanged."""
    scale = np.ones(len(errors))
    scale[state] = math.sqrt(variance / errors[state, state])
    rescaled: FloatArray = errors * np.outer(scale, scale)
    return rescaled
