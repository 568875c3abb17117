"""What the guard costs: of a tick, in drives of the campaign, and of a whole loop with localiser and gateway."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any, ClassVar, Final

import numpy as np

from benchmarks.common.figures import Figure
from benchmarks.guard import physics
from benchmarks.guard.judge import Plan
from teleop.robot.guard.guard import Guard
from teleop.robot.guard.verdict import GuardVerdict
from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.shipped import shipped_files
from teleop.scenario.session.run import run_scenario

_SCENES: Final = ("office", "corridor", "glasshouse", "warehouse")
_DRIVERS: Final = ("random", "at the wall")
_SECONDS: Final = 40.0
_PAIRS: Final = 5
"""Whole loops with the guard, each beside one without it."""


class Timed(Guard):
    """A guard that notes the processor time of each of its ticks [ms]."""

    ticks: ClassVar[list[float]] = []
    """Of all such guards."""

    def take(self, *given: Any, **named: Any) -> None:
        """As a guard does, which judges before it."""
        begun = time.thread_time_ns()
        super().take(*given, **named)
        self.ticks[-1] += (time.thread_time_ns() - begun) * 1e-6

    def judge(self, *given: Any, **named: Any) -> GuardVerdict:
        """As a guard does."""
        begun = time.thread_time_ns()
        verdict = super().judge(*given, **named)
        self.ticks.append((time.thread_time_ns() - begun) * 1e-6)
        return verdict


def figures() -> Iterator[Figure]:
    """Drive, and yield the figures; wants a machine that does nothing else."""
    for number, (scene, driver) in enumerate(product(_SCENES, _DRIVERS)):
        physics.drive(Plan(scene, False, driver, number, True), _SECONDS, Timed)
    ticks, n = np.array(Timed.ticks), len(Timed.ticks)
    case, method = "cost", "with guard"
    yield Figure(case, method, "of a tick, mean", float(ticks.mean()), "ms", n)
    yield Figure(case, method, "of a tick, p99", float(np.percentile(ticks, 99)), "ms", n, most=0.5)
    scenario = read_scenario(shipped_files()["office-visit"])
    loops: dict[bool, list[float]] = {True: [], False: []}
    for _, guarded in product(range(_PAIRS), loops):
        driven = replace(scenario, world=replace(scenario.world, guard=guarded))
        begun = time.process_time()
        run_scenario(driven)
        loops[guarded].append(time.process_time() - begun)
    ratios = np.array(loops[True]) / loops[False]
    yield Figure(case, method, "office-visit", float(np.median(loops[True])), "s", _PAIRS)
    yield Figure(case, "without guard", "office-visit", float(np.median(loops[False])), "s", _PAIRS)
    more = 100.0 * (float(np.median(ratios)) - 1.0)
    yield Figure(case, method, "more than without", more, "%", _PAIRS, most=7.0)
