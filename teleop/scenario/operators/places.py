"""An operator that says where to drive instead of steering: one arc after the other, under the deadman."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose, Twist
from teleop.scenario.operators.driving import DrivingOperator
from teleop.scenario.operators.hands import Hands
from teleop.scenario.operators.operator import Briefing, GoalPlace
from teleop.scenario.operators.wire import Answer, Wire
from teleop.scenario.route_path import RoutePath, direction_to
from teleop.step_commands.commands import Step

_FAR, _NEAR = 2.5, 0.5
"""Distances along the way to the next place [m]: what is well seen on the page's picture, and what the robot is long; chosen."""
_ASIDE: Final = math.pi / 4
"""Direction from which on is turned on the spot first [rad], as on the page."""
_OFF_THE_WAY: Final = 1.5
"""Distance from its way at which a robot has been carried off it [m]."""
_STANDSTILL: Final = Twist.planar(0.0, 0.0)


class Places(DrivingOperator):
    """Chooses a place on the way, has the robot drive there, and chooses the next; a nearer one if something stops it."""

    def __init__(self) -> None:
        super().__init__(Hands())
        self._pending, self._reach = 0, _FAR
        self._goal: GoalPlace | None = None
        self._path: RoutePath | None = None

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Begin as others that drive."""
        super().begin(wire, briefing)
        self._wire = wire

    def steer(self, pose: Pose, now: int) -> Twist:
        """Return standstill: the deadman is held, and the robot drives by itself."""
        here, goal = pose.position[:2], self.progress.goal
        if self._path is None or goal is not self._goal or self._path.follow(here) > _OFF_THE_WAY:
            self._path, self._goal = RoutePath(self.progress.way_anew(here)), goal
        if not self._pending:
            for step in way_to(pose, self._path.ahead(self._reach)):
                self._pending += 1
                values: dict[str, object] = {"distance": step.distance, "angle": step.angle}
                values = {**values, "measure_by": "localization", "hold_to_run": True}
                self._wire.goal("/move", "farsteer_msgs/action/Move", values, self._answered)
        return _STANDSTILL

    def _answered(self, answer: Answer) -> None:
        self._pending -= 1
        done = answer.values.get("outcome") == "done"
        self._reach = _FAR if done else max(_NEAR, 0.5 * self._reach)


def way_to(pose: Pose, point: FloatArray) -> tuple[Step, ...]:
    """Return the steps from a pose to a point (2,) [m]: an arc, or a turn and a straight step; none to where it stands."""
    away = float(np.hypot(*(point - pose.position[:2])))
    aside = direction_to(pose, point)
    if away < 0.05:
        return ()
    if abs(aside) > _ASIDE:
        return Step(angle=aside), Step(distance=away)
    # The circle that touches the heading turns by twice the angle of its chord.
    return (Step(distance=away * aside / math.sin(aside) if aside else away, angle=2.0 * aside),)
