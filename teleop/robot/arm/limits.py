"""Bounds of every motion of the arm: next states whose speed, acceleration and jerk stay within them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from ruckig import ControlInterface, RuckigError, Synchronization

from localization.geometry import FloatArray
from localization.types.arrays import read_only
from robot_sim.arm.arm_table import JOINTS, ArmTable
from teleop.robot.arm.ruckig_work import RuckigWork

_GAIN: Final = 15.0
"""Share of what is missing to the goal that is made up for in a second [1/s]."""
_SMOOTHING: Final = 0.5
"""Share of a change of speed that is asked for in a tick. With the gain: a noise of 1.5 mm and 0.5 degrees of a hand
at 50 Hz leaves 3.6 mm at the tip, and 22 mm if the bounds are used up to the goal in shortest time."""
_BRAKING: Final = 0.5
"""Share of acceleration and jerk that braking counts on, so that the rest can make up for the ticks."""
_LEAD: Final = 0.03
"""Time that a change of speed takes, with the smoothing [s]; so a step of the goal is not overshot by 0.1 degrees."""
_STANDSTILL: Final = 1e-6
"""Speed that is taken for 0 [rad/s]: with smaller ones Ruckig raises."""
_NOTHING: Final = 1e-9
"""Speed [rad/s] and acceleration [rad/s^2] that remain of rounding after a stop."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How the joints move at an instant, as commanded; the arrays are read-only."""

    angles: FloatArray
    """(5,) [rad]."""
    rates: FloatArray
    """(5,) [rad/s]."""
    accelerations: FloatArray
    """(5,) [rad/s^2]."""
    resting: bool = field(init=False)
    """Whether nothing moves; kept, for an arm at rest is asked several times in each tick."""

    def __post_init__(self) -> None:
        for name in ("angles", "rates", "accelerations"):
            object.__setattr__(self, name, read_only(getattr(self, name), (JOINTS,), name))
        object.__setattr__(self, "resting", not (self.rates.any() or self.accelerations.any()))

    @classmethod
    def at_rest(cls, angles: FloatArray) -> Motion:
        """Return standing still at angles (5,) [rad]."""
        return cls(angles, np.zeros(JOINTS), np.zeros(JOINTS))


class JerkLimiter:
    """Finds the next state of a motion; holds none itself."""

    def __init__(self, table: ArmTable, tick: float) -> None:
        """Take the bounds of an arm.

        Args:
            table: The arm.
            tick: Time from one state to the next [s].
        """
        self.tick = tick
        self._bounds = table.motion
        self._lower, self._upper = np.array(table.lower), np.array(table.upper)
        self._ruckig = RuckigWork(JOINTS)
        given = self._ruckig.given
        given.control_interface = ControlInterface.Velocity
        given.synchronization = Synchronization.No  # a joint does not wait for another
        given.max_velocity = [table.motion.speed] * JOINTS
        given.max_acceleration = [table.motion.acceleration] * JOINTS
        given.max_jerk = [table.motion.jerk] * JOINTS

    def follow(
        self, motion: Motion, angles: FloatArray, rates: FloatArray, share: float = 1.0
    ) -> Motion:
        """Return the state a tick later, on the way to a goal that moves.

        The speed that is wanted is that of the goal and a share of what is missing, as far as it can be braked; Ruckig's
        way to this speed is the shortest within the bounds of acceleration and jerk. Its shortest way to the *angles*
        would answer the noise of a hand with full acceleration, to and fro.

        Args:
            motion: State of now.
            angles: (5,) where the goal is at the end of the tick [rad].
            rates: (5,) how fast it moves there [rad/s].
            share: Of the speed that is allowed.
        """
        missing = angles - rates * self.tick - motion.angles
        # Of what is missing, that which is passed before the speed has changed is no room for braking.
        room = missing - _LEAD * (motion.rates - rates)
        brakable = self.brakable(np.copysign(room, room * missing))
        wanted = rates + np.copysign(np.minimum(_GAIN * np.abs(missing), brakable), missing)
        # Nor is any joint faster than it can brake before its limit.
        ahead = motion.angles + _LEAD * motion.rates
        room = np.array([self._upper - ahead, ahead - self._lower])
        slow = np.minimum(_GAIN * np.maximum(0.0, room), self.brakable(room))
        up, down = np.minimum(slow, share * self._bounds.speed)
        wanted = np.maximum(np.minimum(wanted, up), -down)
        return self.accelerate(motion, motion.rates + _SMOOTHING * (wanted - motion.rates))

    def accelerate(self, motion: Motion, rates: FloatArray) -> Motion:
        """Return the state a tick later, on the shortest way to rates (5,) [rad/s]; those beyond the bound are cut."""
        if self._towards(motion, rates) is None:
            return Motion.at_rest(motion.angles)  # not seen in a million states: the tick goes on
        state = np.array(self._ruckig.path.at_time(self.tick))
        state[1:][np.abs(state[1:]) < _NOTHING] = 0.0
        return Motion(*state)

    def stop(self, motion: Motion) -> Motion:
        """Return the state a tick later, on the shortest way to standstill."""
        return self.accelerate(motion, np.zeros(JOINTS))

    def stopping(self, motion: Motion) -> FloatArray:
        """Return where a motion passes while it stops: (N, 5) at each tick from now, the last at standstill [rad]."""
        if motion.resting:
            return motion.angles[None, :]
        lasts = self._towards(motion, np.zeros(JOINTS))
        if lasts is None:
            return motion.angles[None, :]
        times = [*np.arange(0.0, lasts, self.tick), lasts]
        return np.array([self._ruckig.path.at_time(time)[0] for time in times])

    def brakable(self, distance: FloatArray) -> FloatArray:
        """Return the speeds from which distances suffice to stop [rad/s]; 0 for negative ones.

        Stopping from v with bounds a and j takes v / a + a / j, and half of v times that is the distance.
        """
        a = _BRAKING * self._bounds.acceleration
        slow = a * a / (_BRAKING * self._bounds.jerk)
        speeds: FloatArray = 0.5 * (
            np.sqrt(slow * slow + 8.0 * a * np.maximum(0.0, distance)) - slow
        )
        return speeds

    def _towards(self, motion: Motion, rates: FloatArray) -> float | None:
        """Work out the way to rates; return how long it takes [s], or None if Ruckig refuses it."""
        wanted = np.maximum(np.minimum(rates, self._bounds.speed), -self._bounds.speed)
        wanted[np.abs(wanted) < _STANDSTILL] = 0.0
        given = self._ruckig.given
        given.current_position, given.current_velocity = motion.angles, motion.rates
        given.current_acceleration, given.target_velocity = motion.accelerations, wanted
        try:
            return self._ruckig.calculate()
        except RuckigError:
            return None
