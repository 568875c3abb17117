"""The guard: scales what is asked for to what the robot can still brake from, and says why.

The rule, as dynamic windows have it (Fox, Burgard and Thrun, "The Dynamic Window Approach to Collision Avoidance",
IEEE Robotics and Automation Magazine 4, 1997): a command is admissible if the robot, having followed it for a tick and
for the ages of scan and command, can brake to rest without coming nearer to a known point than the margin.
Speed and turn rate have one factor, so that the path stays the operator's. Braking is always admissible: the motion
that was admitted in the tick before ends in it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from localization.types import SECOND, Estimate, Health, Inertial, Pose, Reading, Scan, Twist
from robot_sim import Condition, DriveConfig, SkidSteer
from teleop.robot.guard.braking import Ramps
from teleop.robot.guard.limits import Senses, limits
from teleop.robot.guard.odometry import Odometry
from teleop.robot.guard.outline import Box, Outline
from teleop.robot.guard.points import MEMORY, Points
from teleop.robot.guard.rule import Room, Rule
from teleop.robot.guard.settings import CREEP, GuardConfig
from teleop.robot.guard.surroundings import DRIFT, REACH, Surroundings
from teleop.robot.guard.verdict import (
    STANDSTILL,
    GuardState,
    GuardVerdict,
    Ways,
    motion_words,
    place_words,
)

_WAYS: Final = ((CREEP, 0.0), (-CREEP, 0.0), (0.0, 0.3), (0.0, -0.3))
"""Motions by which is said which way is free: forward, backward, left, right."""
_CREEPING: Final = (CREEP, 0.3)
"""Of these the largest forward speed and turn rate."""
_OLDEST: Final = SECOND
"""Age of a command that is counted at most [ns]; older ones are refused before they come here."""


_LITTLE: Final = 0.1
"""Turn rate up to which a motion counts as straight on [rad/s]: sticks tremble by so much."""
_APART: Final = 0.02
"""How much nearer than on its way there the robot may come on its way back to what it does not see [m]: chosen:
who goes back by hand strays by so much."""

_LEVEL: Final = math.radians(3.0)
"""Tilt from which on a robot leans [rad]: its foot is then 2 cm nearer to what stands upright than where it is scanned; chosen."""


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
        self._odometry = Odometry(robot, self.outline)
        top = max((float(m.position[2]) for m in mounts.values()), default=robot.height) + 0.06
        self._surroundings = Surroundings(mounts, (robot.clearance, top), self.outline)
        self._scanned = max((float(m.position[2]) for m in mounts.values()), default=0.0)
        self._lean = 0.0
        worn = self.config.worn
        ramps = Ramps(
            (drive.acceleration, drive.turn_acceleration),
            (worn * drive.braking, worn * drive.turn_braking),
        )
        self.rule = Rule(self.outline, ramps, self.config)
        """What is admissible."""
        self._scanners = {m.is_level: name for name, m in mounts.items()}
        self._override = ""
        self._health: Health | None = None
        self._ways = [True] * 4
        self._turn = 0
        self._held: tuple[int, int] | None = None
        self._stall = (-SECOND, -SECOND)
        self._scans: deque[Scan] = deque()
        self.comes_to_arm = ""
        """Who comes near the arm, in words; empty if nobody does."""
        self._clearance, self._clear_at = (0.0, 0.0), self._odometry.pose

    def forget(self) -> None:
        """Forget what was seen: the robot has been set down elsewhere."""
        self._surroundings.forget()
        self._odometry.forget_trail()
        self._scans.clear()
        self._clearance = (0.0, 0.0)

    def take(self, readings: Iterable[Reading], arm: Box | None = None) -> None:
        """Take the readings of a tick; of scans that end together, one a tick.

        Args:
            readings: What was measured.
            arm: A box around the arm, if there is one.
        """
        if arm != self.outline.arm:
            self.outline = replace(self.outline, arm=arm)
            self.rule = replace(self.rule, outline=self.outline)
            self._clearance = (0.0, 0.0)
        for reading in readings:
            if isinstance(reading, Scan):
                self._scans.append(reading)
            else:
                self._odometry.add(reading)
        if not self._scans:
            self._look_around()
            return
        self._surroundings.add(self._scans.popleft(), self._odometry)
        while len(self._scans) >= len(self._scanners):
            self._surroundings.add(self._scans.popleft(), self._odometry)
        self._measure_clearance()

    def room(self, command: tuple[float, float], length: float) -> Room:
        """Return how far an arc is free from where the robot is; see ``Rule.room``."""
        return self.rule.room(command, length, self._points(length, 0.0))

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
        self._surroundings.take_bumpers(condition.bumpers, self._odometry, stamp)
        if self._override != driver:
            self._override = ""
        if self._override:
            return GuardVerdict(GuardState.FREE, asked, asked, overridden_by=self._override)
        tilt = _tilt(attitude)
        self._lean = self._scanned * math.sin(tilt) if tilt > _LEVEL else 0.0
        senses = self._senses(stamp, condition, tilt)
        forward, turn = float(asked.linear[0]), float(asked.angular[2])
        ways = self._free_ways(condition)
        if forward == turn == 0.0:
            self._held = None
            self._stall = (-SECOND, -SECOND)
            return GuardVerdict(GuardState.FREE, asked, asked, ways=ways)
        heard = 0 if senses.horizontal is None else min(max(senses.horizontal, 0), SECOND)
        scan_age = heard / SECOND
        reaction = self.config.lag + min(max(age, 0), _OLDEST) / SECOND
        known = forward < 0.0 and self._odometry.follows_trail(forward, turn)
        limit = min(
            limits(forward, senses, self.config, known=known), key=lambda x: x.speed, default=None
        )
        fastest = max(abs(forward), self.outline.radius * abs(turn))
        cap = 1.0 if limit is None else min(1.0, limit.speed / fastest)
        command = (cap * forward, cap * turn)
        share, motion, near = cap, None, None
        speeds, held = self._odometry.speeds, self._held == _direction(command)
        if cap > 0.0 and not self._far_from(command, speeds, reaction, scan_age, held=held):
            reach, lasts = self.rule.bound(speeds, command, reaction)
            points = self._points(reach, lasts + scan_age)
            if known:
                points = self._as_it_came(points)
            admitted, motion, near = self.rule.share(
                speeds,
                command,
                points,
                reaction=reaction,
                scan_age=scan_age,
                held=held,
            )
            share *= admitted
        self._held = _direction(command) if share == 0.0 else None
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
            None if motion is None else self.outline.swept(motion.poses[0, ::3]),
            disarm=stalled,
        )

    def _senses(self, stamp: int, condition: Condition, tilt: float) -> Senses:
        heard = self._surroundings.heard
        silence = {level: stamp - heard.get(name, 0) for level, name in self._scanners.items()}
        return Senses(
            condition,
            tilt,
            silence.get(True),
            silence.get(False),
            self._surroundings.blinded,
            self._health,
        )

    def _far_from(
        self,
        command: tuple[float, float],
        speeds: tuple[float, float],
        reaction: float,
        scan_age: float,
        *,
        held: bool,
    ) -> bool:
        """Return whether everything is so far away that a motion is free wherever it goes."""
        reach, lasts = self.rule.bound(speeds, command, reaction)
        standing, moving = self._clear()
        needed = reach + self._lean + self.rule.margin(command, held=held)
        return standing >= needed and moving >= needed + self.config.approach * (lasts + scan_age)

    def _points(self, reach: float, lasts: float) -> Points:
        """Return what could matter for a motion that reaches so far [m], and lasts so long [s]."""
        radius = self.outline.radius + reach + self._lean + 0.2
        points = self._surroundings.within(radius + self.config.approach * lasts, self._odometry)
        near = points.moving | (np.einsum("ij,ij->i", points.xy, points.xy) < radius * radius)
        points = points.of(near)
        return replace(points, loose=points.loose + self._lean) if self._lean else points

    def _as_it_came(self, points: Points) -> Points:
        """Return points of which those that are not seen now need no more room than the path just driven left them."""
        hidden = points.sources >= MEMORY
        most = np.full(len(points.xy), np.inf)
        most[hidden] = self._odometry.beside_way_here(points.xy[hidden]) - _APART
        return replace(points, loose=np.full(len(points.xy), self._lean), most=most)

    def _clear(self) -> tuple[float, float]:
        """Return how far anything that stands, and anything that moves, is from the robot at least [m]."""
        (x, y, yaw), then = self._odometry.pose, self._clear_at
        moved = math.hypot(x - then[0], y - then[1]) + self.outline.radius * abs(yaw - then[2])
        moved *= 1.0 + DRIFT
        return self._clearance[0] - moved, self._clearance[1] - moved

    def _measure_clearance(self) -> None:
        points = self._surroundings.within(REACH + self.outline.radius, self._odometry)
        gaps = self.outline.gaps(np.zeros(3), points.xy) - points.loose
        self._clearance = (
            float(gaps[~points.moving].min(initial=REACH)),
            float(gaps[points.moving].min(initial=math.inf)),
        )
        self._clear_at = self._odometry.pose
        self.comes_to_arm = self._nearest_to_arm(points)

    def _nearest_to_arm(self, points: Points) -> str:
        """Return that somebody comes near the arm of a robot that stands, in words; empty if nobody does."""
        if self.outline.arm is None or not self._odometry.stands:
            return ""
        comes = points.of(points.moving)
        gaps = self.outline.gaps_to_arm(comes.xy)
        if not (gaps < self.config.arm_zone).any():
            return ""
        return f"somebody comes near the arm: {max(float(gaps.min()), 0.0):.1f} m"

    def _look_around(self) -> None:
        """See which way is free; where it is narrow, one of the four in a tick."""
        if self._far_from(_CREEPING, (0.0, 0.0), self.config.lag, 0.0, held=True):
            self._ways = [True] * 4
        else:
            self._turn = (self._turn + 1) % 4
            command = _WAYS[self._turn]
            reach, _ = self.rule.bound((0.0, 0.0), command, self.config.lag)
            points = self._points(reach, 0.0)
            held = self._held == _direction(command)
            self._ways[self._turn] = self.rule.admits(command, points, held=held)

    def _free_ways(self, condition: Condition) -> Ways:
        forward, backward, left, right = self._ways
        pressed = condition.bumpers
        return Ways(
            forward and not any(pressed.front), backward and not any(pressed.rear), left, right
        )

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


def _direction(command: tuple[float, float]) -> tuple[int, int]:
    """Return which way a command goes: who is held one way may leave another way without a larger margin."""
    forward, turn = command
    return (forward > 0.0) - (forward < 0.0), (turn > _LITTLE) - (turn < -_LITTLE)


def _tilt(attitude: Inertial | None) -> float:
    """Return the angle from the vertical by an inertial unit's attitude [rad]."""
    if attitude is None or attitude.orientation is None:
        return 0.0
    _, x, y, _ = attitude.orientation.tolist()
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y))))
