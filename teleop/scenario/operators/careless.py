"""An operator that makes mistakes: those that people make, one after the other, at random times.

It keeps the stick forward, corrects late, goes on while the robot does not know where it is, and notices only after
a while that the robot has stopped listening. Its mistakes are drawn from ``MISTAKES``.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from localization.types import SECOND, Pose, Twist
from teleop.scenario.files import operator_settings as settings
from teleop.scenario.operators.goal_progress import GoalProgress
from teleop.scenario.operators.hands import Hands
from teleop.scenario.operators.operator import Briefing, GoalPlace, Operator
from teleop.scenario.operators.random_events import RandomEvents
from teleop.scenario.operators.robot_view import RobotView
from teleop.scenario.operators.wire import Wire
from teleop.scenario.route_path import RoutePath, direction_to

MISTAKES: Final = (
    "deadman",
    "full_stick",
    "silence",
    "stale_stamps",
    "wrong_hint",
    "hint_and_undo",
    "undo",
    "search",
    "estop",
    "too_fast",
    "take_over",
    "turns",
)
"""What it may do: let the deadman go, push the stick into a corner, send nothing, send stamps of a clock that stands,
hint at a wrong pose, hint at a near one and undo it, ask for an undo, ask for a search of the map, press the e-stop and
release it, ask on ``/cmd_vel`` for more than any robot can do, take the robot over, ask for it, give it, or refuse it."""

ODDITIES: Final = ("backwards", "backwards", "release", "near_hint")
"""What it does besides, if it is odd: drive back for a while, release e-stops of others, hint at a pose that
is so near to the right one that it half fits."""

_HABITS: Final = settings.Careless("careless")

_PERIOD: Final = SECOND // 10
"""Time between two commands [ns]."""

_LATE: Final = np.deg2rad(25.0)
"""Direction of the way from which on it corrects [rad]."""

_CORRECTED: Final = np.deg2rad(5.0)
"""Direction of the way at which a correction ends [rad]."""

_TURN: Final = 0.9
"""Turn rate of a correction [rad/s]."""

_LOOK_AHEAD: Final = 0.9
"""Distance along its way of the point that it drives at [m]."""

_NOTICES: Final = 3 * SECOND // 2
"""Time after which it notices that the robot does not follow [ns]."""

_MEAN: Final = 1.0
"""Mean duration of a mistake that lasts [s]."""

_IMPATIENT: Final = 5 * SECOND
"""Time for which it asks for the release of every e-stop [ns]."""

_NOTICEABLE: Final = {"silence": SECOND // 2, "stale_stamps": SECOND}
"""Silence that the robot's watchdog allows, and age of a command that it follows [ns]; the mistake lasts longer."""

_TOO_FAST: Final = ((5.0, 0.0), (-5.0, 0.0), (0.5, 20.0), (1e300, -1e300))
"""Forward speeds [m/s] and turn rates [rad/s] beyond every limit."""

_TURNS: Final = ("/teleop/ask", "/teleop/give", "/teleop/refuse")
"""Services by which clients take turns."""


class Careless(Operator):
    """Drives to the goals without care."""

    def __init__(self, habits: settings.Careless = _HABITS) -> None:
        """Take its habits."""
        super().__init__()
        self._habits, self._speed = habits, habits.speed
        self._hands = Hands()
        self._path: RoutePath | None = None
        self._goal: GoalPlace | None = None
        self._due = 0
        self._turn = 0.0
        self.mistake = ""
        """The mistake that it makes, one of ``MISTAKES``; empty if it makes none."""

        self._since = self._until = self._back_until = self._impatient_until = 0
        self._unheeded: int | None = None

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Subscribe to the robot's state."""
        self._view, self._progress = RobotView(wire), GoalProgress(briefing)
        self._events = RandomEvents(f"{briefing.seed} mistakes", self._habits.mistakes)
        self._oddities = RandomEvents(f"{briefing.seed} oddities", self._habits.oddities)

    def act(self, wire: Wire, now: int) -> None:
        """Send a command if one is due, and perhaps make a mistake."""
        if now < self._due:
            return
        self._due = max(self._due + _PERIOD, now)
        if self.mistake and now >= self._until:
            self._end(wire)
        if not self.mistake and self._events.due(now):
            self._begin(wire, now)
        if self._oddities.due(now):
            self._be_odd(wire, now)
        if self._view.control == "estop" and now < self._impatient_until:
            wire.call("/teleop/estop_reset")
        self._command(wire, now)

    def _command(self, wire: Wire, now: int) -> None:
        match self.mistake:
            case "deadman":
                self._hands.let_go(wire, self._wanted(now))
            case "full_stick":
                self._hands.hold(wire, self._push)
            case "silence":
                pass
            case "too_fast":
                forward, turn = self._velocity
                message = {"linear": {"x": forward}, "angular": {"z": turn}}
                wire.publish("/cmd_vel", "geometry_msgs/Twist", message)
            case "take_over" | "stale_stamps":
                # It pushes on, though the robot wants a neutral stick first.
                self._hands.stamp_age = now - self._since if self.mistake == "stale_stamps" else 0
                self._hands.hold(wire, self._wanted(now))
            case _ if self._gives_in(now):
                self._hands.neutral(wire)
            case _ if now < self._back_until:
                self._hands.hold(wire, self._back)
            case _:
                self._hands.hold(wire, self._wanted(now))

    def _be_odd(self, wire: Wire, now: int) -> None:
        random = self._oddities.random
        match random.choice(ODDITIES):
            case "backwards":
                self._back_until = now + self._oddities.lasting(_MEAN)
                self._back = Twist.planar(-self._speed, random.choice((-_TURN, 0.0, _TURN)))
            case "release":
                self._impatient_until = now + _IMPATIENT
            case _:
                self._hint(wire, random.uniform(0.2, 1.5), random.choice((-0.3, 0.0, 0.3)))

    def _gives_in(self, now: int) -> bool:
        """Return whether it lets the stick go, for it has noticed that the robot does not follow."""
        if self._view.armed:
            self._unheeded = None
            return False
        self._unheeded = now if self._unheeded is None else self._unheeded
        return now - self._unheeded >= _NOTICES

    def _wanted(self, now: int) -> Twist:
        pose = self._view.pose
        if pose is None:
            return Twist.planar(self._speed, 0.0)
        if self._progress.done or self._progress.arrived(pose.position[:2], now):
            self.done = self._progress.done
            return Twist.planar(0.0, 0.0)
        here, goal = pose.position[:2], self._progress.goal
        if self._path is None or goal is not self._goal:
            self._path, self._goal = RoutePath(self._progress.way(here)), goal
        self._path.follow(here)
        off = direction_to(pose, self._path.ahead(_LOOK_AHEAD))
        if abs(off) > _LATE:
            self._turn = _TURN * float(np.sign(off))
        elif abs(off) < _CORRECTED or off * self._turn < 0.0:
            self._turn = 0.0
        # Even a careless person stops before turning round.
        return Twist.planar(self._speed if abs(off) < np.pi / 3.0 else 0.0, self._turn)

    def _begin(self, wire: Wire, now: int) -> None:
        random = self._events.random
        mistake = random.choice(MISTAKES)
        self._until = now + self._events.lasting(_MEAN)
        self._until += _NOTICEABLE.get(mistake, 0)
        self.mistake, self._since = mistake, now
        match mistake:
            case "full_stick":
                forward, turn = random.choice((-1.0, 1.0)), random.choice((-1.0, 0.0, 1.0))
                self._push = Twist.planar(forward * self._speed, turn * 1.2)
            case "wrong_hint":
                self._hint(wire, random.uniform(0.5, 8.0), random.uniform(-np.pi, np.pi))
            case "hint_and_undo":
                self._hint(wire, random.uniform(0.0, 1.0), random.uniform(-0.3, 0.3))
            case "too_fast":
                self._velocity = random.choice(_TOO_FAST)
            case "take_over":
                wire.call("/teleop/take_over")
            case "turns":
                wire.call(random.choice(_TURNS))
            case "undo":
                wire.call("/localization/undo")
            case "search":
                wire.call("/localization/relocalize")
            case "estop":
                wire.call("/teleop/estop")
            case _:
                pass

    def _hint(self, wire: Wire, off: float, turned: float) -> None:
        """Give a hint that is off by a distance [m] in any direction, and turned [rad]."""
        if (pose := self._view.pose) is not None:
            bearing = self._events.random.uniform(-np.pi, np.pi)
            message = _hint(pose, bearing, off, turned)
            wire.publish("/initialpose", "geometry_msgs/PoseWithCovarianceStamped", message)

    def _end(self, wire: Wire) -> None:
        if self.mistake == "estop":
            wire.call("/teleop/estop_reset")
        elif self.mistake == "hint_and_undo":
            wire.call("/localization/undo")
        self._hands.stamp_age = 0
        self.mistake = ""


def _hint(pose: Pose, bearing: float, off: float, turned: float) -> dict[str, Any]:
    """Return a hint that is off by a distance [m] in a direction, and turned [rad]; it claims the default sigma."""
    x, y = pose.position[0] + off * np.cos(bearing), pose.position[1] + off * np.sin(bearing)
    half = 0.5 * (pose.yaw + turned)
    return {
        "header": {"frame_id": "map"},
        "pose": {
            "pose": {
                "position": {"x": float(x), "y": float(y), "z": float(pose.position[2])},
                "orientation": {"z": float(np.sin(half)), "w": float(np.cos(half))},
            }
        },
    }
