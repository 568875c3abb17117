"""A scenario, runs, and results that no robot has driven."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from teleop.scenario.files.reading import scenario_from
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.sweeps.axes import axis_of
from teleop.scenario.sweeps.cells import Cell, Run, cells_of
from teleop.scenario.sweeps.running import RunResult


def scenario(**fields: Any) -> Scenario:
    """Return a scenario of 1 s in the corridor, with other fields."""
    short = {"world": {"scene": "corridor"}, "mission": {"time_limit": 1.0}}
    return scenario_from({"format": 1, "name": "short", **short, **fields})


def cells(*over: str, **fields: Any) -> tuple[Cell, ...]:
    """Return the cells of a sweep of this scenario."""
    return cells_of(scenario(**fields), [axis_of(text) for text in over])


def result(run: Run, **fields: Any) -> RunResult:
    """Return a result that depends on the run alone."""
    seed = run.scenario.seed
    figures = {
        "position_max": seed % 1000 / 1e4,
        "runaway": seed % 7 / 10,
        "goal_time": float("inf"),
    }
    times = {"robot": 1.0, "processor": 0.2, "simulation": 0.05, "localiser": 0.15}
    made = RunResult("passed", "time is up", "", figures, f"{seed:064x}", times)
    return replace(made, **fields)


class Worker:
    """Answers at once, last things first, and keeps what it was asked for."""

    def __init__(self, stop_after: int | None = None) -> None:
        self.asked: list[str] = []
        self._stop_after = stop_after

    def __call__(self, runs: Sequence[Run]) -> Iterator[tuple[Run, RunResult]]:
        """Yield the results; after ``stop_after`` of them somebody presses Ctrl-C."""
        for number, run in enumerate(reversed(runs)):
            if number == self._stop_after:
                raise KeyboardInterrupt
            self.asked.append(run.key)
            yield run, result(run)
