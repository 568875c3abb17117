"""The ablation's own parts: its switches change the settings, and its table shows what changed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.ablation.drives import COST
from benchmarks.ablation.mechanisms import ALL, MECHANISMS, REMOVED, both
from benchmarks.ablation.runs import PAIRS, SPECIAL, concerned
from benchmarks.common.figures import Figure
from benchmarks.common.sheet import Sheet
from benchmarks.sheets.ablation import ablation, unmeasured
from localization.pipeline.localizer import LocalizerConfig


@pytest.mark.parametrize("name", MECHANISMS)
def test_each_mechanism_is_taken_out_by_settings_that_are_not_the_default(name: str) -> None:
    whole = LocalizerConfig()
    change = MECHANISMS[name]
    assert change(whole) != whole
    assert change(change(whole)) == change(whole)
    assert both()(whole) == whole


def test_drives_made_for_some_mechanisms_are_run_without_those_only() -> None:
    assert {name for names in SPECIAL.values() for name in names} <= set(MECHANISMS)
    assert {name for pair in PAIRS for name in pair} <= set(MECHANISMS)
    assert concerned("office", "debiasing")
    assert concerned("late scans, office", ALL)
    assert concerned("late scans, office", "debiasing + late readings")
    assert not concerned("late scans, office", "debiasing")


def test_table_of_the_ablation_shows_what_changed() -> None:
    sheet = Sheet()
    drive = [
        Figure("office", ALL, q, 1.0) for q in ("position", "heading", "NEES", "wrong", "doubt")
    ]
    log = [Figure("mirror", ALL, q, 2.0) for q in ("jumps", "first jump", "doubt")]
    same = [replace(f, method="a") for f in drive] + [Figure("office", "a", COST, 9.0, "ms")]
    other = [replace(f, method="b", value=3.0) for f in log]
    sheet.put("alone", [*drive, Figure("office", ALL, COST, 8.0, "ms"), *log], seconds=1.0)
    sheet.put("pairs", [*same, *other], seconds=1.0)
    table = ablation(sheet)
    assert "| office: position, heading, NEES, wrong, doubt |" in table
    assert "| all | 1, 1, 1, 1, 1 |" in table
    assert "| a | = |" in table
    assert "| b | 3, 3 |" in table
    assert "9" not in table


def test_table_of_the_ablation_marks_mechanisms_that_were_removed() -> None:
    sheet = Sheet()
    row = f"debiasing + {REMOVED[0]}"
    figures = [Figure("office", method, "position", 1.0) for method in (ALL, REMOVED[0], row)]
    sheet.put("alone", figures, seconds=1.0)
    table = ablation(sheet)
    assert f"| {REMOVED[0]} (removed) |" in table
    assert f"| debiasing + {REMOVED[0]} (removed) |" in table
    assert not set(REMOVED) & set(MECHANISMS)


def test_configurations_that_were_not_measured_are_listed() -> None:
    sheet = Sheet()
    sheet.put("alone", [Figure("office", ALL, "position", 1.0)], seconds=1.0)
    listed = unmeasured(sheet)
    assert all(f"*{name}*" in listed for name in MECHANISMS)
    assert f"*{ALL}*" not in listed
