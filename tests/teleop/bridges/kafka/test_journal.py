"""The journal: what it says survives a kill, a torn line and its own shortening."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from teleop.bridges.kafka import journal as journals
from teleop.bridges.kafka.journal import Journal, JournalError
from teleop.bridges.kafka.journal_state import REMEMBERED, JournalState, Mark
from teleop.bridges.kafka.results import DONE, Result
from teleop.errors import SettingError
from teleop.step_commands.turtle_control import StepSizes
from tests.teleop.support import in_a_loop

LOG = "turtle_control/0"
SIZES = StepSizes(distance=0.5, angle=15)
MARK = Mark(5, "e")


async def answer(journal: Journal, offset: int) -> None:
    await journal.begin(offset, Mark(1000 + offset, f"{offset:x}"))
    result = Result(0, offset, 0, DONE)
    await journal.end(result, Mark(1000 + offset, "d"), offset + 1, SIZES, inverted=True)


def state_of(path: Path) -> JournalState:
    with Journal(path, LOG) as journal:
        return journal.state


def only_file(folder: Path) -> Path:
    (only,) = folder.iterdir()
    return only


@in_a_loop
async def test_what_was_noted_is_there_after_a_restart(tmp_path: Path) -> None:
    path = tmp_path / "new" / "journal.jsonl"
    with Journal(path, LOG) as journal:
        assert journal.state == JournalState()
        await journal.open_log(log=0, next=7, end=7, mark=None)
        await answer(journal, 7)
        await answer(journal, 8)
        await journal.publish(1, 40)
        await journal.begin(9, MARK)
        written = journal.state
    assert state_of(path) == written
    assert (written.next, written.end, written.mark) == (9, 9, Mark(1008, "d"))
    assert written.begun == 9
    assert [result.offset for result in written.waiting] == [8]
    assert written.published == 40
    assert written.sizes(StepSizes(speed=0.3)) == StepSizes(0.5, 15, 0.3, right_turns_left=True)


@in_a_loop
async def test_a_line_torn_anywhere_counts_for_nothing_and_the_next_one_is_whole(
    tmp_path: Path,
) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal(path, LOG) as journal:
        await journal.open_log(log=0, next=0, end=0, mark=None)
        before = path.read_bytes()
        await journal.begin(0, MARK)
    line = path.read_bytes()[len(before) :]
    for length in range(len(line)):
        path.write_bytes(before + line[:length])
        assert state_of(path).begun is None
        with Journal(path, LOG) as journal:
            await journal.begin(3, MARK)
        assert state_of(path).begun == 3
    path.write_bytes(before + line)
    assert state_of(path).begun == 0


@in_a_loop
async def test_a_journal_that_has_grown_is_written_anew_and_says_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journals, "COMPACTED", 4000)
    path = tmp_path / "journal.jsonl"
    with Journal(path, LOG) as journal:
        await journal.open_log(log=2, next=0, end=0, mark=None)
        for offset in range(40):
            await answer(journal, offset)
            await journal.publish(1, offset + 1)
            assert path.stat().st_size < 5000
        await journal.begin(40, MARK)
        written = journal.state
        with pytest.raises(SettingError, match="another bridge uses the journal"):
            Journal(path, LOG)
    assert state_of(path) == written
    assert only_file(tmp_path) == path


@in_a_loop
async def test_what_was_driven_in_the_logs_before_is_known_also_after_a_shortening(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journals, "COMPACTED", 100)
    path = tmp_path / "journal.jsonl"
    with Journal(path, LOG) as journal:
        for log, offsets in enumerate((range(REMEMBERED + 5), range(REMEMBERED, REMEMBERED + 7))):
            await journal.open_log(log=log, next=0, end=0, mark=None)
            for offset in offsets if log else [*offsets][::200]:
                await journal.begin(offset, Mark(0, f"{offset:x}"))
        await journal.open_log(log=1, next=0, end=0, mark=None)
    state = state_of(path)
    assert state.driven_before == tuple(f"{n:x}" for n in range(0, REMEMBERED + 5, 200))
    assert state.driven == tuple(f"{REMEMBERED + n:x}" for n in range(7))


def test_a_bounded_number_of_driven_commands_is_remembered() -> None:
    state = JournalState()
    for log in range(3):
        state = state.after({"is": "opened", "log": log, "next": 0, "end": 0, "mark": None})
        for n in range(REMEMBERED - 1):
            mark = {"timestamp": 0, "digest": f"{log}/{n}"}
            state = state.after({"is": "begun", "offset": n, "mark": mark})
    assert len(state.driven) == REMEMBERED - 1
    assert (state.driven_before[0], state.driven_before[1]) == (f"0/{REMEMBERED - 2}", "1/0")
    assert len(state.driven_before) == REMEMBERED


def test_a_shortening_that_was_cut_off_leaves_the_journal_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    assert state_of(path) == JournalState()
    path.with_name("journal.jsonl.new").write_text('{"journ')
    assert state_of(path) == JournalState()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('{"journal": "other/0"}\n', r"is of other/0, not of turtle_control/0.*--journal"),
        ("rows, of a table\n", r"journal\.jsonl:1 is no entry of a journal.*--journal"),
        (f'{{"journal": "{LOG}"}}\n{{"is": "dancing"}}\n', r"journal\.jsonl:2 is no entry"),
        (f'{{"journal": "{LOG}"}}\n{{"is": "begun"}}\n', r"journal\.jsonl:2 is no entry"),
    ],
    ids=["of another log", "no JSON", "unknown entry", "entry without its fields"],
)
def test_a_file_that_is_no_journal_of_this_log_is_refused_and_left_alone(
    tmp_path: Path, content: str, message: str
) -> None:
    path = tmp_path / "journal.jsonl"
    path.write_text(content)
    with pytest.raises(SettingError, match=message):
        Journal(path, LOG)
    assert path.read_text() == content


@in_a_loop
async def test_a_full_disk_is_an_error_before_anything_is_driven(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal(path, LOG) as journal:
        await journal.open_log(log=0, next=0, end=0, mark=None)
        write = os.write
        monkeypatch.setattr(os, "write", lambda file, line: write(file, line[:10]))
        with pytest.raises(JournalError, match="the disk is full"):
            await journal.begin(0, MARK)
        assert journal.state.begun is None
    monkeypatch.undo()
    assert state_of(path).begun is None, "the torn line is cut off"
