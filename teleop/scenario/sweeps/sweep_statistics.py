"""Shares with their intervals, and quantiles, of the runs of a sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.stats import binomtest

from localization.geometry import FloatArray
from teleop.scenario.sweeps.axes import Value
from teleop.scenario.sweeps.cells import Run
from teleop.scenario.sweeps.running import RunResult

Rows = Sequence[tuple[Run, RunResult]]
"""Runs with what they have shown."""

QUANTILES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True, slots=True)
class Share:
    """A share of runs."""

    passed: int
    """Number of runs that passed."""
    count: int
    """Number of runs."""

    @property
    def value(self) -> float:
        """The share; NaN of no runs."""
        return self.passed / self.count if self.count else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of Wilson (1927), which is right also for few runs and for shares of 0 and 1."""
        if not self.count:
            return 0.0, 1.0
        found = binomtest(self.passed, self.count).proportion_ci(0.95, method="wilson")
        # Rounding must not leave the share outside of its own interval.
        return min(float(found.low), self.value), max(float(found.high), self.value)


def share_passed(rows: Rows) -> Share:
    """Return the share of the runs that passed; runs that could not begin count as not passed."""
    return Share(sum(result.verdict == "passed" for _, result in rows), len(rows))


def by_value(rows: Rows, name: str) -> list[tuple[Value, Rows]]:
    """Return the runs of each value of a field, in the order of the values."""
    groups: dict[str, tuple[Value, list[tuple[Run, RunResult]]]] = {}
    for run, result in sorted(rows, key=lambda row: (row[0].cell.number, row[0].number)):
        value = dict(run.cell.values)[name]
        groups.setdefault(str(value), (value, []))[1].append((run, result))
    return list(groups.values())


def quantiles(rows: Rows, figure: str) -> FloatArray:
    """Return the quantiles of a figure (5,); NaN where no run has measured it."""
    every = np.array([result.figures.get(figure, math.nan) for _, result in rows], dtype=float)
    known = every[np.isfinite(every)]
    if not known.size:
        return np.full(len(QUANTILES), math.nan)
    return np.asarray(np.quantile(known, QUANTILES))
