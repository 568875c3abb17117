"""What the referee sees of an arm: what it picks up, places, loses and touches, and what its servos bear."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND, Pose
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.arm.goal_results import GoalOutcome
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.scenario import Mission

_LIFTED: Final = 0.02
"""Height above where it lay from which on a parcel counts as picked up [m]."""
_OPENED: Final = 0.02
"""Change of the wanted opening, over the widest, by which a gripper is opened on purpose."""
_LOST: Final = SECOND // 5
"""Time for which nothing is held after which it is lost [ns]: a jolt lifts a pad off for a moment."""
_SETTLED: Final = SECOND // 2
"""Time after which a parcel has come to rest between the jaws [ns]."""
_CLEAR: Final = SECOND
"""Time without contact after which something is touched anew [ns]."""
_WINDOW: Final = 50
"""Ticks of a second."""


class ArmLog:
    """Owns what was seen of the arm so far."""

    def __init__(self, fit: ArmFit, mission: Mission, note: Callable[[str], None]) -> None:
        """Watch an arm.

        Args:
            fit: Which one, and where.
            mission: What is to be placed, and where the tip is to be.
            note: Called with what happens, for people.
        """
        self._kinematics, self._mount = Kinematics(fit.table), fit.base_from_arm_base
        self._mission, self._note = mission, note
        self._picked: set[str] = set()
        self._parcels: dict[str, FloatArray] = {}
        self._dropped = self._contacts = 0
        self._refused: set[int] = set()
        self._touched: dict[str, int] = {}
        self._held, self._since, self._seen, self._lay = "", 0, 0, 0.0
        self._share, self._in_hand = 0.0, np.zeros(0)
        self._slip = self._moved = self._off = self._longest_off = 0.0
        self._begin: FloatArray | None = None
        self._tip: Pose | None = None
        self._loads: deque[tuple[float, ...]] = deque(maxlen=_WINDOW)
        self._load = self._load_max = 0.0

    def take(self, tick: TickRecord) -> None:
        """Take one tick."""
        arm, truth = tick.drive.arm, tick.truth
        assert arm is not None
        assert truth.arm is not None
        self._parcels = {name: pose.position for name, pose in truth.parcels}
        self._begin = arm.tip.position if self._begin is None else self._begin
        self._tip = arm.tip
        self._moved = max(self._moved, float(np.linalg.norm(arm.tip.position - self._begin)))
        self._follow_loads(arm.load)
        self._follow_contacts(tick.stamp, truth.arm.touching, hit=truth.arm.hit)
        self._follow_held(tick, arm)
        up = sum(not down for down in tick.condition.wheels_down) >= 2
        self._off = self._off + 0.02 if up else 0.0
        self._longest_off = max(self._longest_off, self._off)
        refused = {r.number for r in arm.goals.unanswered if r.outcome is GoalOutcome.REFUSED}
        self._refused |= refused

    def figures(self) -> dict[str, float]:
        """Return all figures of the arm so far; SI units."""
        placed = [
            d.parcel != self._held
            and d.parcel in self._parcels
            and float(np.linalg.norm(self._parcels[d.parcel] - d.to)) <= d.within
            for d in self._mission.deliver
        ]
        tip_off, pointing_off = self._off_goal()
        return {
            "tip_off": tip_off,
            "pointing_off": pointing_off,
            "picked": float(len(self._picked)),
            "placed": float(sum(placed)),
            "dropped": float(self._dropped),
            "arm_contacts": float(self._contacts),
            "load": self._load,
            "load_max": self._load_max,
            "slip": self._slip,
            "tip_moved": self._moved,
            "wheels_off": self._longest_off,
            "arm_refused": float(len(self._refused)),
        }

    def _off_goal(self) -> tuple[float, float]:
        """Return how far the tip is from where it is to be [m], and its pointing [rad]; NaN without a goal."""
        goal, tip = self._mission.tip, self._tip
        if goal is None or tip is None:
            return math.nan, math.nan
        away = math.atan2(goal.at[1], goal.at[0]) + math.radians(goal.aside)
        wanted = Pose.from_euler(goal.at, pitch=math.radians(goal.down), yaw=away)
        cosine = float(tip.rotation[:, 0] @ wanted.rotation[:, 0])
        return math.dist(tip.position, wanted.position), math.acos(max(-1.0, min(1.0, cosine)))

    def _follow_loads(self, loads: tuple[float, ...]) -> None:
        self._loads.append(loads)
        self._load_max = max(self._load_max, *loads)
        if len(self._loads) == _WINDOW:
            self._load = max(self._load, float(np.array(self._loads).min(axis=0).max()))

    def _follow_contacts(self, stamp: int, touching: Sequence[str], *, hit: bool) -> None:
        for name in touching:
            if name in self._parcels and not hit:
                continue
            if stamp - self._touched.get(name, -_CLEAR) >= _CLEAR:
                self._contacts += 1
                self._note(f"the arm touched {name}")
            self._touched[name] = stamp

    def _follow_held(self, tick: TickRecord, arm: ArmState) -> None:
        if arm.held and arm.held != self._held:
            self._held, self._since, self._share = arm.held, tick.stamp, arm.wanted_share
            self._lay = float(self._parcels[arm.held][2])
            self._in_hand = np.zeros(0)
        if arm.held:
            self._seen = tick.stamp
            self._follow_slip(tick, arm)
            if arm.held not in self._picked and self._height - self._lay > _LIFTED:
                self._picked.add(arm.held)
                self._note(f"picked up {arm.held}")
        elif self._held and arm.wanted_share > self._share + _OPENED:
            self._note(f"let go of {self._held}")
            self._held = ""
        elif self._held and tick.stamp - self._seen >= _LOST:
            self._dropped += 1
            self._note(f"lost {self._held}")
            self._held = ""

    @property
    def _height(self) -> float:
        return float(self._parcels[self._held][2])

    def _follow_slip(self, tick: TickRecord, arm: ArmState) -> None:
        if tick.stamp - self._since < _SETTLED or arm.wanted_share > self._share + _OPENED:
            return
        base = tick.truth.map_from_base @ self._mount
        tip = self._kinematics.tip(arm.angles)
        in_arm = base.rotation.T @ (self._parcels[arm.held] - base.position)
        in_hand = tip[:3, :3].T @ (in_arm - tip[:3, 3])
        if not len(self._in_hand):
            self._in_hand = in_hand
        self._slip = max(self._slip, float(np.linalg.norm(in_hand - self._in_hand)))
