"""Files that only their owner can read."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from teleop.console.lan.state_files import (
    private_folder,
    read_private,
    state_folder,
    write_private,
)
from teleop.errors import SettingError


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_state_is_kept_where_the_user_wants_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_folder() == tmp_path / "farsteer"
    monkeypatch.setenv("HOME", str(tmp_path))
    for ignored in ("", "relative/path"):
        monkeypatch.setenv("XDG_STATE_HOME", ignored)
        assert state_folder() == tmp_path / ".local/state/farsteer"


def test_folders_and_files_are_the_owners_only(tmp_path: Path) -> None:
    folder = tmp_path / "state/lan"
    private_folder(folder)
    private_folder(folder)
    assert mode(folder) == 0o700
    write_private(folder / "x", b"one")
    assert (mode(folder / "x"), read_private(folder / "x")) == (0o600, b"one")
    write_private(folder / "x", b"two")
    assert read_private(folder / "x") == b"two"
    write_private(folder / "x", b"three", replace=False)
    assert read_private(folder / "x") == b"two"
    assert [path.name for path in folder.iterdir()] == ["x"]
    assert read_private(folder / "y") is None


def test_what_others_can_read_is_rejected_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "x"
    file.write_text("secret")
    file.chmod(0o640)
    with pytest.raises(SettingError, match="accessible to others: chmod 600"):
        read_private(file)
    tmp_path.chmod(0o755)
    with pytest.raises(SettingError, match="chmod 700"):
        private_folder(tmp_path)
    with pytest.raises(SettingError, match="cannot make the folder"):
        private_folder(file / "below")
    with pytest.raises(SettingError, match="cannot write"):
        write_private(tmp_path / "none/x", b"")
    with pytest.raises(SettingError, match="cannot read"):
        read_private(file / "below")
