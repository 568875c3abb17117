"""The robot against published figures and closed forms, and the page with the results."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from robot_sim.errors import PageError
from robot_sim.robot.platforms import HUSKY, JACKAL, P3AT
from robot_sim.validation import PARTS, Row, friction_theory as coulomb, validate
from robot_sim.validation.report import (
    markdown_table,
    page_with_tables,
    plain,
    surfaces,
    verdict,
)
from robot_sim.validation.row import reported, within
from teleop.__main__ import main

PAGE = Path(__file__).parents[3] / "docs/sheets/robot.md"


@cache
def measured(part: str) -> tuple[Row, ...]:
    """The rows of a part, run once per process."""
    return tuple(PARTS[part]())


@pytest.mark.slow
@pytest.mark.parametrize("part", PARTS)
def test_robot_meets_every_row_on(part: str) -> None:
    rows = measured(part)
    sys.stdout.write(f"\n{plain(rows)}\n")
    assert rows
    for row in rows:
        assert row.passed, str(row)
        assert math.isfinite(row.value), str(row)
        # The tyres' lateral grip was fitted to the published curve, and nothing else to its target.
        assert row.fitted == (part == "curves"), str(row)


def grid(text: str) -> list[list[str]]:
    """The cells of all tables in a text, heads included."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def marked(name: str) -> str:
    """The part of the page between the comments of a name."""
    _, _, after = PAGE.read_text(encoding="utf-8").partition(f"<!-- {name} begin -->")
    text, end, _ = after.partition(f"<!-- {name} end -->")
    assert end
    return text


def number(cell: str) -> tuple[float, float, str]:
    """A cell's number, the step of its last digit, and its unit."""
    text, _, unit = cell.partition(" ")
    return float(text), 10.0 ** -len(text.partition(".")[2]), unit


@pytest.mark.slow
def test_page_shows_the_values_of_a_fresh_run() -> None:
    fresh = grid(markdown_table([row for part in PARTS for row in measured(part)]))
    page = grid(marked("validation"))
    again = "run farsteer validate --write docs/sheets/robot.md"
    assert len(page) == len(fresh), again
    for there, here in zip(page, fresh, strict=True):
        # All but the value: name, target, tolerance, result, source.
        assert there[:3] + there[4:] == here[:3] + here[4:], again
        if here[0] == "what" or set(here[0]) == {"-"}:
            continue
        (a, step, unit), (b, _, expected) = number(there[3]), number(here[3])
        assert unit == expected, again
        assert abs(a - b) <= 1.5 * step, f"{again}: {there[0]} is {b}, the page says {a}"


def test_page_lists_the_surfaces() -> None:
    assert grid(marked("surfaces")) == grid(surfaces())


def test_command_prints_rows_and_writes_the_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = {"replay": PARTS["replay"]}
    monkeypatch.setattr("robot_sim.validation.PARTS", quick)
    page = tmp_path / "robot.md"
    page.write_text(
        "above\n<!-- validation begin -->stale!<!-- validation end -->\nmiddle\n"
        "<!-- surfaces begin -->\n<!-- surfaces end -->\nbelow\n"
    )
    assert main(["validate", "--write", str(page)]) == 0
    printed = capsys.readouterr().out
    assert "target 0 exact, ok\n      (bit for bit)" in printed
    table, _, _ = printed.partition("tables written to")  # a path is as long as it is
    assert max(map(len, table.splitlines())) <= 80
    text = page.read_text()
    assert "stale!" not in text
    assert [t in text for t in ("above", "middle", "below", "| bit for bit |", "| ice |")] == [
        True
    ] * 5
    assert main(["validate", "--write", str(page)]) == 0
    assert page.read_text() == text
    capsys.readouterr()
    assert main(["validate", "--json"]) == 0
    judgement = json.loads(capsys.readouterr().out)
    assert judgement["passed"] is True
    assert [row["result"] for row in judgement["rows"]] == ["ok"] * len(judgement["rows"])


def test_command_ends_with_1_if_a_row_is_missed_and_names_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [
        within("g", "chi", 1.466, 0.03, 2.1, source="s"),
        Row(group="g", name="b", target=1, tolerance=0, value=1, source="s"),
    ]
    monkeypatch.setattr("robot_sim.validation.PARTS", {"wrong": lambda: iter(rows)})
    assert main(["validate"]) == 1
    assert "1 of 2 judged rows missed: chi" in capsys.readouterr().out


def test_page_without_markers_is_rejected_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robot_sim.validation.PARTS", {"replay": PARTS["replay"]})
    page = tmp_path / "page.md"
    page.write_text("nothing")
    assert main(["validate", "--write", str(page)]) == 2
    error = capsys.readouterr().err
    assert "page.md: the page needs one <!-- validation begin -->" in error
    with pytest.raises(PageError, match="one <!-- surfaces begin --> and after it one"):
        page_with_tables("<!-- validation begin --><!-- validation end -->", ())


def test_progress_names_each_part_and_grows() -> None:
    seen: list[tuple[float, str]] = []
    with pytest.MonkeyPatch.context() as patch:
        quick: dict[str, object] = {name: (lambda: iter(())) for name in PARTS}
        patch.setattr("robot_sim.validation.PARTS", quick)
        assert validate(lambda share, name: seen.append((share, name))) == ()
    assert [name for _, name in seen] == list(PARTS)
    assert [share for share, _ in seen] == sorted({share for share, _ in seen})


def test_row_passes_only_within_its_tolerance_and_a_control_only_outside() -> None:
    row = within("g", "chi", 2.0, 0.01, 2.019, source="s")
    assert row.passed
    assert row.cells == ("chi", "2.000", "± 1 %", "2.019", "ok", "s")
    far = dataclasses.replace(row, value=2.021)
    assert (far.passed, far.result) == (False, "missed")
    assert dataclasses.replace(far, control=True).passed
    assert not dataclasses.replace(row, control=True).passed
    for control in (False, True):
        assert not dataclasses.replace(row, value=math.nan, control=control).passed
    free = reported("g", "t63", 50.0, 80.0, unit="ms", source="s", digits=0)
    assert free.cells == ("t63", "50 ms", "none", "80 ms", "reported", "s")
    assert verdict([row, far, free]) == "1 of 2 judged rows missed: chi"


def test_verdict_counts_judged_rows_and_says_which_were_fitted() -> None:
    row = within("g", "chi", 2.0, 0.01, 2.0, source="s")
    fitted = dataclasses.replace(row, fitted=True)
    free = reported("g", "t63", 50.0, 80.0, source="s")
    assert fitted.result == "ok (fitted)"
    assert verdict([row, fitted, free]) == "2 judged rows met, of which 1 fitted; 1 reported only"
    missed = dataclasses.replace(fitted, value=3.0)
    assert missed.result == "missed"


def test_small_negative_numbers_print_without_a_sign() -> None:
    assert (
        Row(
            group="g", name="n", target=0.0, tolerance=1.0, value=-1e-9, unit="mm", source="s"
        ).cells[3]
        == "0.000 mm"
    )


@given(ratio=st.floats(0.3, 3.0))
def test_chi_grows_with_friction_across_and_is_1_without(ratio: float) -> None:
    robot = P3AT()
    assert coulomb.anisotropic_chi(robot, ratio) > coulomb.anisotropic_chi(robot, 0.9 * ratio)
    assert coulomb.anisotropic_chi(robot, 0.0) == 1.0


@pytest.mark.parametrize("robot", [P3AT(), HUSKY, JACKAL], ids=lambda robot: robot.name)
def test_solver_agrees_with_the_closed_form_where_there_is_one(robot: P3AT) -> None:
    assert coulomb.turning_chi(robot, 0.0) == pytest.approx(robot.chi, rel=1e-9)


@given(offset=st.floats(0.001, 0.025))
def test_solver_gives_the_same_for_a_load_in_front_and_behind(offset: float) -> None:
    robot = P3AT()
    front, behind = coulomb.turning_chi(robot, offset), coulomb.turning_chi(robot, -offset)
    assert front == pytest.approx(behind, rel=1e-6)
    assert front < robot.chi


def test_solver_rejects_a_load_beyond_its_range() -> None:
    with pytest.raises(ValueError, match=r"within 0\.03 m, got 0\.04"):
        coulomb.turning_chi(P3AT(), 0.04)


def test_published_curve_has_the_values_that_the_notes_read_from_it() -> None:
    curves = (0.0, 2.0, 10.0, 50.0)
    values = [coulomb.published_chi(curve) for curve in curves]
    np.testing.assert_allclose(values, [1.473, 1.439, 1.404, 1.343], atol=6e-4)


def test_torque_of_the_robot_without_scanners_is_the_published_one() -> None:
    robot = dataclasses.replace(P3AT(), chassis_mass=14.2 - 2.6)
    assert robot.mass == pytest.approx(27.1)
    assert coulomb.spin_torque(robot, 0.7) == pytest.approx(2.91, abs=0.015)
