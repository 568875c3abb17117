"""Clients as others publish them drive to a goal, by real sockets, in a process of their own."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import pytest

from teleop.scenario.referee.outcome import ExitStatus
from teleop.scenario.session.run import replay_run
from tests.teleop.rosbridge.foreign_clients.test_javascript_clients import installed, node
from tests.teleop.scenario.clients.support import PROGRAMS, python, run

pytestmark = [pytest.mark.process, pytest.mark.slow]


@pytest.fixture(scope="module")
def javascript(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a script beside both versions of roslib."""
    packages = ("roslib@2.1.0", "ws@8", "roslib-1@npm:roslib@1.4.1")
    folder = installed(tmp_path_factory.mktemp("roslib"), *packages)
    return Path(shutil.copy(PROGRAMS / "with_roslib.mjs", folder))


def passes(folder: Path, command: str) -> None:
    """Run a client, and find that it has reached its goal and that its run can be repeated to the bit."""
    outcome = run(folder, command)
    log = (folder / "client.log").read_text(encoding="utf-8")
    assert (outcome.status, outcome.ending) == (ExitStatus.PASSED, "all goals are reached"), log
    repeated = replay_run(folder)
    assert (repeated.status, repeated.sha256) == (outcome.status, outcome.sha256)


@pytest.mark.long
@node
@pytest.mark.parametrize(("package", "by"), [("roslib", "joy"), ("roslib-1", "cmd_vel")])
def test_roslib_drives_to_a_goal(javascript: Path, tmp_path: Path, package: str, by: str) -> None:
    passes(tmp_path, shlex.join(["node", str(javascript), package, by]))


@pytest.mark.long
def test_the_console_page_in_a_browser_drives_to_a_goal(tmp_path: Path) -> None:
    passes(tmp_path, python("browser_page"))
