from __future__ import annotations

from pathlib import Path

from teleop.scenario.files.reading import read_scenario
from teleop.scenario.sweeps.cells import runs_of
from teleop.scenario.sweeps.failed_files import FOLDER, write_failed
from tests.teleop.scenario.sweeps.support import cells, result


def test_the_first_failure_of_each_cell_becomes_a_file_of_the_same_run(tmp_path: Path) -> None:
    runs = runs_of(cells("link.delay=0,0.5,1"), 2)
    rows = [
        (run, result(run, verdict="passed" if run.cell.number == 1 else "missed", missed="stops"))
        for run in runs
    ]
    assert write_failed(rows, tmp_path) == 2
    files = sorted((tmp_path / FOLDER).iterdir())
    assert [file.name for file in files] == ["short-cell-0.toml", "short-cell-2.toml"]
    for file, run in zip(files, (runs[0], runs[2]), strict=True):
        read = read_scenario(file)
        assert read.seed == run.scenario.seed
        assert read.fault == run.scenario.fault
        assert "stops" in read.description
    notes = tmp_path / FOLDER / "notes.toml"
    notes.touch()
    assert write_failed([], tmp_path) == 0
    assert list((tmp_path / FOLDER).iterdir()) == [notes]


def test_a_scene_beside_the_file_is_not_promised_to_be_found_elsewhere(tmp_path: Path) -> None:
    own = {"scene": str(tmp_path / "own.toml")}
    rows = [(r, result(r, verdict="missed")) for r in runs_of(cells("link.delay=0", world=own), 1)]
    assert write_failed(rows, tmp_path) == 0
    assert not (tmp_path / FOLDER).exists()
