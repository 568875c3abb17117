from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from teleop.errors import SettingError
from teleop.scenario.sweeps.cells import Cell, Run
from teleop.scenario.sweeps.running import RunResult
from teleop.scenario.sweeps.sweep import Swept, sweep
from teleop.scenario.sweeps.sweep_folder import JOURNAL, TABLE, SweepFolder
from tests.teleop.scenario.sweeps.support import Worker, cells, scenario

OVER = ("link.delay=0,1", "operator.speed=0.3,0.6")
FIELDS = ("link.delay", "operator.speed")


def swept(folder: Path, made: tuple[Cell, ...], seeds: int, worker: Worker) -> Swept:
    opened = SweepFolder(folder, scenario(), FIELDS)
    try:
        return sweep(made, seeds, opened, worker)
    finally:
        opened.close()


def test_a_sweep_that_was_interrupted_goes_on_and_its_table_is_the_same_to_the_bit(
    tmp_path: Path,
) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    assert len(swept(whole, cells(*OVER), 3, Worker()).rows) == 12
    first = Worker(stop_after=5)
    broken = swept(parts, cells(*OVER), 3, first)
    assert broken.is_interrupted
    assert (len(broken.rows), broken.total) == (5, 12)
    assert pq.read_table(parts / TABLE).num_rows == 5
    second = Worker()
    done = swept(parts, cells(*OVER), 3, second)
    assert not done.is_interrupted
    assert done.earlier == 5
    assert len(second.asked) == 7
    assert not set(first.asked) & set(second.asked)
    assert (parts / TABLE).read_bytes() == (whole / TABLE).read_bytes()


def test_a_line_that_was_cut_off_by_a_kill_is_run_again(tmp_path: Path) -> None:
    swept(tmp_path, cells(*OVER), 1, Worker())
    table = (tmp_path / TABLE).read_bytes()
    journal = tmp_path / JOURNAL
    journal.write_bytes(journal.read_bytes()[:-20])
    worker = Worker()
    swept(tmp_path, cells(*OVER), 1, worker)
    assert len(worker.asked) == 1
    assert (tmp_path / TABLE).read_bytes() == table
    assert all(json.loads(line)["key"] for line in journal.read_text().splitlines())


def test_a_run_that_could_not_begin_is_tried_again(tmp_path: Path) -> None:
    class Lost(Worker):
        def __call__(self, runs: Sequence[Run]) -> Iterator[tuple[Run, RunResult]]:
            for run, done in super().__call__(runs):
                bad = "bad input" if run.cell.number == 2 else done.verdict
                yield run, replace(done, verdict=bad)

    assert len(swept(tmp_path, cells(*OVER), 2, Lost()).unrunnable) == 2
    worker = Worker()
    assert not swept(tmp_path, cells(*OVER), 2, worker).unrunnable
    assert len(worker.asked) == 2


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    swept(tmp_path, cells(*OVER), 1, Worker())
    journal = tmp_path / JOURNAL
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text(lines[0] + "{}\n" + lines[2])
    with pytest.raises(SettingError, match=r"runs\.jsonl:2: is damaged"):
        swept(tmp_path, cells(*OVER), 1, Worker())


def test_a_sweep_grows_by_values_and_seeds_and_runs_only_what_is_new(tmp_path: Path) -> None:
    swept(tmp_path, cells(*OVER), 2, Worker())
    worker = Worker()
    grown = swept(tmp_path, cells("link.delay=0,0.5,1", OVER[1]), 3, worker)
    assert len(worker.asked) == 3 * 2 * 3 - 2 * 2 * 2
    assert len(grown.rows) == 18


def test_the_table_has_a_row_for_each_run_in_the_order_of_cells_and_seeds(tmp_path: Path) -> None:
    done = swept(tmp_path, cells(*OVER), 2, Worker())
    table = pq.read_table(tmp_path / TABLE)
    names = ["link.delay", "operator.speed", "run", "seed", "verdict", "ending", "missed"]
    assert table.column_names == [*names, "position_max", "runaway", "goal_time", "sha256"]
    rows = table.to_pylist()
    order = [(row["link.delay"], row["operator.speed"], row["run"]) for row in rows]
    assert order == [(d, s, n) for d in (0.0, 1.0) for s in (0.3, 0.6) for n in (1, 2)]
    known = {run.scenario.seed: result for run, result in done.rows}
    assert all(row["sha256"] == known[row["seed"]].sha256 for row in rows)
    assert all(row["goal_time"] == float("inf") for row in rows)


def test_a_folder_of_another_sweep_is_not_mixed_with_this_one(tmp_path: Path) -> None:
    SweepFolder(tmp_path, scenario(), FIELDS).close()
    with pytest.raises(SettingError, match="another scenario"):
        SweepFolder(tmp_path, scenario(seed=1), FIELDS)
    with pytest.raises(SettingError, match=r"sweep over link\.delay, operator\.speed"):
        SweepFolder(tmp_path, scenario(), ["link.delay"])
    definition = tmp_path / "sweep.json"
    definition.write_text(definition.read_text().replace('"numpy": "', '"numpy": "0.'))
    with pytest.raises(SettingError, match="another version of numpy"):
        SweepFolder(tmp_path, scenario(), FIELDS)
    definition.write_text("{")
    with pytest.raises(SettingError, match="damaged"):
        SweepFolder(tmp_path, scenario(), FIELDS)


def test_two_sweeps_do_not_work_in_one_folder_at_a_time(tmp_path: Path) -> None:
    first = SweepFolder(tmp_path, scenario(), FIELDS)
    with pytest.raises(SettingError, match="at work"):
        SweepFolder(tmp_path, scenario(), FIELDS)
    first.close()
    SweepFolder(tmp_path, scenario(), FIELDS).close()


def test_what_was_computed_is_in_the_table_when_a_worker_fails(tmp_path: Path) -> None:
    class Failing(Worker):
        def __call__(self, runs):  # type: ignore[no-untyped-def]
            yield next(super().__call__(runs))
            raise SettingError("ended each worker")

    with pytest.raises(SettingError, match="ended each worker"):
        swept(tmp_path, cells(*OVER), 1, Failing())
    assert pq.read_table(tmp_path / TABLE).num_rows == 1
