"""The token of operators in the network."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from teleop.console.lan.access_token import ensure_token
from teleop.errors import SettingError
from teleop.rosbridge import Role, read_credentials


def test_token_is_made_once_and_listed_by_its_digest(tmp_path: Path) -> None:
    file, listed = tmp_path / "token", tmp_path / "tokens.toml"
    token = ensure_token(file, listed)
    assert len(token) == 43
    assert ensure_token(file, listed) == token
    assert ensure_token(tmp_path / "other", tmp_path / "x.toml") != token
    for path in (file, listed):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert token not in listed.read_text()
    access = read_credentials(listed).find(token)
    assert access is not None
    assert (access.holder, access.role) == ("lan", Role.OPERATE)
    assert read_credentials(listed).anonymous is None


def test_deleted_token_is_made_anew_and_the_old_one_is_not_accepted(tmp_path: Path) -> None:
    file, listed = tmp_path / "token", tmp_path / "tokens.toml"
    old = ensure_token(file, listed)
    file.unlink()
    new = ensure_token(file, listed)
    credentials = read_credentials(listed)
    assert credentials.find(new) is not None
    assert credentials.find(old) is None


@pytest.mark.parametrize("content", [b"", b"short", b"two\nlines of a token", b"\xff" * 40])
def test_file_without_a_token_is_rejected(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.touch(mode=0o600)
    file.write_bytes(content)
    with pytest.raises(SettingError, match="holds no token: delete it"):
        ensure_token(file, tmp_path / "tokens.toml")
