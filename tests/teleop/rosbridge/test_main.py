"""``python -m teleop.rosbridge`` as a program."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
from asyncio.subprocess import PIPE, Process
from pathlib import Path

import pytest

from teleop.rosbridge import Client
from tests.teleop.rosbridge.server.test_server import in_a_loop, serving
from tests.teleop.rosbridge.support import ROOT

pytestmark = pytest.mark.process


async def started(*options: str) -> Process:
    """Start the program on a free port."""
    return await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "teleop.rosbridge", "--port", "0", *options),
        cwd=ROOT,
        stdout=PIPE,
    )


@in_a_loop
async def test_program_serves_custom_types_until_interrupted(tmp_path: Path) -> None:
    package = tmp_path / "lamp_msgs"
    package.mkdir()
    (package / "Lamp.msg").write_text("bool on\n")
    process = await started("--ros1", "--messages", str(package))
    assert process.stdout is not None
    found = re.search(r"ws://\S+:\d+", (await process.stdout.readline()).decode())
    assert found is not None
    received: asyncio.Queue[object] = asyncio.Queue()
    async with Client(found[0]) as client:
        await client.subscribe("/lamp", "lamp_msgs/Lamp", received.put_nowait)
        await client.advertise("/lamp", "lamp_msgs/Lamp")
        await client.publish("/lamp", {"on": True})
        assert await received.get() == {"on": True}
        assert (await client.call("/rosapi/get_ros_version"))["version"] == 1
    process.send_signal(signal.SIGINT)
    said, _ = await process.communicate()
    assert (process.returncode, b"warning" in said) == (0, False)


@in_a_loop
async def test_listening_on_the_network_prints_a_warning() -> None:
    process = await started("--host", "0.0.0.0")
    assert process.stdout is not None
    await process.stdout.readline()
    process.send_signal(signal.SIGINT)
    said, _ = await process.communicate()
    assert b"warning: any program that can reach this address can connect" in said


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
async def test_startup_errors_are_one_line() -> None:
    async with serving() as server:
        status, said = await asyncio.to_thread(run, "--port", str(server.port))
        assert (status, "is in use" in said, said.count("\n")) == (2, True, 1)
    for wrong, expected in (
        (("--messages", "/nowhere"), "/nowhere is not a folder\n"),
        (("--port", "90900"), "port must be 0 to 65535, got 90900\n"),
    ):
        assert await asyncio.to_thread(run, *wrong) == (2, expected)
