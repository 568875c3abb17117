"""Trapezoid speed profile of a step: speeds up, cruises, and slows down before the end."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from robot_sim import DriveConfig
from teleop.robot.inbox import StepGoal

OWN_SPEED: Final = 0.3
"""Forward speed of a step that names none [m/s]: chosen, a walking pace indoors."""

OWN_TURN: Final = 0.5
"""Turn rate of a step that names none [rad/s]: chosen, as a point 0.6 m from the centre moves at that pace."""

_TIGHT: Final = 0.2
"""Radius below which an arc is driven until its angle, as a turn is [m]: chosen, half a robot's width.

There the millimetre that a distance may lack would be degrees.
"""

_LAG: Final = 0.03
"""Time by which the wheels follow the commands [s]: a tick of 20 ms and the lag of the servos."""

_APPROACH: Final = 0.2
"""Time constant of the last millimetres, over which the speed falls with what remains [s]."""

_BRAKING_SHARE: Final = 0.5
"""Share of the drive's braking that a step counts on, so that it can always keep to the profile."""


def turns(goal: StepGoal) -> bool:
    """Return whether a step is driven until its angle: a turn on the spot, or an arc that is nearly one."""
    return abs(goal.distance) < _TIGHT * abs(goal.angle)


@dataclass(frozen=True, slots=True)
class SpeedProfile:
    """Speeds of one kind of step, in metres or in radians."""

    cruise: float
    """Largest speed [m/s or rad/s]."""
    acceleration: float
    """Largest acceleration [m/s^2 or rad/s^2]."""
    braking: float
    """Largest deceleration [m/s^2 or rad/s^2]."""
    exact: float
    """What may remain at the end [m or rad]; below it the robot stops."""

    @classmethod
    def of(cls, goal: StepGoal, drive: DriveConfig) -> SpeedProfile:
        """Return the profile of a step, within the limits of the drive."""
        if not turns(goal):
            bend = abs(goal.angle / goal.distance)
            own = min(OWN_SPEED, drive.max_speed, OWN_TURN / bend if bend else math.inf)
            speed = min(goal.speed or own, drive.max_turn / bend if bend else math.inf)
            return cls(speed, drive.acceleration, _BRAKING_SHARE * drive.braking, 0.001)
        asked = goal.speed * abs(goal.angle / goal.distance) if goal.distance else goal.speed
        speed = min(asked or OWN_TURN, drive.max_turn)
        braking = _BRAKING_SHARE * drive.turn_braking
        return cls(speed, drive.turn_acceleration, braking, math.radians(0.1))

    def next_speed(self, speed: float, remaining: float, dt: float) -> float:
        """Return the speed to command next, 0 when the step has ended; both speeds have a sign.

        Args:
            speed: The speed commanded last [m/s or rad/s].
            remaining: What remains [m or rad], with the sign of its direction.
            dt: Time since the last command [s].
        """
        left = abs(remaining) - math.copysign(speed, speed * remaining) * _LAG
        if left <= self.exact:
            return 0.0
        ahead = math.copysign(1.0, remaining)
        faster = max(0.0, speed * ahead) + self.acceleration * dt
        slow_enough = min(math.sqrt(2.0 * self.braking * left), left / _APPROACH)
        return ahead * min(self.cruise, faster, slow_enough)

    def duration(self, length: float) -> float:
        """Return about how long a step of a length [m or rad] takes [s]."""
        ramps = 0.5 * self.cruise * (1.0 / self.acceleration + 1.0 / self.braking)
        return abs(length) / self.cruise + ramps + 5.0 * _APPROACH
