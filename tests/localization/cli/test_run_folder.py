"""Folders that commands write to: checked beforehand, never shared, nothing replaced unasked."""

from __future__ import annotations

import errno
import time
from pathlib import Path

import pytest

from localization.cli.run_folder import (
    OutputError,
    check_file,
    check_folder,
    remove_earlier,
    run_folder,
    writing_to,
)

FILES = ("a.txt", "b.txt")


def test_runs_that_begin_in_the_same_second_have_folders_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(time, "strftime", lambda form: "2026-01-31T12-00-00")
    folders = [run_folder(None) for _ in range(3)]
    assert [f.name for f in folders] == [
        f"2026-01-31T12-00-00{number}" for number in ("", "-2", "-3")
    ]
    assert all(folder.is_dir() for folder in folders)


def test_check_leaves_no_trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    check_folder(None, FILES)
    check_folder(Path("x/y"), FILES)
    check_file(Path("z/map.ply"))
    assert not list(tmp_path.iterdir())


def test_folder_with_an_earlier_run_is_refused_unless_it_may_be_replaced(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    check_folder(tmp_path, FILES)
    (tmp_path / "b.txt").write_text("earlier")
    with pytest.raises(OutputError, match=r"already holds b\.txt.*--overwrite"):
        check_folder(tmp_path, FILES)
    check_folder(tmp_path, FILES, overwrite=True)
    remove_earlier(tmp_path, FILES)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_file_in_place_of_a_folder_is_named(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(OutputError, match=r"--out .*file is a file: give a folder"):
        check_folder(file, FILES)
    with pytest.raises(OutputError, match=r"--out .*\(Not a directory\)"):
        check_folder(file / "below", FILES)
    with pytest.raises(OutputError, match="already exists"):
        check_file(file)
    check_file(file, overwrite=True)
    with pytest.raises(OutputError, match="is a folder: give a file"):
        check_file(tmp_path)


def test_folder_that_cannot_be_written_is_named() -> None:
    with pytest.raises(OutputError, match=r"--out /proc/x .*give another folder"):
        check_folder(Path("/proc/x"), FILES)


def test_full_disk_is_reported_by_the_folder_and_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "log.mcap").write_text("readings")
    (tmp_path / "empty").write_text("")
    with (
        pytest.raises(OutputError, match=r"No space left on device; kept there: log\.mcap$"),
        writing_to(tmp_path),
    ):
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(FileNotFoundError), writing_to(tmp_path):
        raise FileNotFoundError(errno.ENOENT, "No such file or directory", "map.ply")
