from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from teleop.rosbridge.auth.credentials import read_credentials
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Role, RoleRules
from teleop.rosbridge.errors import ServerError

TOKEN = "a-token-that-nobody-guesses"


def digest(token: str) -> bytes:
    return hashlib.sha256(token.encode()).digest()


def written(folder: Path, text: str, mode: int = 0o600) -> Path:
    path = folder / "tokens.toml"
    path.write_text(text)
    path.chmod(mode)
    return path


def test_tokens_are_found_by_plain_text_or_digest(tmp_path: Path) -> None:
    other = "another-token-of-some-length"
    ring = read_credentials(
        written(
            tmp_path,
            f'[tokens.unity]\nrole = "operate"\nsha256 = "{digest(TOKEN).hex().upper()}"\n'
            f'[tokens."a browser"]\nrole = "view"\ntoken = "{other}"\n',
        )
    )
    found, second = ring.find(TOKEN), ring.find(other)
    assert found is not None
    assert (found.holder, found.role) == ("unity", Role.OPERATE)
    assert second is not None
    assert (second.holder, second.role) == ("a browser", Role.VIEW)
    for wrong in ("", TOKEN[:-1], TOKEN + "x", digest(TOKEN).hex(), "é", "\ud800"):
        assert ring.find(wrong) is None
    assert ring.anonymous is None
    assert TOKEN not in repr(ring)
    assert other not in repr(ring)
    secret = f'[tokens.lab]\nrole = "view"\nsecret = "{TOKEN}"'
    signing = read_credentials(written(tmp_path, secret))
    assert (signing.find(TOKEN), signing.find("")) == (None, None), "a secret is no token"
    assert TOKEN not in repr(signing)


def test_file_can_change_the_rules_of_roles(tmp_path: Path) -> None:
    ring = read_credentials(
        written(
            tmp_path,
            'anonymous = "operate"\n[roles.operate]\npublish = ["/joy", "/lamp/*"]\nprovide = []\n',
        )
    )
    assert ring.anonymous is not None
    rules = ring.anonymous.rules
    assert rules.publish == ("/joy", "/lamp/*")
    assert rules.call == DEFAULT_RULES[Role.OPERATE].call


def test_host_can_set_default_rules(tmp_path: Path) -> None:
    rules = {**DEFAULT_RULES, Role.VIEW: RoleRules(call=("/stop",))}
    ring = read_credentials(written(tmp_path, 'anonymous = "view"'), rules)
    assert ring.anonymous is not None
    assert ring.anonymous.rules == RoleRules(call=("/stop",))


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o620])
def test_token_file_accessible_to_others_is_rejected(tmp_path: Path, mode: int) -> None:
    path = written(tmp_path, f'[tokens.a]\nrole = "view"\ntoken = "{TOKEN}"', mode)
    with pytest.raises(ServerError, match=r"accessible to others: chmod 600 tokens\.toml"):
        read_credentials(path)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "it has no tokens"),
        (
            f'[tokens.a]\nrole = "king"\ntoken = "{TOKEN}"',
            r"tokens\.a\.role must be one of view, operate, admin",
        ),
        (f'[tokens.a]\ntoken = "{TOKEN}"', r"tokens\.a\.role must be one of"),
        ('[tokens.a]\nrole = "view"', r"tokens\.a must have one of token, sha256 and secret"),
        (f'[tokens.a]\nrole = "view"\ntoken = "{TOKEN}"\nsecret = "{TOKEN}"', "must have one of"),
        ('[tokens.a]\nrole = "view"\ntoken = "short"', "16 or more characters"),
        ('[tokens.a]\nrole = "view"\ntoken = 1234567890123456', "must be a string"),
        (f'[tokens.a]\nrole = "view"\nsha256 = "{TOKEN}"', "64 hexadecimal digits"),
        (f'[tokens.a]\nrole = "view"\ntokn = "{TOKEN}"', "has no 'tokn'"),
        (
            f'[tokens.a]\nrole = "view"\ntoken = "{TOKEN}"\nuntil = 2026-11-25T18:00:00',
            r"tokens\.a\.until must be a time with its zone",
        ),
        (f'[tokens.a]\nrole = "view"\ntoken = "{TOKEN}"\nlink = 1', "link must be true or false"),
        (f'[token.a]\nrole = "view"\ntoken = "{TOKEN}"', "the file has no 'token'"),
        ("tokens = 3", "tokens must be tables"),
        ("[tokens]\na = 3", "tokens must be tables"),
        ('anonymous = "all"', "anonymous must be one of"),
        ('anonymous = "view"\n[roles.view]\npublish = "/joy"', "must be a list of patterns"),
        ('anonymous = "view"\n[roles.view]\npublish = ["joy"]', "matches no name"),
        ('anonymous = "view"\n[roles.view]\nread = []', "has no 'read'"),
        ('anonymous = "view"\n[roles.king]\npublish = []', "a table of roles must be one of"),
        (
            f'[tokens.a]\nrole = "view"\ntoken = "{TOKEN}"\n'
            f'[tokens.b]\nrole = "admin"\nsha256 = "{digest(TOKEN).hex()}"',
            "two names have the same token",
        ),
        (f'token = "{TOKEN}', "is not valid TOML"),
        (f"{TOKEN} = = {TOKEN}", "is not valid TOML"),
    ],
)
def test_token_file_errors_are_one_line_without_secrets(
    tmp_path: Path, text: str, why: str
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ServerError, match=why) as raised:
        read_credentials(path)
    said = str(raised.value)
    assert said.startswith(str(path))
    assert "\n" not in said
    assert TOKEN not in said


def test_missing_token_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ServerError, match=r"cannot read the tokens in .*: No such file"):
        read_credentials(tmp_path / "none")
    with pytest.raises(ServerError, match=r"cannot read the tokens in .*: Is a directory"):
        read_credentials(tmp_path)
