"""Figures of a run, and which of its limits they keep."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from localization.geometry import FloatArray
from robot_sim.array_types import BoolArray
from teleop.scenario.files.limits import Limits
from teleop.scenario.referee.outcome import LimitCheck, TimeLines
from teleop.scenario.referee.run_log import LOCALISED, WITHOUT_PLACE

SILENT_ERROR = 0.5
"""Error of the position that a robot must not have while it claims to know where it is [m]."""
_TICK = 0.02
"""Duration of a tick [s]."""
_FASTEST = 3.0
"""Speed that no robot reaches by itself or by a push [m/s]: a larger step of its true place means that it was carried."""
_FASTEST_TURN = 2.0 * math.pi
"""The same of its turn rate [rad/s]."""


def figures_of(lines: TimeLines, grace: float = 0.0) -> dict[str, float]:
    """Return the figures that follow from the time lines; SI units and radians, NaN where there are none.

    Args:
        lines: The time lines.
        grace: As ``Limits.grace`` [s].
    """
    health = np.array(lines.health)
    claimed = np.isin(health, [h.value for h in LOCALISED])
    lost = np.isin(health, [h.value for h in WITHOUT_PLACE])
    counted = np.isfinite(lines.error) & ~_excused(lines, claimed, grace)
    known = claimed & counted
    error, doubted = lines.error[known], lines.error[counted & ~lost]
    turned = (lines.estimated - lines.true)[known][:, 2]
    heading = np.abs((turned + math.pi) % (2.0 * math.pi) - math.pi)
    values = lines.nees[known]
    silent = claimed & (lines.error > SILENT_ERROR)
    path = np.hypot(*np.diff(lines.true[:, :2], axis=0).T)
    driven = path[~_carried(lines)[1:]]
    return {
        "duration": float(lines.stamps[-1] * 1e-9) if len(lines.stamps) else 0.0,
        "distance": float(driven.sum()),
        "position_max": _or_nan(error.max, error),
        "doubted_max": _or_nan(doubted.max, doubted),
        "position_rmse": _or_nan(lambda: np.sqrt((error**2).mean()), error),
        "position_p95": _or_nan(lambda: np.percentile(error, 95), error),
        "heading_rmse": _or_nan(lambda: np.sqrt((heading**2).mean()), heading),
        "heading_max": _or_nan(heading.max, heading),
        "nees": _or_nan(values.mean, values),
        "lost": float(lost.sum()) * _TICK,
        "silent_error": float(silent.sum()) * _TICK,
        "tilt": _or_nan(lines.tilt.max, lines.tilt),
    }


def _carried(lines: TimeLines) -> BoolArray:
    """Return at which ticks (N,) the robot was set down elsewhere."""
    steps = np.diff(lines.true, axis=0, prepend=lines.true[:1])
    turns = np.abs((steps[:, 2] + math.pi) % (2.0 * math.pi) - math.pi)
    far = np.hypot(steps[:, 0], steps[:, 1]) >= _FASTEST * _TICK
    carried: BoolArray = far | (turns >= _FASTEST_TURN * _TICK)
    return carried


def _excused(lines: TimeLines, claimed: BoolArray, grace: float) -> BoolArray:
    """Return the ticks (N,) at which a robot that was carried off need not have noticed it yet."""
    excused = np.zeros(len(claimed), dtype=bool)
    for first in np.flatnonzero(_carried(lines)):
        last = first + round(grace / _TICK)
        doubts = np.flatnonzero(~claimed[first:last])
        excused[first : first + doubts[0] if len(doubts) else last] = True
    return excused


def judge(limits: Limits, figures: Mapping[str, float]) -> tuple[LimitCheck, ...]:
    """Return the limits that were given, and whether the figures keep them."""
    return tuple(_checks(limits, figures))


_SUBJECTS = {
    "contacts": ("contacts with obstacles", "", 1.0),
    "tilt": ("largest tilt", "deg", 180.0 / math.pi),
    "position_max": ("largest error of the position", "m", 1.0),
    "doubted_max": ("largest error of the position, doubted or not", "m", 1.0),
    "position_rmse": ("root mean square of the position's error", "m", 1.0),
    "heading_rmse": ("root mean square of the heading's error", "deg", 180.0 / math.pi),
    "heading_max": ("largest error of the heading", "deg", 180.0 / math.pi),
    "lost": ("time without a known place", "s", 1.0),
    "silent_error": ("time more than 0.5 m wrong though localised", "s", 1.0),
    "stops": ("stops that the robot made of itself", "", 1.0),
    "hints": ("hints given", "", 1.0),
    "stopping_time": ("time from a last command to rest", "s", 1.0),
    "runaway": ("way from a last command to rest", "m", 1.0),
    "duration": ("time to the last goal", "s", 1.0),
    "dropped": ("parcels that the gripper lost", "", 1.0),
    "arm_contacts": ("contacts of the arm", "", 1.0),
    "load": ("share of its stall torque that a servo bore for a second", "", 1.0),
    "load_max": ("largest share of its stall torque that a servo bore", "", 1.0),
    "slip": ("largest slip of a parcel in the gripper", "m", 1.0),
    "tip_moved": ("largest distance of the tip from where it began", "m", 1.0),
    "tip_off": ("distance of the tip from where it is to be at the end", "m", 1.0),
    "pointing_off": (
        "angle of the gripper from where it is to point at the end",
        "deg",
        180.0 / math.pi,
    ),
    "mirror_error": ("largest error of the second arm at rest", "deg", 180.0 / math.pi),
    "wheels_off": ("longest time with two wheels off the ground", "s", 1.0),
    "violations": ("things tried that the client may not do", "", 1.0),
}
"""Text, unit in files, and factor to that unit of each largest value."""


_LEAST = {
    "distance": ("distance driven", "m"),
    "picked": ("parcels picked up", ""),
    "placed": ("parcels placed", ""),
}
"""Text and unit of each least value."""


def _checks(limits: Limits, figures: Mapping[str, float]) -> Iterator[LimitCheck]:
    if limits.goals and figures["goals"] > 0:
        reached, goals = figures["goals_reached"], figures["goals"]
        met = reached == goals
        yield LimitCheck("goals", "goals reached", reached, f"= {goals:.0f}", "", met)
    for name, (text, unit, factor) in _SUBJECTS.items():
        limit = getattr(limits, name)
        if limit is None:
            continue
        value = figures["goal_time" if name == "duration" else name] * factor
        # A figure that could not be measured is NaN, which keeps no limit.
        yield LimitCheck(name, text, value, f"<= {limit:g}", unit, value <= limit)
    if limits.rules:
        broken = figures["rules"]
        text = "rules of every run that were broken"
        yield LimitCheck("rules", text, broken, "= 0", "", broken == 0)
    if limits.nees is not None:
        low, high = limits.nees
        value = figures["nees"]
        met = low <= value <= high
        yield LimitCheck("nees", "mean NEES of the pose", value, f"{low:g} to {high:g}", "", met)
    for name, (text, unit) in _LEAST.items():
        limit = getattr(limits, name)
        if limit is not None:
            value = figures[name]
            yield LimitCheck(name, text, value, f">= {limit:g}", unit, value >= limit)


def _or_nan(compute: Callable[[], float], values: FloatArray) -> float:
    return float(compute()) if values.size else math.nan
