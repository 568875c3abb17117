"""An operator as models of people describe one: it steers by two points, sees late, and looks away at times.

The law is the two-point visual control of D. D. Salvucci and R. Gray, "A two-point visual control model of
steering", Perception 33 (2004), 1233-1248: what the hand changes is proportional to the change of the directions to
a near and a far point of the way, and to the direction to the near one,

    d(hand) = k_far d(theta_far) + k_near d(theta_near) + k_i theta_near dt.

There the hand turns a car's wheel; here it holds a stick that asks for a turn rate, and the gains are ones for that
(see ``_FAR_GAIN``). Between two looks the hand stays as it is, so the way is corrected in steps.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.geometry import wrap_angle
from localization.types import SECOND, Pose, Twist
from teleop.scenario.files.operator_settings import Steering
from teleop.scenario.operators.driving import DrivingOperator
from teleop.scenario.operators.hands import Hands
from teleop.scenario.operators.operator import Briefing, GoalPlace
from teleop.scenario.operators.random_events import RandomEvents
from teleop.scenario.operators.wire import Wire
from teleop.scenario.route_path import RoutePath, direction_to

_HABITS: Final = Steering("steering")

_FAR_GAIN: Final = 1.4
"""``k_far``: change of the turn rate per change of the far point's direction [1/s].

With a stick that asks for a turn rate the directions answer to the hand as an integrator does, so that the loop
crosses over at ``k_far + k_near`` = 1.8 rad/s: with 0.3 s of reaction, 0.1 s to the next look and 0.1 s of the
robot's own it keeps a phase margin of 38 degrees there; with 0.67 s of reaction there is none left.
"""
_NEAR_GAIN: Final = 0.4
"""``k_near``: change of the turn rate per change of the near point's direction [1/s]."""

_NEAR_INTEGRAL: Final = 0.4
"""``k_i``: growth of the turn rate per direction of the near point [1/s²]: it brings the robot onto its way."""

_NEAR_TIME: Final = 1.0
"""Time ahead at which the near point is [s], at the speed of straight stretches; 0.4 m away at least."""

_FAR_TIME: Final = 2.5
"""Time ahead at which the far point is [s], at that speed; 1 m away at least."""

_LOOK: Final = SECOND // 5
"""Time from one look to the next [ns]."""

_TURN_LIMIT: Final = 1.2
"""Largest turn rate [rad/s]: the stick's full deflection."""

_CORNER: Final = np.deg2rad(70.0)
"""Direction of the near point from which on a person stops and turns on the spot [rad]."""

_FACING: Final = np.deg2rad(20.0)
"""Direction of the near point at which such a turn is over [rad]."""

_CORNER_TURN: Final = 0.8
"""Turn rate on the spot [rad/s]."""

_OFF_THE_WAY: Final = 1.5
"""Distance from its way at which a robot has been carried off it [m]."""


@dataclass(frozen=True, slots=True)
class _Look:
    """What is seen of the way at one moment."""

    time: int
    """Robot time [ns]."""
    near: float
    """Direction to the near point, left positive [rad]."""
    far: float
    """Direction to the far point [rad]."""
    left: float
    """Distance to where the robot is to stop [m]; inf if it is not."""


class SteeringModel(DrivingOperator):
    """Steers as a model of people does; drawn by the scenario's seed."""

    def __init__(self, habits: Steering = _HABITS) -> None:
        """Take the person's habits."""
        super().__init__(Hands())
        self._habits, self._reaction = habits, round(habits.reaction_time * SECOND)
        self._path: RoutePath | None = None
        self._goal: GoalPlace | None = None
        self._seen: deque[_Look] = deque()
        self._last: _Look | None = None
        self._hand = 0.0
        self._spinning = 0.0
        self._held = Twist.planar(0.0, 0.0)
        self._next_look = self._away_until = 0

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Begin with a sequence of lapses of its own."""
        super().begin(wire, briefing)
        self._away = RandomEvents(f"{briefing.seed} lapses", self._habits.lapses)

    def wanted(self, now: int) -> Twist:
        """Return the velocity to ask for: while the person looks away, the one of before."""
        if now < self._away_until:
            return self._held
        if self._away.due(now):
            self._away_until = now + self._away.lasting(self._habits.lapse)
            return self._held
        self._held = super().wanted(now)
        return self._held

    def steer(self, pose: Pose, now: int) -> Twist:
        """Return what the hand does about what was seen a reaction time ago."""
        self._see(pose, now)
        if now < self._next_look:
            return self._held
        look = None
        while self._seen and self._seen[0].time <= now - self._reaction:
            look = self._seen.popleft()
        if look is None:
            return self._held
        self._next_look = now + _LOOK
        return self._react(look)

    def _react(self, look: _Look) -> Twist:
        last, self._last = self._last, look
        if self._spinning or abs(look.near) > _CORNER:
            self._spinning = self._spinning or float(np.sign(look.near))
            if abs(look.near) > _FACING:
                return Twist.planar(0.0, self._spinning * _CORNER_TURN)
            self._spinning = self._hand = 0.0
            last = None
        if last is not None:
            seconds = min((look.time - last.time) / SECOND, 1.0)
            self._hand += (
                _FAR_GAIN * wrap_angle(look.far - last.far)
                + _NEAR_GAIN * wrap_angle(look.near - last.near)
                + _NEAR_INTEGRAL * look.near * seconds
            )
        self._hand = float(np.clip(self._hand, -_TURN_LIMIT, _TURN_LIMIT))
        share = max(0.3, 1.0 - abs(look.far) / _CORNER)
        return Twist.planar(min(self._habits.speed * share, 0.1 + 0.6 * look.left), self._hand)

    def _see(self, pose: Pose, now: int) -> None:
        here, goal = pose.position[:2], self.progress.goal
        if self._path is None or goal is not self._goal:
            self._path = RoutePath(self.progress.way(here))
        elif self._path.follow(here) > _OFF_THE_WAY:
            self._path = RoutePath(self.progress.way_anew(here))
        self._goal = goal
        near = self._path.ahead(max(0.4, _NEAR_TIME * self._habits.speed))
        far = self._path.ahead(max(1.0, _FAR_TIME * self._habits.speed))
        stop = self.progress.ends_here
        left = float(np.hypot(*(np.array(goal.at) - here))) if stop else np.inf
        self._seen.append(_Look(now, direction_to(pose, near), direction_to(pose, far), left))
