"""Files of tokens, passwords and certificates."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop.__main__ import main
from teleop.errors import SettingError
from teleop.secret_files import read_secret, trust


def test_files_of_secrets_and_certificates_are_refused_by_name(tmp_path: Path) -> None:
    assert read_secret(None, "token") is None
    assert trust(None) is None
    file = tmp_path / "file"
    with pytest.raises(SettingError, match=r"cannot read the token of .*file: No such file"):
        read_secret(file, "token")
    with pytest.raises(SettingError, match=r"cannot read the certificate .*file: No such file"):
        trust(file)
    with pytest.raises(SettingError, match=r"cannot read the certificate .*: Is a directory"):
        trust(tmp_path)
    for content in (b"", b"two\nlines\n", "ä".encode()):
        file.write_bytes(content)
        with pytest.raises(SettingError, match="file must hold a password, in one line of ASCII"):
            read_secret(file, "password")
    file.write_bytes(b"\xff")
    with pytest.raises(SettingError, match="it is no text"):
        read_secret(file, "password")
    with pytest.raises(SettingError, match=r"file holds no certificate \(PEM\)"):
        trust(file)


def test_no_command_takes_a_token_where_other_users_can_read_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "token")
    for words in (["link", "report"], ["operate", "--no-viewer"]):
        assert main([*words, "--token", file]) == 2
        assert f"cannot read the token of {file}: No such file" in capsys.readouterr().err
