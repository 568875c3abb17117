"""A recorded run repeats to the bit, with any operator and any fault; a damaged one is refused in one line."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from localization.maps.cloud import CloudError
from robot_sim.errors import SimulationError
from teleop.errors import SettingError, TeleopError
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.operators.operator import Operator
from teleop.scenario.referee.outcome import Event, EventKind, ExitStatus, Outcome
from teleop.scenario.session.inbox_file import InboxFileError
from teleop.scenario.session.referee_notes import KINDS, Ending, NotesFileError, NotesWriter
from teleop.scenario.session.run import RunInterrupted, replay_run, run_scenario
from tests.teleop.scenario.session.support import Forward, scenario

GOALS = [{"at": [3.2, 4.0], "within": 0.4}, {"at": [4.2, 4.0], "within": 0.2}]
FILES = (
    "scenario.json",
    "inbox.jsonl",
    "notes.jsonl",
    "truth.tum",
    "estimate.tum",
    "trace.csv",
    "readings.mcap",
)


def assert_repeats(run: Path, first: Outcome, again: Path) -> Outcome:
    """Check that a run repeats to the bit, with all that is recorded of it."""
    second = replay_run(run, again)
    assert second.sha256 == first.sha256
    assert second.figures == pytest.approx(first.figures, rel=0.0, abs=0.0, nan_ok=True)
    assert second.events == first.events
    assert [check.met for check in second.checks] == [check.met for check in first.checks]
    assert second.command_ages.tolist() == first.command_ages.tolist()
    for name in FILES:
        assert (again / name).read_bytes() == (run / name).read_bytes(), name
    return second


OPERATORS: dict[str, dict[str, Any]] = {
    "follower by cmd_vel": {"kind": "follower", "interface": "cmd_vel"},
    "steering": {"kind": "steering", "lapses": 60.0},
    "careless": {"kind": "careless", "mistakes": 60.0},
}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("operator", OPERATORS)
def test_run_of_each_operator_repeats_to_the_bit(tmp_path: Path, operator: str) -> None:
    chosen = scenario(operator=OPERATORS[operator], goals=GOALS, time=4.0, seed=6)
    first = run_scenario(chosen, tmp_path / "run")
    assert first.figures["distance"] > 0.3, "it drove"
    assert_repeats(tmp_path / "run", first, tmp_path / "again")


@pytest.mark.slow
def test_recorded_commands_that_are_sent_again_repeat_the_run_themselves(tmp_path: Path) -> None:
    chosen = scenario(goals=GOALS, time=3.0)
    first = run_scenario(chosen, tmp_path / "run")
    sizes = {file.name: file.stat().st_size for file in (tmp_path / "run").iterdir()}
    assert sizes["inbox.jsonl"] < 0.05 * sum(sizes.values()), "the record costs little"
    shutil.copy(tmp_path / "run" / "commands.jsonl", tmp_path)
    replaying = scenario(
        goals=GOALS, time=3.0, operator={"kind": "replay", "file": "commands.jsonl"}
    )
    second = run_scenario(replaying, tmp_path / "second", beside=tmp_path)
    assert second.sha256 == first.sha256
    assert_repeats(tmp_path / "second", second, tmp_path / "again")


FAULTS: dict[str, list[dict[str, Any]]] = {
    "places": [
        {"kind": "kidnap", "at": 0.5, "to": "niche"},
        {"kind": "kidnap", "at": 0.9},
        {"kind": "kidnap", "at": 1.1, "to": [20.0, 4.4, -30.0]},
        *({"kind": "wrong_hint", "at": t, "off": 2.0, "turned": 40.0} for t in (0.4, 0.9)),
    ],
    "commands": [
        {"kind": "link", "at": 0.4, "delay": 0.1, "jitter": 0.2, "lasting": 1.0},
        {"kind": "clock_step", "at": 0.6, "step": 30.0},
        {"kind": "estop", "at": 0.8, "lasting": 0.4},
        {"kind": "estop", "at": 1.5},
    ],
    "sensors": [
        {"kind": "wheel_slip", "at": 0.5},
        {"kind": "scanner_dirty", "at": 0.2},
        {"kind": "scanner_dead", "at": 1.0, "lasting": 0.5},
        {"kind": "box", "at": 0.4, "to": [5.0, 4.5]},
        {"kind": "person", "at": 0.2, "path": [[8.0, 4.0], [6.0, 4.0]]},
    ],
    "death": [{"kind": "operator_killed", "at": 0.9}],
    "hang": [{"kind": "operator_killed", "at": 0.9, "silent": True}],
}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("faults", FAULTS)
def test_run_with_faults_repeats_to_the_bit(tmp_path: Path, faults: str) -> None:
    chosen = scenario(*FAULTS[faults], time=2.0, seed=3, start={"known": "about", "off": 0.3})
    first = run_scenario(chosen, tmp_path / "run", operator=Forward())
    assert_repeats(tmp_path / "run", first, tmp_path / "again")


@pytest.mark.slow
def test_repeated_run_can_be_repeated(recorded: Path, tmp_path: Path) -> None:
    second = replay_run(recorded, tmp_path / "second")
    assert_repeats(tmp_path / "second", second, tmp_path / "third")


@pytest.mark.slow
def test_repeated_run_says_where_it_is_kept(recorded: Path, tmp_path: Path) -> None:
    assert replay_run(recorded).replay == ""
    again = tmp_path / "once again"
    assert replay_run(recorded, again).replay == f"farsteer scenario replay '{again}'"


@pytest.mark.slow
def test_progress_is_said_each_second(tmp_path: Path) -> None:
    said: list[tuple[float, str]] = []
    run_scenario(
        scenario(time=2.0),
        tmp_path / "run",
        progress=lambda share, text: said.append((share, text)),
    )
    assert [share for share, _ in said] == [0.5]
    said.clear()
    replay_run(tmp_path / "run", progress=lambda share, text: said.append((share, text)))
    assert [share for share, _ in said] == [0.5, 1.0]


class Impatient(Forward):
    """Ends the run from the keyboard."""

    def act(self, wire: Any, now: int) -> None:
        super().act(wire, now)
        if now == 400_000_000:
            raise KeyboardInterrupt


def test_interrupted_run_has_not_passed_and_repeats_as_far_as_it_went(tmp_path: Path) -> None:
    with pytest.raises(RunInterrupted) as interruption:
        run_scenario(scenario(), tmp_path / "run", operator=Impatient())
    first = interruption.value.outcome
    assert (first.status, first.failure) == (ExitStatus.MISSED, "interrupted")
    second = replay_run(tmp_path / "run")
    assert (second.status, second.failure) == (first.status, first.failure)
    assert second.sha256 == first.sha256


class Failing(Forward):
    """An operator with a bug."""

    def act(self, wire: Any, now: int) -> None:
        super().act(wire, now)
        if now == 400_000_000:
            raise ZeroDivisionError("a bug of the operator's")


def test_operator_that_raises_ends_the_run_and_what_was_recorded_is_kept(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        run_scenario(scenario(), tmp_path / "run", operator=Failing())
    again = replay_run(tmp_path / "run")
    assert again.figures["duration"] == pytest.approx(0.4)
    assert (again.status, again.ending) == (
        ExitStatus.MISSED,
        "the recorded run broke off here, at 0.4 s",
    )


@pytest.mark.slow
def test_rules_on_what_clients_sent_are_judged_the_same_in_a_repeated_run(tmp_path: Path) -> None:
    first = run_scenario(scenario(limits={"rules": True}), tmp_path / "run", operator=Forward())
    assert first.figures["rules"] == 0
    again = assert_repeats(tmp_path / "run", first, tmp_path / "again")
    assert again.status is first.status


def test_events_of_clients_count_again_at_their_times(recorded: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(recorded, tmp_path / "run"))
    notes = [
        Event(0, EventKind.VIOLATION, "client 1 tried to publish /odom", 0.0, 0.0),
        Event(500_000_000, EventKind.CLIENT, "client 1 left", 0.0, 0.0),
    ]
    writer = NotesWriter(run / "notes.jsonl")
    for note in notes:
        writer.write(note)
    writer.end(Ending("time is up"))
    writer.close()
    again = replay_run(run, tmp_path / "again")
    assert again.status is ExitStatus.MISSED
    assert [check.name for check in again.checks if not check.met] == ["violations"]
    shown = [(e.stamp, e.text) for e in again.events if e.kind in KINDS]
    assert shown == [(note.stamp, note.text) for note in notes]
    assert (tmp_path / "again/notes.jsonl").read_text().splitlines()[:2] == (
        run / "notes.jsonl"
    ).read_text().splitlines()[:2]


# Folders that are no runs


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 1 s."""
    folder = tmp_path_factory.mktemp("recorded") / "run"
    run_scenario(scenario(), folder, operator=Forward())
    return folder


def refused(run: Path, error: type[TeleopError]) -> str:
    with pytest.raises(error) as caught:
        replay_run(run)
    text = str(caught.value)
    assert "\n" not in text
    assert str(run) in text
    return text.replace(str(run), "RUN")


@pytest.fixture
def copy(recorded: Path, tmp_path: Path) -> Path:
    """A copy of the run, to be damaged."""
    return Path(shutil.copytree(recorded, tmp_path / "copy"))


@pytest.mark.parametrize("name", ["scenario.json", "inbox.jsonl", "notes.jsonl", "truth.tum"])
@pytest.mark.parametrize("is_folder", [False, True])
def test_file_that_is_missing_or_a_folder_is_named(copy: Path, name: str, is_folder: bool) -> None:
    (copy / name).unlink()
    if is_folder:
        (copy / name).mkdir()
    text = refused(copy, SettingError)
    assert name in text
    assert is_folder or "No such file" in text


def test_folder_that_does_not_exist_is_no_run(tmp_path: Path) -> None:
    assert "is not a run of a scenario" in refused(tmp_path / "nowhere", SettingError)


def cut(data: bytes) -> bytes:
    """Cut in the middle of a line."""
    return data[: 2 * len(data) // 3].rstrip()[:-1]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut": cut,
    "empty": lambda data: b"",
    "a picture": lambda data: b"\x89PNG\r\n\x1a\n\xff\xfe\x00",
    "a page": lambda data: b"<html><script>alert(1)</script></html>\n",
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("scenario.json", SettingError),
        ("inbox.jsonl", InboxFileError),
        ("notes.jsonl", NotesFileError),
        ("truth.tum", SettingError),
    ],
)
def test_damaged_file_is_refused_in_one_line(
    copy: Path, name: str, error: type[TeleopError], damage: str
) -> None:
    file = copy / name
    file.write_bytes(DAMAGES[damage](file.read_bytes()))
    if damage == "empty" and name in ("inbox.jsonl", "notes.jsonl"):
        return  # nobody wanted anything, or the run was killed
    assert name in refused(copy, error)


def test_scenario_of_another_format_is_refused(copy: Path) -> None:
    file = copy / "scenario.json"
    file.write_text(file.read_text().replace('"format": 1', '"format": 2'))
    assert refused(copy, SettingError).startswith(
        "RUN/scenario.json is not the scenario of a run: format"
    )


def test_run_is_not_replaced_by_its_own_repetition(copy: Path, tmp_path: Path) -> None:
    before = {file.name: file.read_bytes() for file in copy.iterdir()}
    (tmp_path / "link").symlink_to(copy)
    for folder in (copy, copy / ".." / copy.name, tmp_path / "link"):
        with pytest.raises(SettingError, match="take another folder"):
            replay_run(copy, folder)
    assert {file.name: file.read_bytes() for file in copy.iterdir()} == before


def test_operator_and_client_cannot_both_drive(tmp_path: Path) -> None:
    chosen: Scenario = scenario()
    operator: Operator = Forward()
    with pytest.raises(SettingError, match="cannot both drive"):
        run_scenario(chosen, tmp_path / "run", client="true", operator=operator)
    with pytest.raises(SettingError, match="needs a folder"):
        run_scenario(chosen, client="true")
    assert not (tmp_path / "run").exists()


REFUSED: dict[str, dict[str, Any]] = {
    "unknown goal": {"goals": [{"at": "atlantis"}]},
    "goal off the floor": {"goals": [{"at": [200.0, 4.0]}]},
    "start in a wall": {"start": {"at": [20.0, 2.8]}},
    "no such scene": {"scene": "nowhere"},
}


@pytest.mark.parametrize("why", REFUSED)
def test_scenario_that_is_refused_leaves_no_folder(tmp_path: Path, why: str) -> None:
    with pytest.raises((SimulationError, CloudError, TeleopError)):
        run_scenario(scenario(**REFUSED[why]), tmp_path / "run")
    assert not (tmp_path / "run").exists()
