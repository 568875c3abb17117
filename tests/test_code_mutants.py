"""Mutants of the code: which changes are made, that they are found again, and what becomes of them in a small clone."""

from __future__ import annotations

import ast
import json
import subprocess
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest

from tools.code_mutants import trial
from tools.code_mutants.mutations import draw, find, mutants_of

ROOT = Path(__file__).resolve().parents[1]

CODE = """
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    x = 1 < 2

LIMIT: int = 3


class Robot:
    fast: bool = True

    def speed(self, wanted: float) -> float:
        \"\"\"Limit it.\"\"\"
        if 0.0 <= wanted < LIMIT and not self.fast:
            self.count += 1
            self.wanted = wanted
            raise ValueError(f"grüße {wanted + 1}")
        return max(wanted, -self.count)
"""
CHANGES = {
    "<module>": ["3 -> 4"],
    "Robot": ["True -> False"],
    "Robot.speed": [
        "0.0 <= wanted < LIMIT and (not self.fast) -> not (0.0 <= wanted < LIMIT and (not self.fast))",
        "0.0 <= wanted < LIMIT and (not self.fast) -> 0.0 <= wanted < LIMIT or not self.fast",
        "0.0 <= wanted < LIMIT -> 0.0 < wanted < LIMIT",
        "0.0 <= wanted < LIMIT -> 0.0 <= wanted <= LIMIT",
        "0.0 -> 1.0",
        "not self.fast -> self.fast",
        "self.count += 1 -> pass",
        "1 -> 2",
        "self.wanted = wanted -> pass",
        "raise ValueError(f'grüße {wanted + 1}') -> pass",
        "return max(wanted, -self.count) -> return None",
        "max(wanted, -self.count) -> max(-self.count, wanted)",
        "-self.count -> self.count",
    ],
}


def test_changes_are_those_of_a_careless_programmer_and_each_is_valid_code() -> None:
    found: dict[str, list[str]] = {}
    for mutant in mutants_of({"a/robot.py": CODE}):
        found.setdefault(mutant.scope, []).append(mutant.change.partition(" in: ")[0])
        changed = mutant.applied_to(CODE)
        assert changed != CODE
        assert mutant.imported == (mutant.scope != "Robot.speed")
        assert ast.unparse(ast.parse(changed)) != ast.unparse(ast.parse(CODE))
    assert found == CHANGES


def test_mutant_is_found_again_after_its_lines_or_its_function_have_moved() -> None:
    mutants = list(mutants_of({"a/robot.py": CODE}))
    named = [(mutant.case, mutant.change) for mutant in mutants]
    lower = find(named, {"a/robot.py": f"import math\n\n{CODE}"})
    assert [m.change for m in lower if m] == [m.change for m in mutants]
    assert [min(m.lines) for m in lower if m] == [min(m.lines) + 2 for m in mutants]
    elsewhere = find(named, {"a/robot.py": "", "b/machine.py": CODE})
    assert elsewhere[0] is None
    assert {m.case for m in elsewhere[1:] if m} == {
        "b/machine.py::Robot",
        "b/machine.py::Robot.speed",
    }


def test_mutant_whose_statement_has_gone_or_is_in_two_places_is_not_found() -> None:
    named = [(mutant.case, mutant.change) for mutant in mutants_of({"a/robot.py": CODE})]
    other = find(named, {"a/robot.py": CODE.replace("max(wanted", "min(wanted")})
    assert [change for (_, change), mutant in zip(named, other, strict=True) if mutant is None] == [
        change for _, change in named if "max(" in change
    ]
    assert find(named, {"b/one.py": CODE, "b/two.py": CODE}) == [None] * len(named)


def test_equal_changes_of_one_function_have_different_names() -> None:
    mutants = list(mutants_of({"a.py": "def f(x):\n    x += 1\n    x += 1\n"}))
    assert len({mutant.change for mutant in mutants}) == len(mutants) == 4


def test_draw_is_repeated_by_its_seed_and_takes_each_folder_in_proportion_to_its_lines() -> None:
    functions = [f"def f{number}(x):\n    return x + {number}\n" for number in range(50)]
    sources = {
        "a/b/long.py": "".join(functions),
        "a/c/short.py": functions[0],
        "a/d/d.py": functions[1],
    }
    drawn = draw(sources, 20, seed=1)
    assert drawn == draw(sources, 20, seed=1)
    assert drawn != draw(sources, 20, seed=2)
    assert [mutant.path for mutant in drawn] == ["a/b/long.py"] * 18 + [
        "a/c/short.py",
        "a/d/d.py",
    ]
    assert len({mutant.case for mutant in drawn}) == 20
    with pytest.raises(ValueError, match="--count 2 is too small for 3 folders"):
        draw(sources, 2, seed=1)


CLAMP = """
def clamp(value, most):
    while value > most:
        value -= 1
    return value


def unused(value):
    return value
"""
TESTS = """
from robot_sim.clamp import clamp

def test_value_is_limited():
    assert (clamp(5, 3) or 3) == 3

def test_number_is_returned():
    assert clamp(1, 3) == 1

def test_never_passes():
    assert clamp(5, 3) == 4
"""
TEST = "tests/robot_sim/test_clamp.py::test_"


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository of one file and its tests."""
    folder = tmp_path / "clone"
    for name, text in {
        "robot_sim/__init__.py": "",
        "robot_sim/clamp.py": CLAMP,
        "tests/robot_sim/test_clamp.py": TESTS,
        "pyproject.toml": '[tool.pytest.ini_options]\naddopts = "-ra"\nmarkers = ["long", "process"]\n',
    }.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    git(folder, "init", "--quiet")
    commit(folder)
    monkeypatch.setattr(trial, "PATIENCE", 10.0)
    return folder


def git(folder: Path, *words: str) -> None:
    who = ("-c", "user.name=test", "-c", "user.email=test@localhost")
    subprocess.run(["git", "-C", str(folder), *who, *words], check=True, capture_output=True)


def commit(folder: Path) -> None:
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "--message", "Change it")


def tool() -> ModuleType:
    loader = SourceFileLoader("code_mutants_command", str(ROOT / "tools/code-mutants"))
    spec = spec_from_loader(loader.name, loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module


def outcomes(sheet: Path) -> list[tuple[str, str]]:
    """Return each change of a sheet with what became of it."""
    return [
        (figure["method"].partition(" in: ")[0], figure["quantity"])
        for part in json.loads(sheet.read_text()).values()
        for figure in part["figures"]
    ]


@pytest.mark.process
@pytest.mark.long
def test_mutants_are_caught_by_failing_and_by_hanging_tests_and_a_lost_test_is_reported(
    clone: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    command, place = tool(), tmp_path / "place"
    wanted = ("value >= most", "pass", "None")
    every = list(mutants_of({"robot_sim/clamp.py": CLAMP}))
    chosen = [m for m in every if m.change.partition(" in: ")[0].endswith(wanted)]
    monkeypatch.setattr(command, "draw", lambda *_: chosen)
    first, second = place / "mutants.json", place / "later.json"
    assert command.main([], clone, place) == 0
    assert outcomes(first) == [
        ("value > most -> value >= most", f"caught by {TEST}value_is_limited"),
        ("value -= 1 -> pass", "caught: no end in 10 s"),
        ("return value -> return None", f"caught by {TEST}number_is_returned"),
        ("return value -> return None", "survived: no recorded test runs it"),
    ]
    assert (clone / "robot_sim/clamp.py").read_text() == CLAMP
    capsys.readouterr()
    assert command.main([], clone, place) == 0
    assert capsys.readouterr().out.startswith("0 of 4 mutants to try at ")

    path = clone / "tests/robot_sim/test_clamp.py"
    path.write_text(TESTS.replace("(clamp(5, 3) or 3) == 3", "clamp(5, 3) != 4"))
    changed = CLAMP.replace("value -= 1", "value = value - 1").replace("def unused", "def renamed")
    (clone / "robot_sim/clamp.py").write_text(changed)
    commit(clone)
    with pytest.raises(ValueError, match="move it, or name another --out"):
        command.main([], clone, place)
    with pytest.raises(ValueError, match="must be a sheet, and another than --out"):
        command.main(["--against", str(first)], clone, place)
    assert command.main(["--against", str(first), "--out", str(second)], clone, place) == 1
    assert outcomes(second) == [
        ("value > most -> value >= most", "survived"),
        ("value -= 1 -> pass", "gone: not counted"),
        ("return value -> return None", f"caught by {TEST}number_is_returned"),
        ("return value -> return None", "gone: not counted"),
    ]
    assert capsys.readouterr().out.endswith(
        "was caught before: robot_sim/clamp.py::clamp: "
        "value > most -> value >= most in: while value > most:\n"
    )
