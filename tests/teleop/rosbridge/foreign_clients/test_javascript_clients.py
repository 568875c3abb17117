"""Clients as they are published, and roslibpy's own tests, against our server in a process.

They are fetched when the tests run: roslibpy's source distribution by pip, roslib and ros3d by npm.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.teleop.rosbridge.support import ROOT

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


@contextmanager
def conformance_server() -> Iterator[str]:
    """Run ``python -m teleop.rosbridge --conformance``; yield its address."""
    command = [sys.executable, "-m", "teleop.rosbridge", "--conformance", "--port", "0"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"ws://127\.0\.0\.1:\d+", process.stdout.readline())
            assert found is not None
            yield found[0]
        finally:
            process.terminate()
            assert process.wait(20) == 0


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with conformance_server() as address:
        yield address


# roslibpy


@dataclass
class Suite:
    """A run of some of roslibpy's own tests."""

    process: subprocess.Popen[str]
    report: Path

    def outcome(self) -> tuple[int, int, int]:
        """Wait for the end; return the numbers of passed, failed and skipped tests."""
        said, _ = self.process.communicate(timeout=200)
        assert self.report.exists(), said
        suite = ElementTree.parse(self.report).getroot().find("testsuite")
        assert suite is not None
        total, bad = int(suite.attrib["tests"]), 0
        for kind in ("failures", "errors"):
            bad += int(suite.attrib[kind])
        skipped = int(suite.attrib["skipped"])
        if bad:
            sys.stderr.write(said)
        return total - bad - skipped, bad, skipped


def begin(source: Path, folder: Path, transport: str, tests: list[str], port: str) -> Suite:
    """Start tests of the source distribution, in which only the port is changed."""
    shutil.copytree(source, folder)
    for file in (folder / "tests").rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace("9090", port), encoding="utf-8")
    report = folder / "report.xml"
    process = subprocess.Popen(
        [sys.executable, "-m", "pytest", *tests, "-q", f"--junitxml={report}"]
        + ["-p", "no:cacheprovider", "-p", "no:dash", "-p", "no:xdist"],
        cwd=folder,
        env={**os.environ, "ROSLIBPY_TRANSPORT": transport},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return Suite(process, report)


@pytest.fixture(scope="module")
def suites(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[Suite, Suite]]]:
    """Run roslibpy's tests for all transports simultaneously, as they mostly sleep."""
    folder = tmp_path_factory.mktemp("roslibpy")
    wanted = f"roslibpy=={version('roslibpy')}"
    subprocess.run(
        [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
        + ["--no-deps", "--no-binary", ":all:", "--dest", str(folder), wanted],
        check=True,
    )
    (archive,) = folder.glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    (source,) = (path for path in folder.iterdir() if path.is_dir())
    with conformance_server() as one, conformance_server() as two:
        found: dict[str, tuple[Suite, Suite]] = {}
        for transport, address in (("twisted", one), ("asyncio", two)):
            port = address.rpartition(":")[2]
            # Not tests/test_ws_headers.py: it connects to a server of its own, and hangs where
            # that server's loop is idle when the test sets its asyncio.Event from another thread.
            rest = ["tests/ros2", "tests/test_transport.py"]
            found[transport] = (
                begin(source, folder / f"{transport}1", transport, ["tests/ros1"], port),
                begin(source, folder / f"{transport}2", transport, rest, port),
            )
        try:
            yield found
        finally:
            for pair in found.values():
                for suite in pair:
                    suite.process.kill()
                    suite.process.wait()


@pytest.mark.slow
@roslibpy
@pytest.mark.parametrize(
    ("transport", "first", "second"),
    # The suite skips two tests of the asyncio transport in the other process.
    [("twisted", (25, 0, 0), (29, 0, 2)), ("asyncio", (25, 0, 0), (31, 0, 0))],
)
def test_roslibpys_own_tests_pass(
    suites: dict[str, tuple[Suite, Suite]],
    transport: str,
    first: tuple[int, int, int],
    second: tuple[int, int, int],
) -> None:
    one, two = suites[transport]
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
