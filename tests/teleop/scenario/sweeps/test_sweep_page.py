from __future__ import annotations

import re

from teleop.scenario.sweeps.cells import runs_of
from teleop.scenario.sweeps.costs import costs_of
from teleop.scenario.sweeps.sweep import Swept
from teleop.scenario.sweeps.sweep_page import groups, page
from teleop.scenario.sweeps.sweep_statistics import Rows
from tests.teleop.scenario.sweeps.support import cells, result, scenario

OVER = ("link.delay=0,1", "operator.speed=0.3,0.6")


def swept(rows: Rows) -> Swept:
    return Swept(rows, 8, 0, costs_of(r for _, r in rows), False)


def test_the_page_shows_plots_over_each_field_and_what_did_not_pass() -> None:
    runs = runs_of(cells(*OVER), 2)
    rows = [(r, result(r, verdict="missed", missed="stops")) for r in runs[:1]]
    rows += [(r, result(r)) for r in runs[1:]]
    text = page(scenario(), swept(rows), "farsteer sweep x")
    assert text.count("<svg") == 6
    assert "link.delay and operator.speed" in text
    # Each cell is in the grid of the two fields, and in the list of cells.
    assert [text.count(f">{share}%</td>") for share in (50, 100)] == [2, 6]
    assert "7 of 8 passed" in text
    assert str(runs[0].scenario.seed) in text
    assert "farsteer sweep x" in text
    assert "slows down for, and refuses, old commands" in text
    assert "<script" not in text
    assert not re.search(r'(src|href)="(?!data:|#)', text)


def test_the_page_says_that_limits_on_old_commands_are_off() -> None:
    runs = runs_of(cells("link.delay=0"), 1)
    deaf = scenario(world={"scene": "corridor", "stale_limits": False})
    assert "limits on stale sticks are off" in page(deaf, swept([(r, result(r)) for r in runs]), "")


def test_texts_of_a_run_cannot_become_markup() -> None:
    runs = runs_of(cells("world.scene=corridor,office"), 1)
    evil = "<script>alert(1)</script>"
    rows = [(r, result(r, verdict="bad input", ending=evil, figures={}, sha256="")) for r in runs]
    text = page(scenario(), swept(rows), evil)
    assert "<script" not in text
    assert "&lt;script&gt;" in text
    assert "2 could not be run" in text


def test_the_terminal_has_a_line_for_each_value() -> None:
    rows = [(r, result(r)) for r in runs_of(cells(*OVER), 2)]
    lines = groups(rows, ["link.delay", "operator.speed"])
    assert len(lines) == 5
    assert all(len(line) <= 80 for line in lines)
    assert "4 of 4" in lines[1]


def test_a_sweep_that_was_interrupted_before_its_first_run_has_a_page() -> None:
    assert "0 of 0 passed" in page(scenario(), swept([]), "farsteer sweep x")
