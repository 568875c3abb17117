"""What the robot does after its driver has fallen silent: how long and how far it still moves."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.types import SECOND
from robot_sim import TICK_NS
from teleop.robot.safety.control_state import ControlMode, ControlState, SafetyConfig
from teleop.robot.tick_record import TickRecord

_RESTING: Final = 0.01
"""Speed below which the robot rests, forward or sideways [m/s]; and turn rate [rad/s], twice that."""
_SILENCE: Final = SafetyConfig().watchdog
"""Age of the last command from which on the driver is silent, whatever the robot makes of it [ns]."""


class Silences:
    """Measures each stop that the robot made of itself; owns the last command's time and place.

    A robot that does not stop is measured too: it cannot hide by keeping quiet about its driver's silence.
    """

    def __init__(self) -> None:
        self.count = 0
        """Number of times that a driver lost its authority while the robot moved."""

        self.longest_time = 0.0
        """Longest time from a last command to rest, or to the end of the run if that was sooner [s]."""

        self.longest_way = 0.0
        """Longest way from a last command to rest, or to the end of the run [m]."""

        self.oldest_command = 0.0
        """Largest age at which a command other than zero was in force [s]."""

        self._way = 0.0
        self._armed = self._moving = False
        self._driver = ""
        self._command = 0
        self._way_at_command = 0.0
        self._since: tuple[int, float] | None = None

    def take(self, tick: TickRecord) -> str | None:
        """Take one tick; return how the robot has stopped of itself, if it does so with this tick."""
        control, twist = tick.control, tick.truth.twist
        begun, now = self._way, tick.stamp - TICK_NS
        self._way += float(np.hypot(twist.linear[0], twist.linear[1])) * (TICK_NS / SECOND)
        fresh = self._follow_commands(control, now, begun)
        moving = bool(control.twist.linear.any() or control.twist.angular.any())
        resting, armed = _rests(tick), control.control is ControlMode.ARMED
        lost = self._armed and not armed
        stopped = lost and (self._moving or not resting)
        self._armed, self._moving = armed, moving
        age = now - self._command
        if moving:
            self.oldest_command = max(self.oldest_command, age / SECOND)
        if armed and moving and fresh:
            self._since = None  # somebody drives again before it has come to rest
        elif self._since is None and (stopped or (moving and age > _SILENCE and not resting)):
            self._since = self._command, self._way_at_command
        self._measure(tick.stamp, resting)
        self.count += stopped
        if not lost:
            return None
        return f"{'stopped' if stopped else 'not driven any more, at rest'}: {control.reason}"

    def _follow_commands(self, control: ControlState, now: int, way: float) -> bool:
        """Note the last command of who drives; return whether there is a new one."""
        command = now - control.command_age
        if not control.controller or (control.controller, command) == (self._driver, self._command):
            return False
        self._driver, self._command, self._way_at_command = control.controller, command, way
        return True

    def _measure(self, stamp: int, resting: bool) -> None:
        if self._since is not None:
            begun, way = self._since
            self.longest_time = max(self.longest_time, (stamp - begun) / SECOND)
            self.longest_way = max(self.longest_way, self._way - way)
            if resting:
                self._since = None


def _rests(tick: TickRecord) -> bool:
    twist = tick.truth.twist
    return bool(
        np.abs(twist.linear[:2]).max() < _RESTING and abs(twist.angular[2]) < 2.0 * _RESTING
    )
