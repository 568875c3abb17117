"""A sweep: what has to be run, what is known already, and what came of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.session.in_memory import Progress
from teleop.scenario.sweeps.cells import Cell, Run, runs_of
from teleop.scenario.sweeps.costs import Costs, costs_of
from teleop.scenario.sweeps.running import RunResult
from teleop.scenario.sweeps.sweep_folder import SweepFolder
from teleop.scenario.sweeps.sweep_statistics import Rows

Compute = Callable[[Sequence[Run]], Iterator[tuple[Run, RunResult]]]
"""Runs what it is given, and yields each result as it is known, in any order."""


@dataclass(frozen=True, slots=True, eq=False)
class Swept:
    """What a sweep has shown so far."""

    rows: Rows
    """The runs that are known."""
    total: int
    """Number of runs of the whole sweep."""
    earlier: int
    """Number of runs that were known before."""
    costs: Costs
    """Costs of those that were run now."""
    is_interrupted: bool
    """Whether somebody ended it before it was complete."""

    @property
    def unrunnable(self) -> list[tuple[Run, RunResult]]:
        """The runs that could not begin."""
        return [row for row in self.rows if row[1].verdict == "bad input"]


def sweep(
    cells: Sequence[Cell],
    seeds: int,
    folder: SweepFolder,
    compute: Compute,
    progress: Progress = lambda share, text: None,
) -> Swept:
    """Run what a folder does not know yet, keep each result at once, and write the table, also if interrupted.

    Args:
        cells: The cells.
        seeds: Number of runs of each.
        folder: Folder of the sweep.
        compute: Runs what it is given.
        progress: Called for each run that has ended.

    Raises:
        SettingError: If a run cannot be computed; what was is kept.
    """
    runs = runs_of(cells, seeds)
    keys = [run.key for run in runs]
    missing = [run for run, key in zip(runs, keys, strict=True) if key not in folder.results]
    fresh: list[RunResult] = []
    is_interrupted = False
    progress(1.0 - len(missing) / len(runs), f"{len(runs)} runs, {len(missing)} to do")
    try:
        for run, result in compute(missing) if missing else ():
            folder.keep(run, result)
            fresh.append(result)
            done = len(runs) - len(missing) + len(fresh)
            progress(done / len(runs), f"run {done} of {len(runs)}: {result.verdict}")
    except KeyboardInterrupt:
        is_interrupted = True
    finally:
        known = folder.results
        rows = [(run, known[key]) for run, key in zip(runs, keys, strict=True) if key in known]
        folder.write_table(rows)
    earlier = len(runs) - len(missing)
    return Swept(rows, len(runs), earlier, costs_of(fresh), is_interrupted)


def default_folder(scenario: Scenario, fields: Sequence[str]) -> Path:
    """Return the folder that a sweep of the same scenario over the same fields finds again."""
    words = SCHEMA.dump_json(scenario) + json.dumps(sorted(fields)).encode()
    return Path("runs") / f"sweep-{scenario.name}-{hashlib.sha256(words).hexdigest()[:8]}"
