"""The processes of a robot: who comes first where processors are few, and who gets Ctrl-C."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from teleop.robot.real_time.camera_process import _NICENESS as CAMERA
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.estimator_process import _NICENESS as ESTIMATOR
from teleop.robot.real_time.gateway_process import _NICENESS as GATEWAY

MODULE = "teleop.robot.real_time.estimator_process"


def test_gateway_comes_before_estimator_and_that_before_camera() -> None:
    assert 0 < GATEWAY < ESTIMATOR < CAMERA


@pytest.mark.process
def test_child_is_weighed_against_its_parent_by_niceness_and_gets_no_ctrl_c() -> None:
    child = ChildProcess(MODULE, 1_000_000)
    try:
        assert os.getsid(child.pid) == os.getsid(0), "or autogroups make its niceness void"
        assert os.getpgid(child.pid) == child.pid != os.getpgrp()
        assert _autogroup(child.pid) == _autogroup(os.getpid())
    finally:
        child.kill()


BUSY = """
import sys, time
from pathlib import Path
from teleop.robot.real_time.channel import inherited_channel

channel, taken = inherited_channel(int(sys.argv[1]), 1_000_000), []
time.sleep(0.5)
while not taken or taken[-1] != b"end":
    taken += channel.wait()
Path({file!r}).write_text(str(len(taken)))
"""
"""A process that is behind by what waits for it."""


@pytest.mark.process
def test_process_that_is_behind_takes_all_that_waits_for_it_before_it_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "taken"
    (tmp_path / "busy_child.py").write_text(BUSY.format(file=str(file)))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    child = ChildProcess("busy_child", 100_000_000)
    for _ in range(40):
        child.channel.send(bytes(100_000))  # more than the kernel keeps
    assert child.channel.waiting > 0
    assert child.end(b"end", timeout=30.0)
    assert file.read_text() == "41"


@pytest.mark.process
def test_process_that_does_not_end_is_killed_in_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "deaf_child.py").write_text("import time\ntime.sleep(60.0)\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    child = ChildProcess("deaf_child", 1_000_000)
    assert not child.end(b"end", timeout=0.5)
    with pytest.raises(ProcessLookupError):
        os.kill(child.pid, 0)


def _autogroup(pid: int) -> str:
    """Return the scheduler's group of a process; empty where there are none."""
    try:
        text = Path(f"/proc/{pid}/autogroup").read_text()
    except OSError:
        return ""
    found = re.match(r"/autogroup-\d+", text)
    return found[0] if found else ""
