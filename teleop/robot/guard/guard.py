"""The guard: scales what is asked for to what the robot can still brake from, and says why.

The rule, as dynamic windows have it (Fox, Burgard and Thrun, "The Dynamic Window Approach to Collision Avoidance",
IEEE Robotics and Automation Magazine 4, 1997): a command is admissible if the robot, having followed it for a tick and
for the ages of scan and command, can brake to rest without coming nearer to a known point than the margin.
Speed and turn rate have one factor, so that the path stays the operator's. Braking is always admissible: the motion
that was admitted in the tick before ends in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND, Estimate, Health, Inertial, Pose, Reading, Scan, Twist
from robot_sim import Condition, DriveConfig, SkidSteer
from teleop.robot.guard.braking import Motion, Ramps, to_standstill
from teleop.robot.guard.free_time import FARTHEST, free_time
from teleop.robot.guard.limits import Senses, limits
from teleop.robot.guard.odometry import Odometry
from teleop.robot.guard.outline import Outline
from teleop.robot.guard.settings import CREEP, GuardConfig
from teleop.robot.guard.surroundings import SOURCES, Points, Surroundings
from teleop.robot.guard.verdict import STANDSTILL, GuardState, GuardVerdict, Near, Ways
from teleop.robot.guard.words import motion_words, place_words

_COARSE: Final = np.array([0.8, 0.6, 0.4, 0.2])
"""Factors that are tried if the whole command is not admissible."""
_FINE: Final = np.array([0.15, 0.1, 0.05, 0.0])
"""What is then tried on top of the largest admissible one of them: steps of 0.035 m/s at full speed."""
_SQUEEZE: Final = 0.015
"""Margin at which the robot may still creep out of where it stands too near to something [m]: a sigma of the scanners and
the drift of odometry within a scan. The nearest of the many points of a wall is two sigma nearer than the wall."""
_RELEASE: Final = 0.02
"""What the margin grows by while an obstacle stops the robot [m]: more than the nearest of many returns trembles by from
scan to scan, so that it does not twitch (navigation2 PR 2982)."""
_WAYS: Final = np.array([[CREEP, 0.0], [-CREEP, 0.0], [0.0, 0.3], [0.0, -0.3]])
"""Motions by which is said which way is free: forward, backward, left, right."""
_LOOK_AHEAD: Final = 5
"""Ticks between two looks along the arc of a command that stays: that of ``/teleop/state``."""
_OLDEST: Final = SECOND
"""Age of a command that is counted at most [ns]; older ones are refused before they come here."""


class Guard:
    """Owns what is known of the surroundings, and judges one command a tick; reads no clock."""

    def __init__(
        self,
        robot: SkidSteer,
        mounts: Mapping[str, Pose],
        drive: DriveConfig,
        config: GuardConfig | None = None,
    ) -> None:
        """Begin without having seen anything.

        Args:
            robot: Nominal parameters of the platform.
            mounts: ``base_from_scanner`` of each of its scanners.
            drive: Limits of its drive.
            config: Settings; the defaults if not given.
        """
        self.config = config or GuardConfig()
        self.outline = Outline(0.5 * robot.length, 0.5 * robot.length, robot.half_width)
        """The robot's outline."""
        self._odometry = Odometry(robot)
        top = max((float(m.position[2]) for m in mounts.values()), default=robot.height) + 0.06
        self._surroundings = Surroundings(mounts, (robot.clearance, top))
        worn = self.config.worn
        self._ramps = Ramps(
            (drive.acceleration, drive.turn_acceleration),
            (worn * drive.braking, worn * drive.turn_braking),
        )
        self._scanners = {m.rotation[2, 2] > 0.9: name for name, m in mounts.items()}
        self._override = ""
        self._health: Health | None = None
        self._ways = [True] * 4
        self._turn = 0
        self._held = False
        self._stall = (-SECOND, -SECOND)
        self._looked, self._seen_ahead = 0, (0.0, 0.0, FARTHEST)

    def take(self, readings: Iterable[Reading]) -> None:
        """Take the readings of a tick."""
        for reading in readings:
            if isinstance(reading, Scan):
                self._surroundings.add(reading, self._odometry)
            else:
                self._odometry.add(reading)

    def take_estimate(self, estimate: Estimate) -> None:
        """Take how far the pose can be trusted."""
        self._health = estimate.health

    def override(self, client: str) -> None:
        """Switch it off for as long as a client drives; an empty name switches it on."""
        self._override = client

    def judge(
        self,
        asked: Twist,
        *,
        stamp: int,
        age: int,
        driver: str,
        condition: Condition,
        attitude: Inertial | None,
    ) -> GuardVerdict:
        """Return what is driven in the coming tick.

        Args:
            asked: The command in force.
            stamp: Time of the robot [ns].
            age: Age of the command, with its way to the robot [ns].
            driver: Client that drives; empty if none does.
            condition: Bumpers and stalls after the last tick.
            attitude: Newest inertial reading, with attitude; None if there is none.
        """
        if self._override != driver:
            self._override = ""
        if self._override:
            return GuardVerdict(GuardState.FREE, asked, asked, overridden_by=self._override)
        senses = self._senses(stamp, condition, attitude)
        command = np.array([[asked.linear[0], asked.angular[2]]])
        ways = self._look_around(condition)
        if not command.any():
            self._held = False
            self._stall = (-SECOND, -SECOND)
            return GuardVerdict(GuardState.FREE, asked, asked, ways=ways)
        scan_age = 0 if senses.horizontal is None else min(max(senses.horizontal, 0), SECOND)
        reaction = self.config.lag + min(max(age, 0), _OLDEST) / SECOND
        motion = to_standstill(self._odometry.speeds, command, self._ramps, reaction)
        forward, turn = command[0].tolist()
        known = forward < 0.0 and self._odometry.follows_trail(forward, turn)
        limit = min(
            limits(forward, senses, self.config, known=known), key=lambda x: x.speed, default=None
        )
        fastest = max(abs(forward), self.outline.radius * abs(turn))
        cap = 1.0 if limit is None else min(1.0, limit.speed / fastest)
        share, near = cap, None
        points = self._points(motion, scan_age / SECOND)
        if len(points.xy) and cap > 0.0:
            share, near = self._admissible(
                command, cap, motion, points, reaction, scan_age / SECOND
            )
        self._held = share == 0.0
        stalled = self._stalled(stamp, condition)
        if share == 1.0:
            return GuardVerdict(GuardState.FREE, asked, asked, ways=ways, disarm=stalled)
        twist = STANDSTILL if share == 0.0 else Twist(share * asked.linear, share * asked.angular)
        why = place_words(near) if near is not None else "" if limit is None else limit.why
        return GuardVerdict(
            GuardState.SLOWED if share > 0.0 else GuardState.STOPPED,
            twist,
            asked,
            share,
            f"{motion_words(share * forward, share * turn)}: {why}",
            near,
            0.0 if limit is None else limit.speed,
            ways,
            self.outline.swept(motion.poses[0, ::3]),
            disarm=stalled,
        )

    def ahead(self, asked: Twist) -> float:
        """Return how long a command goes on along its arc until it is stopped [s]; ``FARTHEST`` while the guard is off.

        It is looked at again as often as it is published, and for each other command.
        """
        forward, turn = float(asked.linear[0]), float(asked.angular[2])
        self._looked += 1
        if self._override or not (forward or turn):
            self._seen_ahead = (0.0, 0.0, FARTHEST)
        elif self._seen_ahead[:2] != (forward, turn) or self._looked >= _LOOK_AHEAD:
            points = self._surroundings.within(math.inf, self._odometry)
            rim = abs(forward) + self.outline.radius * abs(turn)
            margin = self.config.margin + self.config.skew * rim
            free = free_time(self.outline, points.xy, forward, turn, margin)
            self._seen_ahead, self._looked = (forward, turn, free), 0
        return self._seen_ahead[2]

    def _senses(self, stamp: int, condition: Condition, attitude: Inertial | None) -> Senses:
        heard = self._surroundings.heard
        silence = {level: stamp - heard.get(name, 0) for level, name in self._scanners.items()}
        return Senses(
            condition,
            _tilt(attitude),
            silence.get(True),
            silence.get(False),
            self._surroundings.blinded,
            self._health,
        )

    def _points(self, motion: Motion, scan_age: float) -> Points:
        """Return what could matter for a motion."""
        far = np.hypot(motion.poses[0, :, 0], motion.poses[0, :, 1]).max()
        comes = self.config.approach * (motion.times[0, -1] + scan_age)
        radius = self.outline.radius + float(far) + 0.2
        points = self._surroundings.within(radius + float(comes), self._odometry)
        near = points.moving | (np.hypot(*points.xy.T) < radius)
        return Points(points.xy[near], points.sources[near], points.moving[near])

    def _admissible(
        self,
        command: FloatArray,
        cap: float,
        motion: Motion,
        points: Points,
        reaction: float,
        scan_age: float,
    ) -> tuple[float, Near | None]:
        """Return the largest admissible factor, and the point that decides if it is less than ``cap``."""
        if cap < 1.0:
            motion = to_standstill(self._odometry.speeds, cap * command, self._ramps, reaction)
        gaps = self.outline.gaps(motion.poses, points.xy)
        short = gaps < self._needed(gaps, cap * command, motion, points, scan_age)
        if not short.any():
            return cap, None
        first = int(np.argmax(short[0].any(axis=1)))
        which = np.flatnonzero(short[0, first])
        decides = int(which[np.argmin(gaps[0, first, which])])
        # Slower motions go where this one goes, or less far; what is clear of it by far cannot matter.
        near = (gaps[0].min(axis=0) < 0.2) | points.moving
        kept = Points(points.xy[near], points.sources[near], points.moving[near])
        share = 0.0
        for shares in (_COARSE, _FINE):
            tried = cap * (share + shares)
            slower = to_standstill(
                self._odometry.speeds, tried[:, None] * command, self._ramps, reaction
            )
            gaps_slower = self.outline.gaps(slower.poses, kept.xy)
            needed = self._needed(gaps_slower, tried[:, None] * command, slower, kept, scan_age)
            good = (gaps_slower >= needed).all(axis=(1, 2))
            share += float(shares[np.argmax(good)]) if good.any() else 0.0
        x, y = points.xy[decides].tolist()
        return cap * share, Near(
            x,
            y,
            SOURCES[int(points.sources[decides])],
            float(gaps[0, 0, decides]),
            _way(motion.poses[0, : first + 1]),
        )

    def _needed(
        self,
        gaps: FloatArray,
        commands: FloatArray,
        motion: Motion,
        points: Points,
        scan_age: float,
    ) -> FloatArray:
        """Return the distance (K, S, N) to be kept from each point along each motion.

        Never more than there is now: what is too near already may not come nearer, and anything else may.
        """
        now = gaps[:, 0, :]
        rim = np.abs(commands[:, 0]) + self.outline.radius * np.abs(commands[:, 1])
        rest = self.config.margin + (_RELEASE if self._held else 0.0)
        margin = rest + self.config.skew * rim
        squeezed = np.clip(now.min(axis=1), _SQUEEZE, rest)
        margin = np.where(rim <= CREEP, squeezed, margin)
        needed = np.broadcast_to(margin[:, None, None], gaps.shape)
        if points.moving.any():
            comes = self.config.approach * (motion.times + scan_age)
            needed = needed + comes[:, :, None] * points.moving
        return np.minimum(needed, now[:, None, :] - 1e-6)

    def _look_around(self, condition: Condition) -> Ways:
        """Return which way is free; each tick one of the four is looked at."""
        self._turn = (self._turn + 1) % 4
        command = _WAYS[self._turn : self._turn + 1]
        motion = to_standstill((0.0, 0.0), command, self._ramps, self.config.lag)
        points = self._points(motion, 0.0)
        free = True
        if len(points.xy):
            gaps = self.outline.gaps(motion.poses, points.xy)
            free = bool((gaps >= self._needed(gaps, command, motion, points, 0.0)).all())
        pressed = (condition.bumpers.front, condition.bumpers.rear, (), ())[self._turn]
        self._ways[self._turn] = free and not any(pressed)
        return Ways(*self._ways)

    def _stalled(self, stamp: int, condition: Condition) -> str:
        """Return why the driver must arm anew: the motors have pushed in vain for too long."""
        since, last = self._stall
        if not (condition.left_stalled or condition.right_stalled):
            return ""
        # A controller cuts a stalled motor's power for 0.2 s: pauses of half a second do not count.
        since = stamp if stamp - last > SECOND // 2 else since
        self._stall = (since, stamp)
        if stamp - since < self.config.stalled:
            return ""
        self._stall = (-SECOND, -SECOND)
        return f"the motors have pushed for {self.config.stalled / SECOND:g} s and nothing moves"


def _way(poses: FloatArray) -> float:
    """Return the length of a way (S, 3) [m], or the angle if it goes nowhere [rad]."""
    length = float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())
    return length if length > 0.01 else abs(float(poses[-1, 2]))


def _tilt(attitude: Inertial | None) -> float:
    """Return the angle from the vertical by an inertial unit's attitude [rad]."""
    if attitude is None or attitude.orientation is None:
        return 0.0
    _, x, y, _ = attitude.orientation.tolist()
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y))))
