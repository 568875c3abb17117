"""``farsteer serve --lan``: what is made, what the user may give instead, and where the token goes."""

from __future__ import annotations

import asyncio
import os
import pty
import re
import signal
import ssl
import stat
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from teleop.errors import SettingError
from teleop.robot.serving import lan_access as module
from teleop.robot.serving.lan_access import lan_access
from teleop.robot.serving.serve_config import ServeConfig
from teleop.ros_types import registry
from teleop.rosbridge import Client
from teleop.rosbridge.errors import ClientError
from tests.teleop.robot.served_robots import Serving, audited, tokens
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.support import ROOT, in_a_loop


def test_lan_listens_everywhere_with_a_token_and_a_certificate_that_are_kept(
    tmp_path: Path,
) -> None:
    config, access = lan_access(ServeConfig(lan=True), tmp_path / "lan")
    assert config.listening_host == "0.0.0.0"
    assert config.tokens == tmp_path / "lan/tokens.toml"
    assert (config.tls_cert, config.tls_key) == (
        tmp_path / "lan/robot.crt",
        tmp_path / "lan/robot.key",
    )
    assert len(access.link) == 43
    assert len(access.fingerprint.split(":")) == 32
    again = lan_access(ServeConfig(lan=True), tmp_path / "lan")
    assert again == (config, replace(access, link=again[1].link))
    assert again[1].link != access.link
    assert stat.S_IMODE((tmp_path / "lan").stat().st_mode) == 0o700
    assert {stat.S_IMODE(p.stat().st_mode) for p in (tmp_path / "lan").iterdir()} == {0o600}
    assert access.link not in repr((config, access))


def test_what_the_user_gives_is_used_instead(tmp_path: Path) -> None:
    crt, key = certificate(tmp_path)
    given = ServeConfig(
        host="192.0.2.9", lan=True, tokens=tokens(tmp_path), tls_cert=crt, tls_key=key
    )
    config, access = lan_access(given, tmp_path / "lan")
    assert replace(config, origins=()) == given
    assert (access.link, access.fingerprint) == ("", "")
    assert list((tmp_path / "lan").iterdir()) == []


def test_own_names_are_accepted_as_origins_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "own_names", lambda: ["robot", "robot.local"])
    config, _ = lan_access(
        ServeConfig(lan=True, port=9099, origins=("https://x.example",)), tmp_path / "lan"
    )
    own = ("https://robot:9099", "https://robot.local:9099")
    assert config.origins == ("https://x.example", *own)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_network_and_this_machine_only_is_a_contradiction(host: str) -> None:
    with pytest.raises(SettingError, match=f"--lan is for the network, --host {host} for this"):
        ServeConfig(host=host, lan=True)
    assert ServeConfig(host=host).listening_host == host
    assert ServeConfig().listening_host == "127.0.0.1"


@pytest.mark.slow
@in_a_loop
async def test_robot_of_the_lan_admits_its_token_and_nobody_else(
    serving: Serving, tmp_path: Path
) -> None:
    config, access = lan_access(ServeConfig(lan=True), tmp_path / "lan")
    assert access.certificate is not None
    trusted = ssl.create_default_context(cafile=str(access.certificate))
    async with serving(config) as server:
        assert (server.encrypted, server.tokens) == (True, True)
        url = f"wss://127.0.0.1:{server.port}"
        async with Client(url, registry=registry(), token=access.link, tls=trusted) as client:
            assert (await client.call("/teleop/estop"))["success"]
        with pytest.raises(ClientError):
            async with Client(url, token="a-guess-that-is-long-enough", tls=trusted) as client:
                await client.call("/teleop/estop")


def _run_on_a_terminal(words: list[str], environment: dict[str, str], until: str) -> str:
    """Run the command on a terminal until it has printed what a pattern matches; return all of it."""
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "teleop", *words],
        env=environment,
        cwd=ROOT,
        stdout=slave,
        stderr=slave,
        stdin=slave,
    )
    os.close(slave)
    said, end = b"", time.monotonic() + 100.0
    try:
        while not re.search(until.encode(), said) and time.monotonic() < end:
            said += os.read(master, 65536)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)
        os.close(master)
    # The last read may end amid a character.
    return said.decode(errors="ignore")


@pytest.mark.long
@pytest.mark.process
def test_token_is_printed_to_a_terminal_and_never_to_a_file(tmp_path: Path) -> None:
    audit = tmp_path / "audit.jsonl"
    words = ["serve", "--lan", "--port", "0", "--lockstep", "--audit", str(audit)]
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path), "PYTHONIOENCODING": "utf-8"}
    fingerprint = "([0-9A-F]{2}:){31}[0-9A-F]{2}"  # the last that is printed
    shown = _run_on_a_terminal(words, environment, fingerprint)
    token = (tmp_path / "farsteer/lan/token").read_text().strip()
    link = re.search(r"open +https://[\d.]+:\d+/#token=([\w-]{43}) ", shown)
    assert link is not None
    assert link[1] != token
    assert shown.count("\x1b[97;40m") > 15  # the QR code
    assert re.search(fingerprint, shown)

    log = tmp_path / "log"
    with log.open("w") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "teleop", *words, "--log-level", "debug"],
            env=environment,
            cwd=ROOT,
            stdout=file,
            stderr=subprocess.STDOUT,
        )
        end = time.monotonic() + 100.0
        port = None
        while port is None and time.monotonic() < end:
            time.sleep(0.1)
            port = re.search(r"open +https://[\d.]+:(\d+)/ ", log.read_text())
        assert port is not None, log.read_text()
        asyncio.run(_press_estop(int(port[1]), token, tmp_path / "farsteer/lan/robot.crt"))
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
    assert "\x1b" not in log.read_text()
    assert ("e-stop", "lan") in {(line["what"], line.get("holder")) for line in audited(tmp_path)}
    for text in (log.read_text(), audit.read_text()):
        assert token not in text
        assert "#token=" not in text


async def _press_estop(port: int, token: str, trusted: Path) -> None:
    tls = ssl.create_default_context(cafile=str(trusted))
    async with Client(f"wss://127.0.0.1:{port}", token=token, tls=tls) as client:
        assert (await client.call("/teleop/estop"))["success"]
