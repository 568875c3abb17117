"""``python -m teleop.rosbridge`` as a program."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
from asyncio.subprocess import PIPE
from pathlib import Path

import pytest

from teleop.rosbridge import Client
from tests.teleop.rosbridge.server.test_server import in_a_loop, serving
from tests.teleop.rosbridge.support import ROOT


@in_a_loop
async def test_it_serves_clients_with_their_own_types_until_told_to_stop(tmp_path: Path) -> None:
    package = tmp_path / "lamp_msgs"
    package.mkdir()
    (package / "Lamp.msg").write_text("bool on\n")
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "teleop.rosbridge", "--port", "0", "--ros1"),
        *("--messages", str(package)),
        cwd=ROOT,
        stdout=PIPE,
    )
    assert process.stdout is not None
    found = re.search(r"ws://\S+:\d+", (await process.stdout.readline()).decode())
    assert found is not None
    heard: asyncio.Queue[object] = asyncio.Queue()
    async with Client(found[0]) as client:
        await client.subscribe("/lamp", "lamp_msgs/Lamp", heard.put_nowait)
        await client.advertise("/lamp", "lamp_msgs/Lamp")
        await client.publish("/lamp", {"on": True})
        assert await heard.get() == {"on": True}
        assert (await client.call("/rosapi/get_ros_version"))["version"] == 1
    process.send_signal(signal.SIGINT)
    assert await process.wait() == 0


@pytest.mark.parametrize(("host", "warned"), [("127.0.0.1", False), ("0.0.0.0", True)])
@in_a_loop
async def test_whoever_has_it_listen_to_others_is_warned(host: str, warned: bool) -> None:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "teleop.rosbridge", "--port", "0", "--host", host),
        cwd=ROOT,
        stdout=PIPE,
    )
    assert process.stdout is not None
    await process.stdout.readline()
    process.send_signal(signal.SIGINT)
    said, _ = await process.communicate()
    assert (b"warning: any program that can reach this address can connect" in said) == warned


def run(*arguments: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", "teleop.rosbridge", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    return done.returncode, done.stderr


@in_a_loop
async def test_what_is_wrong_is_told_in_a_line() -> None:
    async with serving() as server:
        status, said = await asyncio.to_thread(run, "--port", str(server.port))
        assert (status, "is in use" in said, said.count("\n")) == (2, True, 1)
    status, said = await asyncio.to_thread(run, "--messages", "/nowhere")
    assert (status, said) == (2, "/nowhere is not a folder\n")
