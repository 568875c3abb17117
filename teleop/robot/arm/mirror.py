"""A second arm that follows the robot's: how far it is off, and how far behind."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND
from robot_sim.arm.arm_table import ArmTable
from teleop.robot.arm.arm_fit import unfelt
from teleop.robot.arm.mirror_delay import delay_of

LOST: Final = SECOND // 2
"""Time without angles after which the second arm is lost [ns]."""
LATE: Final = 0.15
"""Time behind beyond which an operator should know [s]: goal 0.06, and people notice about twice that."""
PATIENCE: Final = SECOND // 2
"""Time for which an error lasts before it is said [ns]."""
MARGIN: Final = np.radians(1.0)
"""What an error may be beyond what servos explain, such as sagging under a load [rad]."""

_WINDOW: Final = 2 * SECOND
"""Time over which the delay is looked for [ns]."""
_SELDOM: Final = SECOND // 2
"""Time between two searches for the delay [ns]."""

MirrorStatus = Literal["following", "behind", "off", "lost"]
"""As ``farsteer_msgs/ArmMirror`` has it."""


@dataclass(frozen=True, slots=True, eq=False)
class MirrorState:
    """The second arm, compared with this one."""

    stamp: int
    """When its angles came back [ns]."""
    angles: FloatArray
    """Its angles, shape (5,) [rad]."""
    error: FloatArray
    """Of each joint against what this arm was at the same time, shape (5,) [rad]."""
    behind: float
    """Time by which it follows, as the last motion has shown [s]."""
    age: float
    """Time since its angles came [s]."""
    status: MirrorStatus
    """How it does."""
    reason: str
    """The same for people."""


class ArmMirror:
    """Compares a second arm's angles with this arm's. Owns the last seconds of both."""

    def __init__(self, table: ArmTable) -> None:
        """Begin without a second arm."""
        self._joints = [f"{joint.turns} ({joint.name})" for joint in table.joints]
        self._explained = explained(table)
        self._own: deque[tuple[int, FloatArray]] = deque()
        self._others: deque[tuple[int, FloatArray]] = deque()
        self._source: str | None = None
        self._measured = True
        self._behind = 0.0
        self._searched = 0
        self._fine = 0

    def moved(self, stamp: int, angles: FloatArray) -> None:
        """Take this arm's measured angles, shape (5,) [rad], at a time [ns] that rises from call to call."""
        _keep(self._own, stamp, angles, _WINDOW + SECOND)

    def take(
        self, stamp: int, degrees: Sequence[float], *, source: str, measured: bool = True
    ) -> str:
        """Take the second arm's angles.

        Args:
            stamp: When they came [ns].
            degrees: Angles of the five joints, and perhaps of more servos [deg].
            source: Who sent them.
            measured: Whether they were measured; otherwise they are what its board writes.

        Returns:
            Why they are not taken; empty if they are.
        """
        angles = np.radians(np.asarray(degrees, dtype=np.float64))
        if angles.size < len(self._joints) or not np.all(np.isfinite(angles)):
            return f"data must be {len(self._joints)} finite angles or more [deg]"
        if self._others and stamp - self._others[-1][0] < LOST and source != self._source:
            return f"{self._source} sends the angles of a second arm already; end one of the two"
        if not self._others or stamp - self._others[-1][0] >= LOST:
            self._others.clear()
            self._fine = stamp
        self._source, self._measured = source, measured
        _keep(self._others, stamp, angles[: len(self._joints)], _WINDOW)
        if stamp - self._searched >= _SELDOM:
            self._searched = stamp
            self._search()
        if np.all(np.abs(self._error_behind()) <= self._explained + MARGIN):
            self._fine = stamp
        return ""

    def state(self, now: int) -> MirrorState | None:
        """Return how the second arm does at a time [ns]; None if there has never been one."""
        if not self._others or not self._own:
            return None
        stamp, angles = self._others[-1]
        age = (now - stamp) / SECOND
        status, reason = self._judge(now, age)
        error = angles - self._at(stamp)
        return MirrorState(stamp, angles, error, self._behind, age, status, reason)

    def _judge(self, now: int, age: float) -> tuple[MirrorStatus, str]:
        last = self._others[-1][0]
        if now - last >= LOST:
            return "lost", (
                f"no angles of the second arm for {age:.1f} s: are its board and `farsteer servo-bridge` connected?"
            )
        if last - self._fine >= PATIENCE:
            error = self._error_behind()
            worst = int(np.argmax(np.abs(error) - self._explained))
            off, fine = np.degrees([error[worst], self._explained[worst]])
            return "off", (
                f"the second arm's {self._joints[worst]} is {off:+.1f} deg off; its servos explain {fine:.1f}"
            )
        how = "" if self._measured else ", as its board writes: its servos have no feedback wires"
        if self._behind > LATE:
            return "behind", f"the second arm follows {1e3 * self._behind:.0f} ms behind{how}"
        return "following", f"the second arm follows{how}"

    def _error_behind(self) -> FloatArray:
        """Return the error against what this arm was as long ago as the second one is behind."""
        stamp, angles = self._others[-1]
        return angles - self._at(stamp - round(self._behind * SECOND))

    def _at(self, stamp: int) -> FloatArray:
        """Return this arm's angles at a time [ns], between those that were measured."""
        later_time, later = self._own[-1]
        for time, angles in reversed(self._own):  # it is among the last
            if time <= stamp:
                share = (stamp - time) / (later_time - time) if later_time > time else 0.0
                return angles + min(share, 1.0) * (later - angles)
            later_time, later = time, angles
        return later

    def _search(self) -> None:
        since = self._others[0][0]
        delay = delay_of(
            np.array([(stamp - since) / SECOND for stamp, _ in self._own]),
            np.array([angles for _, angles in self._own]),
            np.array([(stamp - since) / SECOND for stamp, _ in self._others]),
            np.array([angles for _, angles in self._others]),
        )
        if delay is not None:
            self._behind = delay


def explained(table: ArmTable) -> FloatArray:
    """Return the largest difference of two healthy arms at rest, shape (5,) [rad].

    That is the rounding to whole degrees and of the lines, a step of the board's converter, and the dead band of either
    arm with half of its play: where one was led to its place from above, the other one may have been from below.
    """
    # 0.05 degrees of the lines' decimals on their way there, and on their way back.
    fixed = np.radians(0.5 + 2 * 0.05 + 0.36)
    limits: FloatArray = fixed + 2 * unfelt(table)
    return limits


def _keep(
    past: deque[tuple[int, FloatArray]], stamp: int, angles: FloatArray, duration: int
) -> None:
    past.append((stamp, np.array(angles, dtype=np.float64)))
    while past[0][0] < stamp - duration:
        past.popleft()
