"""The page on sweeps: its first command gives the table that stands below it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import pytest

from teleop.__main__ import main
from teleop.scenario.files.scenario import SCHEMA
from teleop.scenario.sweeps.cells import Run
from teleop.scenario.sweeps.running import RunResult, run_one

PAGE: Final = (Path(__file__).parents[4] / "docs/sweeps.md").read_text(encoding="utf-8")
FIGURES: Final = {4: 0.5, 5: 0.1}
"""Column of a median: share by which it may differ from that of the page, whose digits any change of the localiser
or of the drive changes."""


def here(runs: Sequence[Run]) -> Iterator[tuple[Run, RunResult]]:
    """Run in this process what workers would."""
    for run in runs:
        yield run, RunResult(**run_one(SCHEMA.dump_json(run.scenario).decode(), None))


def rows(text: str) -> list[list[str]]:
    """Return the rows of the first table in a text, column by column."""
    lines = text.splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith("over "))
    table = [re.split(r"  +", line) for line in lines[begin : begin + 10]]
    return [row for row in table if len(row) == 6]


@pytest.mark.long
@pytest.mark.slow
def test_the_first_command_gives_the_table_below_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("teleop.scenario.sweeps.command._compute", lambda workers, beside: here)
    command = re.search(r"^\.venv/bin/farsteer (sweep .*)$", PAGE, re.M)
    assert command is not None
    assert main([*shlex.split(command[1]), "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert len(rows(printed)) == 3
    for found, stands in zip(rows(printed), rows(PAGE), strict=True):
        assert found[:4] == stands[:4], printed
        for column, share in FIGURES.items():
            if found[column] != stands[column]:
                assert float(found[column]) == pytest.approx(float(stands[column]), rel=share)
