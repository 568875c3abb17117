"""Clients as they are published, and roslibpy's own tests, against our server in a process.

They are fetched when the tests run: roslibpy's source distribution by pip, roslib and ros3d by npm.
"""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from tests.teleop.rosbridge.foreign_clients.roslibpy_suite import Runs, conformance_server

pytestmark = pytest.mark.process

JAVASCRIPT = Path(__file__).parent / "javascript"
ROSLIB = ("roslib@2.1.0", "ws@8")
ROS3D = ("ros3d@1.1.0",)  # with the roslib 1.4 that it requires

TWENTY = (
    *("getTopics", "getNodes", "getNodeDetails", "getServices", "getTopicType", "getServiceType"),
    *("getTopicsAndRawTypes", "getMessageDetails", "getActionServers", "getParams"),
    *("setParam", "getParam", "deleteParam", "publishAndSubscribe", "publishAndSubscribePng"),
    *("publishAndSubscribeCbor", "publishAndSubscribeCborRaw", "serviceLoopBack"),
    *("failingService", "fragments"),
)
"""Checks that pass with rosbridge_suite, and fragments, which do not."""

FURTHER = (
    *("twoTopicObjects", "topicsComeAndGo", "actionlibGoal", "actionLoopBack", "actionCancel"),
    *("tfByActionlib", "tfByAction", "statusLevel"),
)

node = pytest.mark.skipif(shutil.which("npm") is None, reason="Node is not installed")
roslibpy = pytest.mark.skipif(
    importlib.util.find_spec("roslibpy") is None, reason="roslibpy is not installed"
)


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with conformance_server() as address:
        yield address


# roslibpy


@pytest.mark.long
@pytest.mark.slow
@roslibpy
@pytest.mark.parametrize(
    ("transport", "first", "second"),
    # The suite skips two tests of the asyncio transport in the other process.
    [("twisted", (25, 0, 0), (29, 0, 2)), ("asyncio", (25, 0, 0), (31, 0, 0))],
)
def test_roslibpys_own_tests_pass(
    roslibpy_runs: Future[Runs],
    transport: str,
    first: tuple[int, int, int],
    second: tuple[int, int, int],
) -> None:
    one, two = roslibpy_runs.result()[transport]
    assert (one.outcome(), two.outcome()) == (first, second)


# JavaScript


def installed(folder: Path, *packages: str) -> Path:
    """Install packages with npm in a folder."""
    (folder / "package.json").write_text("{}", encoding="utf-8")
    command = ["npm", "install", "--no-save", "--no-package-lock", "--no-audit", "--no-fund"]
    done = subprocess.run(
        [*command, "--silent", "--ignore-scripts", *packages],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )
    assert done.returncode == 0, done.stderr
    return folder


def run(script: Path, *arguments: str) -> str:
    """Run a script with Node in the folder of its packages."""
    done = subprocess.run(
        ["node", str(script), *arguments],
        cwd=script.parent,
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def roslib(url: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str | None]:
    """Return the error of each check of roslib, None for those that pass."""
    folder = installed(tmp_path_factory.mktemp("roslib"), *ROSLIB)
    script = Path(shutil.copy(JAVASCRIPT / "roslib_checks.mjs", folder))
    return dict(json.loads(line) for line in run(script, url).splitlines())


@pytest.mark.slow
@node
@pytest.mark.parametrize("check", [*TWENTY, *FURTHER])
def test_roslib_checks_pass(roslib: dict[str, str | None], check: str) -> None:
    assert roslib[check] is None


@node
def test_all_roslib_checks_are_listed(roslib: dict[str, str | None]) -> None:
    assert set(roslib) == {*TWENTY, *FURTHER}
    assert len(TWENTY) == 20


@pytest.mark.slow
@node
def test_ros3d_shows_clouds_and_scans_at_their_positions(url: str, tmp_path: Path) -> None:
    folder = installed(tmp_path, *ROS3D)
    script = Path(shutil.copy(JAVASCRIPT / "ros3d_checks.cjs", folder))
    seen = json.loads(run(script, url).splitlines()[-1])
    assert seen["cloud"] == [1.5, -2, 0.25, 3, 4, -0.5, 0, 0, 1]
    assert seen["scan"] == pytest.approx([2, 0, 0, 0, 3, 0])
