"""The command ``farsteer console``."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import urllib.request

import pytest

from teleop.__main__ import main
from teleop.console import console_server
from teleop.console.page_files import MISSING
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
