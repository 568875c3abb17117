"""What operators that drive to goals share: arming, waiting while the robot is not localised, a steady rate."""

from __future__ import annotations

from abc import abstractmethod
from typing import Final

from localization.types import SECOND, Pose, Twist
from teleop.scenario.operators.goal_progress import GoalProgress
from teleop.scenario.operators.guard_view import GuardView
from teleop.scenario.operators.hands import Hands
from teleop.scenario.operators.newest_scan import NewestScan
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.robot_view import RobotView
from teleop.scenario.operators.wire import Wire
from teleop.scenario.tour_driver import RELIABLE

_OLD: Final = SECOND
"""Age of the newest pose from which on nobody steers by it [ns]."""

_PATIENCE: Final = 2 * SECOND
"""Time for which the robot is left to find itself before it is moved to be found [ns]."""

_STANDSTILL: Final = Twist.planar(0.0, 0.0)


class DrivingOperator(Operator):
    """Drives to the goals by the published pose; a subclass says how it steers.

    It arms the robot with a neutral stick whenever the robot is not armed, so it goes on after an e-stop. While
    the robot is not localised it stands, and then moves slowly where there is room: a robot that stands still is
    never placed by a search. Where the guard stops it for a while it goes where the guard says that there is room.
    """

    def __init__(self, hands: Hands, *, rate: float = 10.0) -> None:
        """Take the hands; ``rate`` is the number of commands in a second."""
        super().__init__()
        self.hands = hands
        self._period = round(SECOND / rate)
        self._due = 0
        self._lost_since: int | None = None

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Subscribe to the robot's state, to its scanner and to its guard."""
        self.briefing, self.progress = briefing, GoalProgress(briefing)
        self.view, self.scan, self.guard = RobotView(wire), NewestScan(wire), GuardView(wire)

    def act(self, wire: Wire, now: int) -> None:
        """Send a command if one is due."""
        if now < self._due:
            return
        self._due = max(self._due + self._period, now)
        if self.view.others_drive or self.view.control == "estop" or self.done:
            self.hands.rest(wire)
        elif not self.view.armed:
            self.hands.neutral(wire)
        else:
            self.hands.hold(wire, self.wanted(now))

    def wanted(self, now: int) -> Twist:
        """Return the velocity to ask for."""
        pose = self.view.pose
        if pose is None or self.view.health not in RELIABLE:
            self._lost_since = now if self._lost_since is None else self._lost_since
            patient = now - self._lost_since < _PATIENCE
            return _STANDSTILL if patient else self.scan.explore()
        self._lost_since = None
        if now - self.view.seen_at > _OLD:
            return _STANDSTILL
        if self.progress.done:
            self.done = True
        elif not self.progress.arrived(pose.position[:2], now) and not self.progress.done:
            twist = self.steer(pose, now)
            speed = min(float(twist.linear[0]), self.scan.safe_speed())
            return self.guard.around(Twist.planar(speed, float(twist.angular[2])), now)
        return _STANDSTILL

    @abstractmethod
    def steer(self, pose: Pose, now: int) -> Twist:
        """Return the velocity that leads on to the goal.

        Args:
            pose: The newest pose, ``map_from_base``.
            now: Robot time [ns].
        """
