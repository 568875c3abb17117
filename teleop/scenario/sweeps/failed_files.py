"""Scenario files of the runs of a sweep that did not pass, so that each can be run alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from teleop.scenario.files.operator_settings import Replay
from teleop.scenario.files.writing import scenario_text
from teleop.scenario.sweeps.sweep_statistics import Rows

FOLDER: Final = "failed"
_LARGEST: Final = 50
"""Number of files at most."""


def write_failed(rows: Rows, folder: Path) -> int:
    """Write a scenario file of the first run of each cell that did not pass; return how many.

    A scenario with files of its own beside it is not written, for it would not find them there.
    """
    failed = folder / FOLDER
    # Of an earlier call, and nothing else that lies there.
    for file in failed.glob("*-cell-*.toml"):
        file.unlink()
    first: dict[int, tuple[str, str]] = {}
    for run, result in sorted(rows, key=lambda row: (row[0].cell.number, row[0].number)):
        number = run.cell.number
        if result.verdict == "passed" or number in first or len(first) == _LARGEST:
            continue
        scenario = run.scenario
        if Path(scenario.world.scene).is_absolute() or isinstance(scenario.operator, Replay):
            return 0
        values = ", ".join(f"{name} = {value}" for name, value in run.cell.values)
        why = result.missed.replace(",", ", ") or result.ending
        name = f"{scenario.name[:60]}-cell-{number}"
        text = f"{scenario.description} With {values}: {why}.".strip()[:2000]
        first[number] = name, scenario_text(replace(scenario, name=name, description=text))
    if first:
        failed.mkdir(exist_ok=True)
    for name, text in first.values():
        (failed / f"{name}.toml").write_text(text, encoding="utf-8")
    return len(first)
