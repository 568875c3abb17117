"""The rule: how much of a command the robot can still brake from before it comes too near to a known point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from teleop.robot.guard.braking import Motion, Ramps, along_arc, poses_along, to_standstill
from teleop.robot.guard.outline import Outline
from teleop.robot.guard.points import SOURCES, UNSEEN, Points
from teleop.robot.guard.settings import CREEP, GuardConfig
from teleop.robot.guard.verdict import Near

_SHARES: Final = np.linspace(0.95, 0.05, 19)
"""Factors that are tried if the whole command is not admissible: steps of 0.035 m/s at full speed."""
_SQUEEZE: Final = 0.02
"""Margin at which the robot may still creep out of where it stands too near to something [m]: four sigma of smoothed ranges,
so that who pushes on for minutes waits in vain for a scan that shows more room than there is. What no scanner sees is not
squeezed past."""
_RELEASE: Final = 0.03
"""What the margin grows by while an obstacle stops the robot [m]: more than the nearest of many returns trembles by from
scan to scan, so that it does not twitch (navigation2 PR 2982)."""
_SLACK: Final = 0.2
"""What is this far from a motion does not matter for slower ones, which go the same way, or less far [m]; chosen."""
_STRIDE: Final = 0.02
"""Distance between two poses of an arc that is looked along [m]."""
_FIFTH: Final = 5
"""Each so many of them all points are compared with."""


@dataclass(frozen=True, slots=True)
class Room:
    """How far an arc is free."""

    length: float
    """Way of the robot's centre [m]; in place the angle [rad]."""
    near: Near | None
    """The obstacle that ends it; None if none does."""


@dataclass(frozen=True, slots=True)
class Rule:
    """What is admissible, for one robot; holds no state."""

    outline: Outline
    """The robot's outline."""
    ramps: Ramps
    """How it changes its speeds; of its braking, what is counted on."""
    config: GuardConfig
    """Settings."""

    def braking(self, speeds: tuple[float, float], commands: FloatArray, reaction: float) -> Motion:
        """Return where the robot goes if it follows each of commands (K, 2) and then brakes."""
        fastest = float(np.abs(commands[:, 0]).max()), float(np.abs(commands[:, 1]).max())
        reach, _ = self.bound(speeds, fastest, reaction)
        return to_standstill(speeds, commands, self.ramps, reaction, poses_along(reach))

    def bound(
        self, speeds: tuple[float, float], command: tuple[float, float], reaction: float
    ) -> tuple[float, float]:
        """Return how far any point of the robot goes at most until it stands [m], and how long that takes at most [s]."""
        v, w = (max(abs(a), abs(b)) for a, b in zip(speeds, command, strict=True))
        braking, turning = self.ramps.loss
        way = v * (reaction + 0.5 * v / braking)
        angle = w * (reaction + 0.5 * w / turning)
        return way + self.outline.radius * angle, reaction + max(v / braking, w / turning)

    def margin(self, command: tuple[float, float], *, held: bool = False) -> float:
        """Return the distance that is kept where there is room [m].

        Args:
            command: Forward speed [m/s] and turn rate [rad/s].
            held: Whether an obstacle stops the robot already.
        """
        rim = abs(command[0]) + self.outline.radius * abs(command[1])
        return self.config.margin + _RELEASE * held + self.config.skew * rim

    def share(
        self,
        speeds: tuple[float, float],
        command: tuple[float, float],
        points: Points,
        *,
        reaction: float,
        scan_age: float,
        held: bool = False,
    ) -> tuple[float, Motion, Near | None]:
        """Return the largest admissible factor, the motion of the whole command, and what decides if it is less than 1.

        Args:
            speeds: Forward speed [m/s] and turn rate [rad/s] now.
            command: What is asked for.
            points: What is known around the robot.
            reaction: Time for which a command is followed before it can be taken back [s].
            scan_age: Age of what is known of moving things [s].
            held: Whether an obstacle stops the robot already.
        """
        asked = np.array([command])
        motion, gaps = self._along(speeds, asked, reaction, points)
        short = (gaps < self._needed(gaps, asked, motion, points, scan_age, held))[0]
        if not short.any():
            return 1.0, motion, None
        first = int(np.argmax(short.any(axis=1)))
        which = np.flatnonzero(short[first])
        decides = int(which[np.argmin(gaps[0, first, which])])
        kept = points.of((gaps[0].min(axis=0) < _SLACK) | points.moving)
        tried = _SHARES[:, None] * asked
        slower, distances = self._along(speeds, tried, reaction, kept)
        needed = self._needed(distances, tried, slower, kept, scan_age, held)
        good = (distances >= needed).all(axis=(1, 2))
        share = float(_SHARES[np.argmax(good)]) if good.any() else 0.0
        near = self._near(points, decides, float(gaps[0, 0, decides]), motion.poses[0, : first + 1])
        return share, motion, near

    def admits(self, command: tuple[float, float], points: Points, *, held: bool) -> bool:
        """Return whether a robot at rest may do this for a moment."""
        asked = np.array([command])
        motion, gaps = self._along((0.0, 0.0), asked, self.config.lag, points)
        return bool((gaps >= self._needed(gaps, asked, motion, points, 0.0, held)).all())

    def room(self, command: tuple[float, float], length: float, points: Points) -> Room:
        """Return how far the robot could go along an arc before it had to stop.

        Args:
            command: Forward speed [m/s] and turn rate [rad/s], whose arc it is; not both 0.
            length: How far to look [m]; in place the angle [rad].
            points: What is known around the robot.
        """
        forward, turn = command
        stride = _STRIDE if forward else _STRIDE / self.outline.radius
        along = np.linspace(0.0, length, max(2, math.ceil(length / stride) + 1))
        yaw = along * (turn / abs(forward) if forward else math.copysign(1.0, turn))
        x = np.copysign(along, forward) * bool(forward)
        poses = along_arc(x, yaw)
        # What no fifth pose comes near, none of the others meets: of hundreds of points a few are left.
        apart = _FIFTH * stride * (1.0 + self.outline.radius * abs(turn / (forward or turn)))
        coarse = self.outline.gaps(poses[::_FIFTH], points.xy).min(axis=0, initial=math.inf)
        points = points.of(coarse < self.config.margin + apart)
        gaps = self.outline.gaps(poses, points.xy)
        short = gaps < np.minimum(self.config.margin, gaps[0] - 1e-6)
        if not short.any():
            return Room(length, None)
        first = int(np.argmax(short.any(axis=1)))
        which = np.flatnonzero(short[first])
        decides = int(which[np.argmin(gaps[first, which])])
        free = float(along[max(first - 1, 0)])
        near = self._near(points, decides, float(gaps[0, decides]), poses[: first + 1])
        return Room(free, near)

    def _along(
        self, speeds: tuple[float, float], commands: FloatArray, reaction: float, points: Points
    ) -> tuple[Motion, FloatArray]:
        """Return the motions of commands (K, 2), and the distances (K, S, N) of points along them.

        A skid-steer that creeps may not turn at all before its wheels' friction gives way: in that case the robot goes
        straight on, so that neither way may come too near.
        """
        motion = self.braking(speeds, commands, reaction)
        gaps = self.outline.gaps(motion.poses, points.xy)
        sticks = (self._rim(commands) <= CREEP) & commands.all(axis=1)
        if sticks.any():
            unturned = commands[sticks] * (1.0, 0.0)
            straight = to_standstill(speeds, unturned, self.ramps, reaction, len(motion.times[0]))
            gaps[sticks] = np.minimum(gaps[sticks], self.outline.gaps(straight.poses, points.xy))
        return motion, gaps

    def _rim(self, commands: FloatArray) -> FloatArray:
        """Return the speeds (K,) of the robot's fastest point [m/s]."""
        rim: FloatArray = np.abs(commands[:, 0]) + self.outline.radius * np.abs(commands[:, 1])
        return rim

    def _near(self, points: Points, i: int, gap: float, way: FloatArray) -> Near:
        """Return the obstacle of a point, which the robot meets at the end of a way (S, 3)."""
        length = float(np.hypot(*np.diff(way[:, :2], axis=0).T).sum())
        x, y = points.xy[i].tolist()
        source = SOURCES[int(points.sources[i])]
        return Near(x, y, source, gap, length if length > 0.01 else abs(float(way[-1, 2])))

    def _needed(
        self,
        gaps: FloatArray,
        commands: FloatArray,
        motion: Motion,
        points: Points,
        scan_age: float,
        held: bool,
    ) -> FloatArray:
        """Return the distance (K, S, N) to be kept from each point along each motion.

        From what stands never more than there is now: what is too near already may not come nearer, and anything else may.
        Who comes on meets a robot at rest, wherever it would have gone.
        """
        now = gaps[:, 0, :]
        rim = self._rim(commands)
        rest = self.config.margin + _RELEASE * held
        squeezed = np.clip(now.min(axis=1, initial=rest), _SQUEEZE, rest)
        margin = (rest + self.config.skew * rim)[:, None]
        creeps = (rim <= CREEP)[:, None] & (points.sources != UNSEEN)
        margin = np.where(creeps, squeezed[:, None], margin)
        margin = margin + points.loose
        if points.most is not None:
            margin = np.minimum(margin, points.most)
        if not points.moving.any():
            return np.minimum(margin, now - 1e-6)[:, None, :]
        comes = self.config.approach * (motion.times + scan_age)
        needed = margin[:, None, :] + comes[:, :, None] * points.moving
        return np.where(points.moving, needed, np.minimum(needed, now[:, None, :] - 1e-6))
