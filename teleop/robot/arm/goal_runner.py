"""What a goal does to the arm, tick by tick: it waits for standstill, finds a way, shows it, and runs along it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.arm_table import MotionLimits
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_commands import TOOL_FRAME, Five, Goal, Move, Trajectory, WayOut
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.arm.courses import Course, CourseError, planned, timed
from teleop.robot.arm.goal_desk import OpenGoal
from teleop.robot.arm.goal_results import GoalOutcome, TimedPath
from teleop.robot.arm.hindrance import Finding
from teleop.robot.arm.limits import JerkLimiter, Motion
from teleop.robot.arm.planner import NoPlan, Planning
from teleop.robot.arm.run import Run
from teleop.robot.arm.tip_goals import tip_goals

_PLANNED: Final = MotionLimits(speed=0.6, acceleration=6.0, jerk=120.0)
"""Bounds of planned motions: with the arm outstretched its tip then goes at 0.25 m/s, which ISO 10218-1 calls reduced
speed for robots that people are near to; reached in 0.15 s."""
_SETTLED: Final = 0.05
"""Rate below which a joint has come to rest after a course [rad/s]."""
_SETTLING: Final = 0.5
"""Time that is waited for that, at most [s]; servos swing for less."""
_GOAL_TIME: Final = 1.0
"""Time for a client's tolerance at the end, unless it sets one [s]."""
_BLOCKED: Final = 3.0
"""Time for which something may be in the way before a goal is given up [s]: people walk on."""
_AWAY: Final = 0.015
"""Distance to which backing off leads [m]; hands are slowed down from 30 mm on, and stopped at 4."""
_STRIDE: Final = math.radians(1.0)
"""Step by which a pose farther away is looked for [rad]."""
_STRIDES: Final = 30
"""Largest number of them."""

End = tuple[GoalOutcome, str]
"""How a goal ended, and why."""


@dataclass(slots=True)
class _Active:
    """What is known of the goal under way."""

    goal: Goal
    planning: Planning | None = None
    run: Run | None = None
    before: FloatArray | None = None
    """Angles that were measured a tick ago."""
    settling: float = 0.0
    blocked: float = 0.0


class GoalRunner:
    """Owns the plan and the run of the goal under way."""

    def __init__(
        self, fit: ArmFit, clearance: Clearance, limiter: JerkLimiter, *, tick: float
    ) -> None:
        """Take the arm.

        Args:
            fit: Which arm, and where.
            clearance: What measures distances.
            limiter: What stops a motion.
            tick: Time between two ticks [s].
        """
        self._table, self._arm_base = fit.table, fit.base_from_arm_base.inverse()
        self._slow = replace(fit.table, motion=_PLANNED)
        self._clearance, self._limiter, self._tick = clearance, limiter, tick
        self._kinematics = Kinematics(fit.table)
        self._active: _Active | None = None
        self.reason = ""
        """What is done, for people."""

    def refusal(self, goal: Goal, offer: Finding) -> str:
        """Return why a goal cannot be begun whatever the arm does; empty if it can."""
        if isinstance(goal, WayOut) and not offer.way_out:
            return "there is nothing to get out of"
        if isinstance(goal, Move) and goal.angles is not None:
            return self._beyond(goal.angles)
        return ""

    def tick(
        self, opened: OpenGoal, motion: Motion, measured: FloatArray, offer: Finding, *, go: bool
    ) -> tuple[Motion, End | None]:
        """Return the next state of the arm, and how the goal has ended if it has.

        Args:
            opened: The goal; what is reported of it is written into it.
            motion: State of now, as commanded.
            measured: (5,) angles [rad].
            offer: The way out that the arm's state has offered.
            go: Whether a motion that needs to be confirmed is.
        """
        active = self._active
        if active is None or active.goal is not opened.goal:
            active = self._active = _Active(opened.goal)
        if active.run is None:
            if not motion.resting:
                opened.state, self.reason = "waiting", "stops first"
                return self._limiter.stop(motion), None
            if (end := self._prepare(active, opened, motion, offer)) is not None:
                return motion, end
            if active.run is None:
                return motion, None
        return self._follow(active, active.run, opened, measured, go=go)

    def _prepare(
        self, active: _Active, opened: OpenGoal, motion: Motion, offer: Finding
    ) -> End | None:
        """Find the course, for some ticks if it must be planned; return how the goal ended without one."""
        goal, standing = active.goal, motion.angles
        if isinstance(goal, Trajectory):
            try:
                points = np.array(goal.positions)
                course = timed(goal.times, points, standing, self._table)
            except CourseError as error:
                return GoalOutcome.REFUSED, str(error)
            active.run = Run(course, self._clearance, tick=self._tick)
            return None
        opened.state, self.reason = "planning", "looks for a way"
        if active.planning is None:
            goals = self._goals(goal, standing, offer)
            if isinstance(goals, str):
                return GoalOutcome.UNREACHABLE, goals
            active.planning = Planning(self._clearance, standing, goals)
        found = active.planning.advance()
        if isinstance(found, NoPlan):
            return (
                GoalOutcome.UNREACHABLE if found.unreachable else GoalOutcome.NO_PATH,
                found.reason,
            )
        if found is not None:
            course = planned(found.way, self._slow)
            active.run = Run(course, self._clearance, tick=self._tick)
            opened.path = _shown(active.run)
            if isinstance(goal, Move) and goal.preview:
                return GoalOutcome.PREVIEWED, ""
        return None

    def _follow(
        self,
        active: _Active,
        run: Run,
        opened: OpenGoal,
        measured: FloatArray,
        *,
        go: bool,
    ) -> tuple[Motion, End | None]:
        go = go or not (isinstance(active.goal, Move) and active.goal.hold_to_run)
        step = run.step(going=go)
        opened.state, opened.share = "moving" if go else "waiting", step.share
        self.reason = "moves along its way" if go else "waits to be confirmed on /arm/confirm"
        active.blocked = active.blocked + self._tick if step.blocked else 0.0
        if step.blocked:
            self.reason = step.blocked
        if active.blocked >= _BLOCKED:
            return step.motion, (GoalOutcome.BLOCKED, step.blocked)
        if off := self._off_path(active.goal, step.motion.angles, measured):
            return step.motion, (GoalOutcome.OFF_PATH, off)
        if not step.done:
            return step.motion, None
        return step.motion, self._arrive(active, measured, run.course)

    def _arrive(self, active: _Active, measured: FloatArray, course: Course) -> End | None:
        """Wait at the end for the joints to come to rest, within their tolerances."""
        active.settling += self._tick
        before, active.before = active.before, measured
        goal, end = active.goal, course.end
        tolerance = np.array(goal.goal_tolerance) if isinstance(goal, Trajectory) else np.zeros(5)
        off = np.where(tolerance > 0.0, np.abs(measured - end) - tolerance, -1.0)
        if off.max() > 0.0:
            patience = _GOAL_TIME
            if isinstance(goal, Trajectory) and goal.goal_time > 0.0:
                patience = goal.goal_time
            if active.settling < patience:
                return None
            k = int(off.argmax())
            return GoalOutcome.OFF_GOAL, self._words(k, measured[k] - end[k], tolerance[k])
        moved = math.inf if before is None else float(np.abs(measured - before).max())
        if active.settling < _SETTLING and moved > _SETTLED * self._tick:
            return None
        return GoalOutcome.DONE, course.note

    def _off_path(self, goal: Goal, wanted: FloatArray, measured: FloatArray) -> str:
        if not isinstance(goal, Trajectory):
            return ""
        tolerance = np.array(goal.path_tolerance)
        off = np.where(tolerance > 0.0, np.abs(measured - wanted) - tolerance, -1.0)
        k = int(off.argmax())
        return self._words(k, measured[k] - wanted[k], tolerance[k]) if off[k] > 0.0 else ""

    def _words(self, joint: int, off: float, tolerance: float) -> str:
        name = self._table.joints[joint].name
        return (
            f"{name} is {math.degrees(off):+.1f} degrees off; {math.degrees(tolerance):.1f} allowed"
        )

    def _beyond(self, angles: Five) -> str:
        for joint, angle in zip(self._table.joints, angles, strict=True):
            if not joint.lower <= angle <= joint.upper:
                low, high, got = (math.degrees(a) for a in (joint.lower, joint.upper, angle))
                return f"{joint.name} must be {low:.0f} to {high:.0f} degrees, got {got:.1f}"
        return ""

    def _goals(self, goal: Goal, standing: FloatArray, offer: Finding) -> FloatArray | str:
        """Return the angles (N, 5) of which one is to be reached; or why there are none."""
        if isinstance(goal, WayOut):
            if offer.way_out == "turn_over" and offer.turned_over is not None:
                return offer.turned_over[None, :]
            if offer.way_out == "back_off":
                return self._farther(standing)[None, :]
            return np.array([self._table.poses["stow"]])
        assert isinstance(goal, Move)
        if goal.name:
            return np.array([self._table.poses[goal.name]])
        if goal.angles is not None:
            return np.array([goal.angles])
        assert goal.pose is not None
        pose = goal.pose
        if goal.frame == "base_link":
            pose = self._arm_base @ pose
        elif goal.frame == TOOL_FRAME:
            tip = self._kinematics.tip(standing)
            pose = Pose.from_rotation(tip[:3, 3], tip[:3, :3]) @ pose
        return tip_goals(self._kinematics, pose.position, pose.rotation[:, 0], standing)

    def _farther(self, standing: FloatArray) -> FloatArray:
        """Return a pose (5,) near by that is away from what is near now."""
        angles = standing
        for _ in range(_STRIDES):
            near = self._clearance.near(angles, _AWAY)
            if not near:
                break
            # The nearer, the more it counts.
            away = sum((_AWAY - pair.distance) * pair.gradient for pair in near)
            step = _STRIDE * away / max(float(np.abs(away).max()), 1e-12)
            angles = np.clip(angles + step, self._table.lower, self._table.upper)
        return angles


def _shown(run: Run) -> TimedPath:
    """Return the corners of a course, and the times at which they are reached."""
    course = run.course
    corners = [piece.at(np.zeros(1))[0][0] for piece in course.pieces]
    angles: list[list[float]] = [corner.tolist() for corner in (*corners, course.end)]
    return TimedPath(run.schedule, tuple((a, b, c, d, e) for a, b, c, d, e in angles))
