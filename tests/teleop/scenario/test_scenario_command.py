"""The command ``farsteer scenario``."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree as Xml

import pytest

from localization.evaluation.tum_file import read_tum
from teleop.__main__ import main
from teleop.errors import SettingError
from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.shipped import scenario_files, shipped_files
from teleop.scenario.run_command import Run
from teleop.scenario.run_files import RUN_FILES
from teleop.scenario.scenario_runs import RunRequest, operator_named, with_folders

ROOT = Path(__file__).parents[3]

SHORT = """\
format = 1
name = "{name}"
[mission]
time_limit = 1.5
[limits]
{limits}
"""


def scenario_file(folder: Path, name: str, limits: str = "contacts = 0") -> Path:
    """Write a scenario of a second and a half."""
    file = folder / f"{name}.toml"
    file.write_text(SHORT.format(name=name, limits=limits))
    return file


def farsteer(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "teleop", "scenario", *map(str, words)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


def error_of(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command that must fail with status 2; return what it says."""
    assert main(["scenario", *words]) == 2
    text = capsys.readouterr().err
    assert "Traceback" not in text
    return text.partition("farsteer: ")[2].strip()


def test_list_names_the_scenarios_of_the_project(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenario", "list"]) == 0
    text = capsys.readouterr().out
    for name in shipped_files():
        assert f"\n{name}  (" in f"\n{text}"


def test_list_of_a_folder_says_what_is_wrong_with_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario_file(tmp_path, "good")
    (tmp_path / "bad.toml").write_text("format = 2\n")
    assert main(["scenario", "list", str(tmp_path)]) == 2
    text = capsys.readouterr().out
    assert "bad.toml:1: format: must be 1, got 2" in text
    assert "good  (office; follower)" in text


def test_explain_explains_a_field(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenario", "explain", "mission.time_limit"]) == 0
    assert "number > 0, <= 86400 [s], default 120.0" in capsys.readouterr().out


def test_the_printed_schema_is_json_with_descriptions(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenario", "schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema["$schema"].endswith("2020-12/schema")
    assert schema["properties"]["seed"]["description"].startswith("Seed of all that is drawn")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run"], "no scenario is given; `farsteer scenario list` names some"),
        (["run", "ofice-visit"], "did you mean office-visit?"),
        (["run", "office-visit", "--jobs", "0"], "--jobs must be >= 1, got 0"),
        (["run", "office-visit", "--seed", "-1"], "--seed must be >= 0 and < 2**63, got -1"),
        (
            ["run", "office-visit", "--client", "true", "--operator", "a:B"],
            "--client and --operator cannot both drive; give one of them",
        ),
        (["replay", "nowhere"], "nowhere is not a run of a scenario: outcome.json: No such file"),
        (["explain", "bogus"], "a scenario has no field 'bogus'"),
        (["list", "nowhere"], "nowhere is no folder"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = error_of(words, capsys)
    assert message in text
    assert "\n" not in text


def test_errors_of_a_file_are_listed_with_their_lines_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.toml"
    file.write_text('format = 1\nname = "a"\nsed = 1\n[mission]\ntime_limit = -1\n')
    text = error_of(["run", str(file), "--out", str(tmp_path / "out")], capsys)
    assert text.split("\n") == [
        f"{file}:3: sed: unknown field; did you mean seed?",
        f"{file}:5: mission.time_limit: must be > 0, got -1",
    ]
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_what_cannot_be_in_the_world_is_refused_with_its_line_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.toml"
    file.write_text('format = 1\nname = "a"\n[mission]\ngoals = [\n  {at = "libraryx"}]\n')
    text = error_of(["run", str(file), "--out", str(tmp_path / "out")], capsys)
    assert text.startswith(f"{file}:5: mission.goals[0].at: ")
    assert "library" in text
    assert not (tmp_path / "out").exists()


def test_an_earlier_run_is_not_replaced_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "outcome.json").touch()
    assert "already holds outcome.json" in error_of(
        ["run", "office-visit", "--out", str(tmp_path)], capsys
    )


def test_words_name_files_folders_and_scenarios_of_the_project(tmp_path: Path) -> None:
    a, b = scenario_file(tmp_path, "a"), scenario_file(tmp_path, "b")
    shipped = shipped_files()["office-visit"]
    assert scenario_files([str(tmp_path), str(a), "office-visit"]) == [a, b, a, shipped]
    # A floor plan beside them, as an editor on Windows writes it.
    (tmp_path / "hall.toml").write_bytes(b"\xef\xbb\xbfbounds = [0, 0, 5, 5]\r\n")
    (tmp_path / "z.toml").write_text("bounds = [0")
    assert scenario_files([str(tmp_path)]) == [a, b, tmp_path / "z.toml"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(SettingError, match="empty holds no scenario file"):
        scenario_files([str(tmp_path / "empty")])


def test_each_of_many_scenarios_has_a_name_and_a_folder_of_its_own(tmp_path: Path) -> None:
    long = "b" * 80
    names = ("a", "a", "a-2", "junit.xml", long, long)
    read = [read_scenario(scenario_file(tmp_path, name)) for name in names]
    requests = with_folders([RunRequest(tmp_path, each, Path()) for each in read], tmp_path)
    found = [request.folder.name for request in requests]
    assert found == ["a", "a-2", "a-2-2", "junit.xml-2", long, f"{long[:70]}-2"]
    assert [request.scenario.name for request in requests] == found


IMPATIENT = """\
import multiprocessing, os, signal
from teleop.scenario.operators.operator import Operator

class Impatient(Operator):
    def begin(self, wire, briefing):
        self.is_waiting = True

    def act(self, wire, now):
        if self.is_waiting and now >= 400_000_000:
            self.is_waiting = False
            is_command = multiprocessing.parent_process() is None
            os.kill(os.getpid() if is_command else os.getppid(), signal.SIGINT)
"""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", pytest.param("2", marks=pytest.mark.process)])
def test_ctrl_c_ends_all_scenarios_and_what_had_begun_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], jobs: str
) -> None:
    (tmp_path / "impatient.py").write_text(IMPATIENT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for name in ("a", "b", "c", "d", "e"):
        file = scenario_file(tmp_path, name)
        file.write_text(file.read_text().replace("1.5", "1000"))
    words = ["run", ".", "--jobs", jobs, "--operator", "impatient:Impatient", "--out", "out"]
    assert main(["scenario", *words]) == 130
    said = capsys.readouterr()
    assert "MISSED" in said.out
    assert "    interrupted" in said.out
    assert "interrupted: not all scenarios were run to their ends" in said.err
    root = Xml.parse(tmp_path / "out/junit.xml").getroot()
    begun = [str(suite.get("name")) for suite in root]
    # Two processes may come to their scenarios in either order.
    assert begun in (["a"], ["b"], ["a", "b"])[: 2 * int(jobs) - 1]
    assert root.get("errors") == str(len(begun))
    assert all((tmp_path / "out" / name / "report.html").is_file() for name in begun)


OPERATORS = """\
from teleop.scenario.operators.operator import Operator

class Still(Operator):
    def begin(self, wire, briefing): pass
    def act(self, wire, now): pass

class Other: pass
"""


def test_an_operator_of_one_s_own_is_found_in_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own_operators.py").write_text(OPERATORS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    assert type(operator_named("own_operators:Still")).__name__ == "Still"
    for name, message in {
        "own_operators": "must be module:Class",
        "own_operators:Other": "own_operators has Still",
        "own_operators:Missing": "own_operators has Still",
        "own_operatorz:Still": "there is no module own_operatorz",
    }.items():
        with pytest.raises(SettingError, match=message):
            operator_named(name)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
def test_a_run_leaves_reports_and_can_be_repeated_to_the_bit(tmp_path: Path) -> None:
    (tmp_path / "own_operators.py").write_text(OPERATORS)
    file = scenario_file(tmp_path, "short")
    done = farsteer("run", file, "--out", "run", "--operator", "own_operators:Still", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "1 of 1 passed" in done.stdout
    assert {p.name for p in (tmp_path / "run").iterdir()} <= set(RUN_FILES)
    outcome = json.loads((tmp_path / "run/outcome.json").read_text())
    assert outcome["passed"]
    assert outcome["figures"]["distance"] < 0.01
    assert Xml.parse(tmp_path / "run/junit.xml").getroot().get("failures") == "0"

    again = farsteer("replay", "run", "--json", cwd=tmp_path)
    assert again.returncode == 0
    verdict = {"status": "passed", "missed": []}
    assert json.loads(again.stdout) == {
        "same": True, "sha256": outcome["sha256"], "recorded": outcome["sha256"],
        "same_verdict": True, "verdict": verdict, "was": verdict,
    }  # fmt: skip

    inbox = tmp_path / "run/inbox.jsonl"
    inbox.write_text("".join(inbox.read_text().splitlines(keepends=True)[1:]))
    other = farsteer("replay", "run", "--out", "other", cwd=tmp_path)
    assert other.returncode == 1
    assert "NOT the same" in other.stdout
    assert (tmp_path / "other/report.html").is_file()


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
def test_a_killed_run_is_repeated_as_far_as_it_went_and_completed(tmp_path: Path) -> None:
    file = scenario_file(tmp_path, "killed")
    file.write_text(file.read_text().replace("1.5", "60"))
    words = [sys.executable, "-m", "teleop", "scenario", "run", str(file), "--out", "run"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    begun = subprocess.Popen(words, cwd=tmp_path, env=environment, stderr=subprocess.DEVNULL)
    truth = tmp_path / "run/truth.tum"
    while begun.poll() is None and not (truth.is_file() and truth.read_text().count("\n") > 100):
        time.sleep(0.1)
    begun.kill()
    begun.wait()
    run = tmp_path / "run"
    ticks = len(read_tum(run / "truth.tum"))
    assert ticks >= 100
    assert not (run / "outcome.json").exists()

    done = farsteer("replay", "run", "--out", "again", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"the recorded run broke off here, at {ticks / 50:g} s" in done.stdout
    assert "run was killed before it was judged; true poses as far as it went: the same" in (
        done.stdout
    )
    assert (tmp_path / "again/truth.tum").read_bytes() == (run / "truth.tum").read_bytes()
    outcome = json.loads((tmp_path / "again/outcome.json").read_text())
    assert outcome["status"] == "missed"  # it has not been seen to pass


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
def test_many_files_give_one_table_and_the_worst_exit_status(tmp_path: Path) -> None:
    scenario_file(tmp_path, "a-passes")
    scenario_file(tmp_path, "b-misses", "nees = [1000.0, 2000.0]")
    (tmp_path / "c-bad.toml").write_text('format = 1\nname = "c"\nseeed = 2\n')
    done = farsteer("run", ".", "--out", "out", "--jobs", "2", "--seed", "5", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    lines = [line for line in done.stdout.splitlines() if line and not line.startswith(" ")]
    assert [line.split()[:2] for line in lines[1:4]] == [
        ["a-passes", "passed"], ["b-misses", "MISSED"], ["c-bad.toml", "BAD"]
    ]  # fmt: skip
    assert "c-bad.toml:3: seeed: unknown field; did you mean seed?" in done.stdout
    assert "1 of 3 passed" in done.stdout
    root = Xml.parse(tmp_path / "out/junit.xml").getroot()
    assert [suite.get("name") for suite in root] == ["a-passes", "b-misses", "c-bad.toml"]
    assert (tmp_path / "out/b-misses/report.html").is_file()
    assert json.loads((tmp_path / "out/a-passes/scenario.json").read_text())["seed"] == 5


def test_help_of_run_explains_the_exit_status(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["scenario", "run", "--help"])
    assert "3 if the client failed" in " ".join(capsys.readouterr().out.split())
    assert Run().jobs is None
