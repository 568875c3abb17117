"""Figures, the sheets that keep them, and the benchmarks by name."""

from __future__ import annotations

import ast
import json
import re
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from benchmarks import __main__ as command
from benchmarks.common.figures import Figure, poisson, share, wilson
from benchmarks.common.sheet import Sheet, commit, measure
from benchmarks.sheets.pages import facts

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
RESULTS = BENCHMARKS / "results"


def test_figures_say_whether_their_goal_is_met_and_proved() -> None:
    assert share("", "", "", 100, 100, least=95.0).verdict == "met"
    assert share("", "", "", 98, 100, least=95.0).verdict == "met, not proved"
    assert share("", "", "", 90, 100, least=95.0).verdict == "missed"
    assert Figure("", "", "", float("nan"), most=1.0).verdict == "missed"
    assert Figure("", "", "", 5.0).verdict == ""


def test_a_part_measured_anew_takes_the_place_of_the_old_and_leaves_the_others(
    tmp_path: Path,
) -> None:
    path = tmp_path / "sheet.json"
    one = Figure("case", "method", "what", 1.5, "cm", 3, 1.0, 2.0, most=2.0)
    none = Figure("case", "method", "nothing", float("nan"))
    Sheet(path).put("first", [one, none], seconds=1.0)
    Sheet(path).put("second", [one], seconds=1.0)
    Sheet(path).put("first", [none], seconds=1.0)
    held = Sheet(path).parts
    assert held["second"] == (one,)
    assert [f.quantity for f in held["first"]] == ["nothing"]
    assert np.isnan(held["first"][0].value)
    path.write_text("[1]")
    with pytest.raises(ValueError, match="no sheet of figures"):
        Sheet(path)


def test_only_a_run_of_all_parts_drops_those_of_other_commits(tmp_path: Path) -> None:
    path = tmp_path / "sheet.json"
    old = Sheet(path)
    old.commit = "0000000"
    one = Figure("case", "method", "what", 1.5)
    for part in ("short", "long"):
        old.put(part, [one], seconds=1.0)
    measure({"short": lambda: iter([one])}, path, whole=False)
    assert {p: told["commit"] for p, told in Sheet(path).facts.items()} == {
        "short": commit(),
        "long": "0000000",
    }
    assert facts(Sheet(path)).endswith("Measured at 2 commits.")
    measure({"short": lambda: iter([one])}, path, whole=True)
    assert list(Sheet(path).parts) == ["short"]
    assert "commits" not in facts(Sheet(path))


def test_commit_is_that_of_the_clone_if_there_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    assert re.fullmatch(r"([0-9a-f]{7,40}(-dirty)?)?", commit())
    monkeypatch.setenv("PATH", "")
    assert commit.__wrapped__() == ""


def test_a_sheet_in_its_first_form_is_read_and_written_anew_a_figure_a_line(tmp_path: Path) -> None:
    one = Figure("case", "method", "what", 1.5, "cm", 3, 1.0, 2.0, most=2.0)
    none = Figure("case", "method", "nothing", float("nan"))
    told = {"date": "2026-11-24 12:17", "machine": "AMD EPYC", "load": 1.0, "cpu_seconds": 2.0}
    figures = [{**asdict(one)}, {**asdict(none), "value": None}]
    path = tmp_path / "sheet.json"
    path.write_text(json.dumps({"part": {"facts": told, "figures": figures}}, indent=1))
    sheet = Sheet(path)
    sheet.write()
    written = path.read_text()
    assert [line for line in written.splitlines() if '"case"' in line] == [
        '   {"case": "case", "method": "method", "quantity": "what", "value": 1.5, "unit": "cm", "n": 3,'
        ' "low": 1.0, "high": 2.0, "most": 2.0},',
        '   {"case": "case", "method": "method", "quantity": "nothing", "value": null}',
    ]
    assert json.loads(written)["part"]["facts"] == told
    held = Sheet(path)
    assert held.parts["part"][0] == sheet.parts["part"][0] == one
    assert np.isnan(held.parts["part"][1].value)
    assert held.text == written


@pytest.mark.parametrize("path", sorted(RESULTS.iterdir()), ids=lambda path: path.name)
def test_kept_sheet_is_in_the_form_that_is_written(path: Path) -> None:
    assert Sheet(path).text == path.read_text(), "run: python -m benchmarks.common.sheet FILE"


def test_bounds_of_events_are_garwoods() -> None:
    # Garwood 1936: 0 events are up to 3.69, 10 are 4.80 to 18.39.
    assert poisson(0) == pytest.approx((0.0, 3.689), abs=1e-3)
    assert poisson(10) == pytest.approx((4.795, 18.39), abs=1e-2)


def test_bounds_of_a_share_are_wilsons() -> None:
    # Brown, Cai and DasGupta 2001: 0 of 10 is up to 27.8 %, 5 of 10 is 23.7 to 76.3 %.
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-3)
    assert wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-3)
    assert wilson(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize("name", command.COMMANDS)
def test_benchmark_has_a_main(name: str) -> None:
    module = BENCHMARKS / f"{command.COMMANDS[name].replace('.', '/')}.py"
    body = ast.parse(module.read_text(encoding="utf-8")).body
    assert any(isinstance(part, ast.FunctionDef) and part.name == "main" for part in body)


def test_word_that_names_nothing_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["benchmarks", "arm", "picks", "hint"])
    assert command.main() == 2
    assert "no benchmark or part hint; the benchmarks are ablation, " in capsys.readouterr().err
