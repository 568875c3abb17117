"""What the platform should do, from what the robot's inertial unit feels: its tilt itself, or classical washout.

Washout (Reid and Nahon 1986, after Conrad and Schmidt): accelerations pass a high-pass filter, so that the platform
drifts back to its middle; those that last are felt by tilting; turns pass a high-pass filter as well. The constants
are those of the open implementation ``shoarai/washout``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from teleop.bridges.motion_platform.bridge_config import Cueing
from teleop.bridges.motion_platform.limited_motion import PERIOD
from teleop.bridges.motion_platform.platform import FloatArray

GRAVITY: Final = 9.80665
"""Standard gravity [m/s^2]."""
_HIGH: Final = 2.5
"""Corner of the high-pass filters, of second order for accelerations and of first for turns [rad/s]."""
_LOW: Final = 5.0
"""Corner of the low-pass filter of second order, damped critically, by which lasting accelerations become tilt [rad/s]."""
TILT_RATE: Final = np.radians(2.0)
"""Greatest rate of the tilt that stands for acceleration [rad/s]: people do not notice turns below 2 to 3 deg/s; the
platform exceeds it by a third while it catches up with what its acceleration limit held back."""


@dataclass(frozen=True, slots=True, eq=False)
class Feeling:
    """What the robot's inertial unit says at one instant, in base_link."""

    orientation: FloatArray
    """Quaternion (4,) xyzw."""
    turn_rate: FloatArray
    """(3,) [rad/s]."""
    force: FloatArray
    """Specific force (3,): acceleration less gravity, +9.8 upwards at rest [m/s^2]."""

    def tilt(self) -> FloatArray:
        """Return roll and pitch (2,) [rad]."""
        _, pitch, roll = Rotation.from_quat(self.orientation).as_euler("ZYX")
        return np.array([roll, pitch])


Cues: TypeAlias = Callable[[Feeling, float], FloatArray]
"""Returns the target (6,) after one more period, by what was felt and how long ago that was [s]."""


class Washout:
    """The classical washout. Owns the states of its filters."""

    def __init__(self, gain: float) -> None:
        """Take the share of accelerations and turns that the platform shows."""
        self._gain = gain
        self._moved, self._moving = np.zeros(3), np.zeros(3)
        self._slow, self._slowing = np.zeros(2), np.zeros(2)
        self._tilted, self._turned = np.zeros(2), np.zeros(3)

    def step(self, feeling: Feeling, age: float) -> FloatArray:
        """Return the target (6,)."""
        force = self._gain * (feeling.force - [0.0, 0.0, GRAVITY])
        # High-pass of second order and twice an integral, in one: x'' + 2 w x' + w^2 x = a. What gravity adds on a
        # slope lasts, and so the tilt below takes it over.
        pull = force - 2.0 * _HIGH * self._moving - _HIGH**2 * self._moved
        self._moving = self._moving + pull * PERIOD
        self._moved = self._moved + self._moving * PERIOD
        # To be pressed back into the seat the platform leans back: pitch, positive with the nose down, is negative.
        pressed = np.array([force[1], -force[0]])
        ease = _LOW**2 * (pressed - self._slow) - 2.0 * _LOW * self._slowing
        self._slowing = self._slowing + ease * PERIOD
        self._slow = self._slow + self._slowing * PERIOD
        wanted = np.arcsin(np.clip(self._slow / GRAVITY, -1.0, 1.0))
        most = TILT_RATE * PERIOD
        self._tilted = self._tilted + np.clip(wanted - self._tilted, -most, most)
        self._turned = (self._turned + self._gain * feeling.turn_rate * PERIOD) / (
            1.0 + _HIGH * PERIOD
        )
        turned = self._turned + [*self._tilted, 0.0]
        return np.concatenate([self._moved, turned])


def cues(kind: Cueing, gain: float) -> Cues:
    """Return a rule in its first state, for a share of what is felt."""
    if kind == "washout":
        return Washout(gain).step

    def tilt(feeling: Feeling, age: float) -> FloatArray:
        """Tilt as the robot does, carried on by its turn rate for the age of what is known."""
        roll, pitch = gain * (feeling.tilt() + feeling.turn_rate[:2] * age)
        return np.array([0.0, 0.0, 0.0, roll, pitch, 0.0])

    return tilt
