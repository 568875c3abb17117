"""The list of tokens of ``--lan``."""

from __future__ import annotations

import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from teleop.console.lan.token_book import MOST, TokenBook
from teleop.errors import SettingError
from teleop.rosbridge import Role, read_credentials

NOW = datetime(2026, 11, 24, 12, tzinfo=UTC)


@pytest.fixture
def book(tmp_path: Path) -> TokenBook:
    return TokenBook(tmp_path / "tokens.toml")


def test_token_of_the_machine_is_made_once_and_listed_by_its_digest(
    book: TokenBook, tmp_path: Path
) -> None:
    file = tmp_path / "token"
    token = book.ensure_machine(file, NOW)
    assert len(token) == 43
    assert book.ensure_machine(file, NOW) == token
    assert {stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()} == {0o600}
    assert token not in book.file.read_text()
    access = read_credentials(book.file).find(token)
    assert access is not None
    assert (access.holder, access.role) == ("lan", Role.ADMIN)
    assert read_credentials(book.file).anonymous is None
    file.unlink()
    anew = read_credentials(book.file) if book.ensure_machine(file, NOW) else None
    assert anew is not None
    assert anew.find(token) is None


@pytest.mark.parametrize("content", [b"", b"short", b"two\nlines of a token", b"\xff" * 40])
def test_file_without_a_token_is_rejected(book: TokenBook, content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.touch(mode=0o600)
    file.write_bytes(content)
    with pytest.raises(SettingError, match="holds no token: delete it"):
        book.ensure_machine(file, NOW)


def test_each_device_has_a_token_that_ends_and_can_be_revoked_alone(book: TokenBook) -> None:
    book.ensure_machine(book.file.with_name("token"), NOW)
    tokens = [
        book.add(name, "operate", NOW, NOW + timedelta(hours=hours))[1]
        for name, hours in (('Zoë "Z" O\'Neil', 1), ("anna", 2), ("Anna", 3))
    ]
    assert [one.name for one in book.tokens(NOW)] == ["lan", 'Zoë "Z" O\'Neil', "anna", "Anna 2"]
    later = read_credentials(book.file).valid_at((NOW + timedelta(hours=1)).timestamp())
    assert [later.find(token) is not None for token in tokens] == [False, True, True]
    book.remove("anna", NOW)
    left = read_credentials(book.file)
    assert [left.find(token) is not None for token in tokens] == [True, False, True]
    assert [one.name for one in book.tokens(NOW + timedelta(hours=2))] == ["lan", "Anna 2"]


def test_errors_say_what_would_help(book: TokenBook) -> None:
    book.ensure_machine(book.file.with_name("token"), NOW)
    book.add("Anna", "view", NOW, None)
    with pytest.raises(SettingError, match="no token 'Ana'; there are: Anna"):
        book.remove("Ana", NOW)
    with pytest.raises(SettingError, match=r"own token: delete .*token, and start the robot again"):
        book.remove("lan", NOW)
    for _ in range(MOST - 2):
        book.add("more", "view", NOW, NOW + timedelta(hours=1))
    with pytest.raises(SettingError, match="64 tokens; revoke one"):
        book.add("one too many", "view", NOW, None)
    book.add("one after their end", "view", NOW + timedelta(hours=1), None)
    book.file.write_text("tokens = 7")
    with pytest.raises(SettingError, match="is no list of tokens: delete it"):
        book.tokens(NOW)


def test_file_of_a_person_is_not_taken_for_the_list(book: TokenBook) -> None:
    assert not book.kept
    book.add("Anna", "view", NOW, None)
    assert book.kept
    book.file.write_text("# My own tokens")
    assert not book.kept
