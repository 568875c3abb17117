"""Shrinks a session that breaks a rule to the smallest one that still breaks it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from teleop.scenario.files.operator_settings import Follower, Hand
from teleop.scenario.files.scenario import SCHEMA, Mission, Scenario, Start, WorldSettings

Breaks = Callable[[Scenario], float | None]
"""Returns the robot time at which a session breaks the rule [s]; None if it does not, or cannot be run."""

_AFTER = 0.1
"""Time that a shrunk session goes on after the rule is broken [s]."""


def shrink(scenario: Scenario, broken_at: float, breaks: Breaks, *, attempts: int = 60) -> Scenario:
    """Return the smallest session found that breaks the same rule.

    A session is smaller with fewer faults, without a second operator, in a simpler world, and if it is shorter. Each
    change is kept if the rule is still broken; this goes on until none helps.

    Args:
        scenario: A session that breaks the rule.
        broken_at: Robot time at which it does [s].
        breaks: Runs a session.
        attempts: Largest number of sessions that are run.
    """
    smallest = _cut(scenario, broken_at)
    tried: set[bytes] = set()
    while attempts > 0:
        for smaller in _smaller(smallest):
            text = SCHEMA.dump_json(smaller)
            if text in tried:
                continue
            tried.add(text)
            attempts -= 1
            at = breaks(smaller)
            if at is not None:
                smallest = _cut(smaller, at)
                break
            if attempts <= 0:
                break
        else:
            return smallest
    return smallest


def _cut(scenario: Scenario, broken_at: float) -> Scenario:
    """Return a session that ends soon after the rule is broken, without the faults of later times."""
    faults = tuple(fault for fault in scenario.fault if fault.at <= broken_at)
    limit = min(scenario.mission.time_limit, round(broken_at + _AFTER, 2))
    return replace(scenario, fault=faults, mission=replace(scenario.mission, time_limit=limit))


def _smaller(scenario: Scenario) -> Iterator[Scenario]:
    """Yield sessions that are a little smaller, the largest steps first."""
    faults = scenario.fault
    if len(faults) > 2:
        half = len(faults) // 2
        yield replace(scenario, fault=faults[half:])
        yield replace(scenario, fault=faults[:half])
    if scenario.second is not None:
        yield replace(scenario, second=None)
    if scenario.roles:
        yield replace(scenario, roles=())
    for number in range(len(faults)):
        yield replace(scenario, fault=faults[:number] + faults[number + 1 :])
    if scenario.operator != Follower():
        yield replace(scenario, operator=Follower())
    if isinstance(hand := scenario.operator, Hand) and len(hand.tasks) > 1:
        for number in range(len(hand.tasks)):
            tasks = hand.tasks[:number] + hand.tasks[number + 1 :]
            yield replace(scenario, operator=replace(hand, tasks=tasks))
    if scenario.second is not None and scenario.second != Follower():
        yield replace(scenario, second=Follower())
    if scenario.world != WorldSettings(scene=scenario.world.scene):
        yield replace(scenario, world=WorldSettings(scene=scenario.world.scene))
    exactly = Start(at=scenario.start.at)
    if scenario.start != exactly:
        yield replace(scenario, start=exactly)
    if scenario.seed:
        yield replace(scenario, seed=0)
    for number, fault in enumerate(faults):
        for name, value in _simpler(fault):
            changed = replace(fault, **{name: value})
            yield replace(scenario, fault=faults[:number] + (changed,) + faults[number + 1 :])
    yield from _without_goal(scenario)


def _simpler(fault: Any) -> Iterator[tuple[str, Any]]:
    """Yield fields of a fault with simpler values."""
    for name in ("jitter", "rate", "delay", "turned"):
        if getattr(fault, name, 0.0):
            yield name, 0.0
    if getattr(fault, "blackout", False):
        yield "blackout", False
    if getattr(fault, "direction", "both") != "both":
        yield "direction", "both"


def _without_goal(scenario: Scenario) -> Iterator[Scenario]:
    if scenario.mission.goals:
        yield replace(scenario, mission=Mission(time_limit=scenario.mission.time_limit))
