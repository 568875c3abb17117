"""One session of the fuzzer: run in lockstep, judged by the rules, and reduced to what statistics need."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from localization.types import SECOND
from teleop.clock import wall_seconds
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import Kidnap
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.operators.building import operator_of
from teleop.scenario.referee.outcome import TimeLines
from teleop.scenario.referee.rules.rule import Broken
from teleop.scenario.referee.run_log import LOCALISED
from teleop.scenario.session.briefing import briefing_of
from teleop.scenario.session.in_memory import run_in_memory
from teleop.scenario.session.links import link_of
from teleop.scenario.session.scene import scene_of
from teleop.scenario.session.session import Session

NOTICED_WITHIN: Final = 2.0
"""Time within which a robot that was carried off must say so [s]."""
_SETTLED: Final = 2.0
"""Time after which the robot knows where it is, if it is shown its place at the start [s]."""
_FEWEST_TICKS: Final = 100
"""Least number of ticks of which a mean is taken."""
_DISTURBING: Final = frozenset(
    {"kidnap", "wheel_slip", "scanner_dead", "scanner_dirty", "wrong_hint", "door_closed"}
)
"""Faults that disturb the robot's senses."""
_FAR: Final = 1.0
"""Distance from which on being carried off counts [m]."""


@dataclass(frozen=True, slots=True)
class JudgedSession:
    """What is left of a session."""

    broken: tuple[Broken, ...]
    """Rules that were broken, the first one first."""
    seconds: float
    """Robot time that it took [s]."""
    wall: float
    """Real time that it took [s]."""
    sha256: str
    """Digest of its trajectory."""
    said_after: tuple[float, ...]
    """Each time that the robot was carried off by a metre or more while it was localised: the time after which
    it said so [s]; infinite if not within ``NOTICED_WITHIN``."""
    nees: float
    """Median normalised estimation error squared of the pose in quiet times; NaN without any."""
    tracking: float
    """Share of quiet times in which it says ``tracking``; NaN without any."""


def judge_session(scenario: Scenario) -> JudgedSession:
    """Run a session until the first rule is broken, and judge it.

    Args:
        scenario: The session; its ``limits.rules`` must be on.

    Raises:
        SimulationError: If it cannot be run, since a goal cannot be reached, for instance.
    """
    begun = wall_seconds()
    scene = scene_of(scenario)
    session = Session(scenario, scene, link=link_of(scenario))
    book = session.rules
    assert book is not None

    def stop(tick: TickRecord) -> None:
        if book.broken:
            session.end(f"rule {book.broken[0].rule} was broken")

    session.stepped.observers = (*session.stepped.observers, stop)
    chosen = [scenario.operator, *([] if scenario.second is None else [scenario.second])]
    operators = [operator_of(each, beside=None) for each in chosen]
    run_in_memory(session, operators, briefing_of(scenario, scene.world))
    lines = session.referee.log.lines()
    nees, tracking = _in_quiet(scenario, lines)
    return JudgedSession(
        tuple(book.broken),
        session.stamp / SECOND,
        wall_seconds() - begun,
        session.referee.log.sha256,
        tuple(_said_after(scenario, lines)),
        nees,
        tracking,
    )


def _said_after(scenario: Scenario, lines: TimeLines) -> Iterator[float]:
    """Yield each time that the robot was carried off, the time after which it said so [s]; infinite if too late."""
    names = {health.value for health in LOCALISED}
    localised = np.array([health in names for health in lines.health])
    times = lines.stamps * 1e-9
    for fault in scenario.fault:
        if not isinstance(fault, Kidnap) or fault.at + NOTICED_WITHIN > times[-1]:
            continue
        first = int(np.searchsorted(times, fault.at + 1e-6))
        if first < 1 or not localised[first - 1]:
            continue
        moved = lines.true[first, :2] - lines.true[first - 1, :2]
        if math.hypot(*moved) < _FAR:
            continue
        said = np.flatnonzero(~localised[first : first + round(NOTICED_WITHIN / 0.02)])
        yield float(times[first + said[0]] - fault.at) if len(said) else math.inf


def _in_quiet(scenario: Scenario, lines: TimeLines) -> tuple[float, float]:
    """Return the median NEES while tracking, and the share of tracking, while nothing disturbs the robot's senses."""
    times = lines.stamps * 1e-9
    quiet = times > _SETTLED
    for fault in scenario.fault:
        if fault.kind in _DISTURBING:
            quiet &= times < fault.at
    # Errors of the beams that the filter does not know make it surer than it is: such worlds have no reference.
    world = scenario.world
    unknown = world.effects or world.arm is not None or scenario.start.known == "nothing"
    if unknown or scenario.world.alive or quiet.sum() < _FEWEST_TICKS:
        return math.nan, math.nan
    tracking = np.array([health == "tracking" for health in lines.health])
    values = lines.nees[quiet & tracking & np.isfinite(lines.nees)]
    middle = float(np.median(values)) if len(values) >= _FEWEST_TICKS else math.nan
    return middle, float(tracking[quiet].mean())
