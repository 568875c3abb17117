"""Cells of a sweep, and the runs of each with their seeds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

from teleop.errors import SettingError
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.sweeps.axes import LARGEST, Axis, Value
from teleop.scenario.sweeps.swept_fields import with_values


@dataclass(frozen=True, slots=True)
class Cell:
    """One combination of the swept values."""

    number: int
    """Its number, from 0, in the order of the values; the last field varies fastest."""
    values: tuple[tuple[str, Value], ...]
    """Field and value of each axis."""
    scenario: Scenario
    """The scenario with these values."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a cell."""

    cell: Cell
    """The cell."""
    number: int
    """Number of its seed, from 1."""

    @property
    def scenario(self) -> Scenario:
        """What is run."""
        return replace(self.cell.scenario, seed=seed_of(self.cell, self.number))

    @property
    def key(self) -> str:
        """Digest of everything that decides the outcome: runs of the same key have the same bits."""
        return hashlib.sha256(SCHEMA.dump_json(self.scenario)).hexdigest()[:32]


def cells_of(scenario: Scenario, axes: Sequence[Axis]) -> tuple[Cell, ...]:
    """Return all combinations of the values of the axes.

    Raises:
        SettingError: If a field or value is not in the schema, or one is swept twice.
    """
    names = [axis.name for axis in axes]
    for name in names:
        if names.count(name) > 1:
            raise SettingError(f"--over {name}: is given twice; join the values, as in {name}=1,2")
    count = 1
    for axis in axes:
        count *= len(axis.values)
    if count > LARGEST:
        raise SettingError(f"--over: {count} combinations are too many; {LARGEST} are the limit")
    cells: list[Cell] = []
    for i, values in enumerate(product(*(axis.values for axis in axes))):
        made, held = with_values(scenario, dict(zip(names, values, strict=True)))
        cells.append(Cell(i, tuple((name, held[name]) for name in names), made))
    for name, axis in zip(names, axes, strict=True):
        distinct = {json.dumps(dict(cell.values)[name]) for cell in cells}
        if len(distinct) < len(axis.values):
            raise SettingError(f"--over {name}: holds the same value twice")
    return tuple(cells)


def seed_of(cell: Cell, number: int) -> int:
    """Return the seed of a run: a hash of the scenario's own seed, the cell's values, and the run's number.

    It depends on nothing else, so that a sweep can grow by values and seeds, and what was run stays valid.
    """
    words = [cell.scenario.seed, sorted(cell.values), number]
    digest = hashlib.sha256(json.dumps(words).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1


def runs_of(cells: Sequence[Cell], seeds: int) -> list[Run]:
    """Return all runs: the first seed of each cell, then the second of each, so that an early end leaves all of them.

    Raises:
        SettingError: If there are too many.
    """
    if seeds < 1:
        raise SettingError(f"--seeds must be >= 1, got {seeds}")
    if seeds * len(cells) > LARGEST:
        raise SettingError(f"{seeds * len(cells)} runs are too many; {LARGEST} are the limit")
    return [Run(cell, number) for number in range(1, seeds + 1) for cell in cells]
