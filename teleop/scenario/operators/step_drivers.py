"""Clients that drive steps: one leaves them to the robot, the other counts time as the thesis' program does."""

from __future__ import annotations

import math
from typing import Final

from localization.types import SECOND
from teleop.scenario.operators.wire import Answer, Wire
from teleop.step_commands.commands import Step

PERIOD: Final = SECOND // 10
"""Period of the velocities of the client that counts time [ns]: 10 Hz."""

SPEED: Final = 0.3
"""Forward speed of all straight steps [m/s]."""

TURN: Final = math.radians(15.0)
"""Turn rate of the client that counts time [rad/s]: that of the thesis."""


class ByTime:
    """Publishes a velocity at 10 Hz until speed times elapsed time reaches the distance, and then a zero."""

    name = "time"
    outcome = "done"

    def __init__(self) -> None:
        self._speed = self._turn = self._duration = 0.0
        self._begin: int | None = None
        self._next = 0

    def begin(self, wire: Wire, step: Step) -> None:
        """Begin a step."""
        self._speed = math.copysign(SPEED, step.distance) if step.distance else 0.0
        self._turn = math.copysign(TURN, step.angle) if step.angle else 0.0
        self._duration = abs(step.distance) / SPEED or abs(step.angle) / TURN
        self._begin = None

    def act(self, wire: Wire, now: int) -> bool:
        """Publish what is due at a time [ns]; return whether the zero has been published."""
        if self._begin is None:
            self._begin = self._next = now
        if now < self._next:
            return False
        self._next = now + PERIOD
        # A nanosecond of rounding must not cost a period.
        over = (now - self._begin) / SECOND >= self._duration - 1e-9
        speed, turn = (0.0, 0.0) if over else (self._speed, self._turn)
        twist = {
            "linear": {"x": speed, "y": 0.0, "z": 0.0},
            "angular": {"x": 0.0, "y": 0.0, "z": turn},
        }
        wire.publish("/cmd_vel", "geometry_msgs/Twist", twist)
        return over


class ByRobot:
    """Sends goals of the action ``/move``, measured by the wheels or by the localiser."""

    def __init__(self, measure_by: str) -> None:
        """Choose what the robot measures by: ``odometry`` or ``localization``."""
        self.name = measure_by
        self.outcome = ""
        """How the last step ended, as the robot's result says."""

        self._waiting = False

    def begin(self, wire: Wire, step: Step) -> None:
        """Begin a step."""
        self._waiting = True
        goal = {
            "distance": step.distance,
            "angle": step.angle,
            "speed": SPEED if step.distance else 0.0,
            "measure_by": self.name,
        }
        wire.goal("/move", "farsteer_msgs/action/Move", goal, self._answered)

    def act(self, wire: Wire, now: int) -> bool:
        """Return whether the result is there."""
        return not self._waiting

    def _answered(self, answer: Answer) -> None:
        self._waiting = False
        self.outcome = "refused" if answer.failure else str(answer.values["outcome"])
