"""roslibpy's own tests, run by itself against our server: they mostly sleep."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree

from tests.teleop.rosbridge.support import ROOT


@contextmanager
def conformance_server() -> Iterator[str]:
    """Run ``conformance_server.py``; yield its address."""
    command = [sys.executable, "-m", f"{__package__}.conformance_server"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.stdin.close()
            assert process.wait(20) == 0


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

    def kill(self) -> None:
        """End it, if it has not ended."""
        self.process.kill()
        self.process.communicate()


Runs = dict[str, tuple[Suite, Suite]]
"""Two parallel runs for each transport."""


def begin_all(folder: Path, ending: ExitStack) -> Runs:
    """Fetch the tests and start them for both transports; ``ending`` ends them and their servers."""
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
    runs: Runs = {}
    # Not tests/test_ws_headers.py: it connects to a server of its own, and hangs where
    # that server's loop is idle when the test sets its asyncio.Event from another thread.
    rest = ["tests/ros2", "tests/test_transport.py"]
    for transport in ("twisted", "asyncio"):
        port = ending.enter_context(conformance_server()).rpartition(":")[2]
        one, two = (
            _begin(source, folder / f"{transport}{number}", transport, tests, port)
            for number, tests in ((1, ["tests/ros1"]), (2, rest))
        )
        for suite in (one, two):
            ending.callback(suite.kill)
        runs[transport] = (one, two)
    return runs


def _begin(source: Path, folder: Path, transport: str, tests: list[str], port: str) -> Suite:
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
