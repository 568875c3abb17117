"""Clients of a robot that asks for tokens, and who may do what without one."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import pytest

from teleop.errors import SettingError
from teleop.rosbridge.auth.permissions import Role
from teleop.rosbridge.errors import ServerError
from teleop.scenario.operators.follower import Follower
from teleop.scenario.referee.outcome import EventKind, ExitStatus
from teleop.scenario.session.client_access import access_with
from teleop.scenario.session.run import run_scenario
from tests.teleop.scenario.clients.support import STRAIGHT_ON, python, run, said, scenario
from tests.teleop.support import ROOT

VIEWER, DRIVER = "a-viewer-that-nobody-guesses", "a-driver-that-nobody-guesses"
TEXT = f"""
[tokens.viewer]
role = "view"
token = "{VIEWER}"

[tokens.driver]
role = "operate"
sha256 = "{hashlib.sha256(DRIVER.encode()).hexdigest()}"
"""


@pytest.fixture(autouse=True)
def _no_token(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FARSTEER_TOKEN", raising=False)


@pytest.fixture
def tokens(tmp_path: Path) -> Path:
    file = tmp_path / "tokens.toml"
    file.touch(mode=0o600)
    file.write_text(TEXT, encoding="utf-8")
    return file


def test_without_a_file_nobody_needs_a_token() -> None:
    access = access_with(None)
    assert (access.authenticator, access.of(0)) == (None, None)


def test_a_run_makes_a_token_of_its_own_that_may_drive_and_no_more(tokens: Path) -> None:
    one, other = access_with(tokens), access_with(tokens)
    (token,) = one.tokens
    assert one.authenticator is not None
    assert other.authenticator is not None
    granted = one.authenticator.verify_token(token)
    assert granted is not None
    assert (granted.holder, granted.role) == ("client", Role.OPERATE)
    assert other.authenticator.verify_token(token) is None
    # Those of the file are valid as before.
    viewer, driver = (one.authenticator.verify_token(each) for each in (VIEWER, DRIVER))
    assert viewer is not None
    assert driver is not None
    assert (viewer.role, driver.role) == (Role.VIEW, Role.OPERATE)
    assert one.authenticator.anonymous is None


def test_a_client_can_be_tried_with_a_token_of_the_file(
    tokens: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FARSTEER_TOKEN", DRIVER)
    assert access_with(tokens).tokens == (DRIVER,)
    monkeypatch.setenv("FARSTEER_TOKEN", "a-token-of-yesterday-or-so")
    with pytest.raises(SettingError, match=r"a token that is not in .*tokens\.toml; unset it"):
        access_with(tokens)


def test_an_unusable_file_is_refused_before_anything_is_run(tmp_path: Path) -> None:
    with pytest.raises(ServerError, match="cannot read the tokens"):
        run(tmp_path / "run", "true", tokens=tmp_path / "nowhere.toml")
    assert not (tmp_path / "run").exists()


def test_operators_of_the_library_need_no_tokens(tokens: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="tokens: an operator of the library needs none"):
        run_scenario(STRAIGHT_ON, tmp_path, operator=Follower(), tokens=tokens)


@pytest.mark.long
@pytest.mark.process
def test_a_client_with_its_token_drives_and_it_is_in_no_file(tokens: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    command = f'echo "$FARSTEER_TOKEN" > {tmp_path}/token; {python("plain_websockets")}'
    outcome = run(folder, command, tokens=tokens)
    log = (folder / "client.log").read_text(encoding="utf-8")
    assert (outcome.status, outcome.ending) == (ExitStatus.PASSED, "all goals are reached"), log
    token = (tmp_path / "token").read_bytes().strip()
    assert len(token) >= 32
    assert all(token not in file.read_bytes() for file in folder.iterdir())


@pytest.mark.process
def test_the_command_takes_a_file_of_tokens(tokens: Path, tmp_path: Path) -> None:
    file, out = tmp_path / "short.toml", tmp_path / "run"
    file.write_text('format = 1\nname = "short"\n[operator]\nkind = "client"\n', encoding="utf-8")
    command = [sys.executable, "-m", "teleop", "scenario", "run", str(file), "--out", str(out)]
    client = 'test ${#FARSTEER_TOKEN} -ge 32 && echo "has a token"; exit 5'
    done = subprocess.run(
        [*command, "--client", client, "--tokens", str(tokens)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )
    assert done.returncode == ExitStatus.CLIENT_FAILED, done.stderr
    assert "the client ended with status 5: has a token" in done.stdout + done.stderr


@pytest.mark.process
def test_a_client_without_its_token_has_never_connected(tokens: Path, tmp_path: Path) -> None:
    command = f"FARSTEER_TOKEN= {python('misbehaving', 'leaves_and_stays_alive')}"
    outcome = run(tmp_path / "run", command, scenario(patience=4.0), tokens=tokens)
    assert outcome.status is ExitStatus.CLIENT_FAILED
    assert outcome.ending.startswith("no client connected within 4 s")
    assert outcome.figures["distance"] == 0.0


@pytest.mark.process
def test_a_client_that_may_only_look_cannot_drive(
    tokens: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FARSTEER_TOKEN", VIEWER)
    judged = scenario(time_limit=3.0)
    outcome = run(tmp_path / "run", python("plain_websockets"), judged, tokens=tokens)
    assert outcome.ending == "the client ended with status 1: time is up"
    assert any("role view may not" in text for text in said(outcome, EventKind.CLIENT))
    assert outcome.figures["distance"] < 0.02
