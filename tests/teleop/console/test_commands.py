"""The commands ``farsteer console`` and ``farsteer tokens``."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from datetime import UTC, datetime
from pathlib import Path

import pytest

from teleop.__main__ import main
from teleop.console import console_server
from teleop.console.lan.token_book import TokenBook
from teleop.console.page_files import MISSING
from teleop.robot.serving.lan_access import lan_access
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.support import ROOT


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["http://robot:9090"], "'http://robot:9090' is not a robot's address: ws://HOST:PORT"),
        (["robot"], "'robot' is not a robot's address: ws://HOST:PORT"),
        (["ws://robot:9090", "--port", "70000"], "port must be 0 to 65535, got 70000"),
    ],
)
def test_bad_input_is_one_line(
    words: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["console", *words]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert text in line


def test_page_that_is_not_built_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console_server, "offer_page", lambda pages, robot: False)
    assert main(["console", "ws://robot:9090", "--port", "0"]) == 2
    assert capsys.readouterr().err.strip() == f"farsteer: {MISSING}"


def test_tokens_are_listed_and_revoked_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert main(["tokens"]) == 2
    assert "farsteer serve --lan makes it" in capsys.readouterr().err
    _, access = lan_access(ServeConfig(lan=True))
    assert access.token_file is not None
    book = TokenBook(access.token_file.with_name("tokens.toml"))
    now = datetime(2026, 11, 24, tzinfo=UTC)
    book.add("Anna", "operate", now, datetime(2126, 12, 1, 18, tzinfo=UTC))
    assert main(["tokens"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in listed] == ["lan", "link", "Anna"]
    assert listed[2].endswith("operate  device   until 2126-12-01 18:00 UTC")
    assert main(["tokens", "--revoke", "Anna"]) == 0
    assert "Anna" not in capsys.readouterr().out
    assert main(["tokens", "--revoke", "Anna"]) == 2
    assert "no token 'Anna'; there are: link of the terminal" in capsys.readouterr().err


@pytest.mark.process
def test_page_is_served_for_another_robot_until_ctrl_c() -> None:
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "BROWSER")}
    process = subprocess.Popen(
        [sys.executable, "-m", "teleop", "console", "ws://192.0.2.7:9090", "--port", "0", "--open"],
        env=environment,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        said = process.stdout.readline()
        address = re.search(r"open +(http://127\.0\.0\.1:\d+/) .*ws://192\.0\.2\.7:9090$", said)
        assert address is not None, said
        with urllib.request.urlopen(f"{address[1]}console/config.json", timeout=20) as answer:
            assert json.load(answer)["robot"] == "ws://192.0.2.7:9090"
        assert process.stdout.readline() == "Ctrl-C ends.\n"
        assert "no browser can be opened" in process.stdout.readline()
    finally:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out.strip(), err) == (0, "ended", "")
