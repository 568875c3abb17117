"""The rules of ``conftest.py`` hold in a test run."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

SKIPPING = """
import pytest

def test_skips():
    pytest.skip("no display")

@pytest.mark.xfail(reason="known")
def test_fails_as_expected():
    raise AssertionError
"""
INTERRUPTING = """
import signal
import subprocess

def test_interrupts():
    with subprocess.Popen(["sleep", "20"]) as child:
        child.send_signal(signal.SIGINT)
        assert child.wait() == -signal.SIGINT
"""
MISSING_MODULE = 'import pytest\npytest.importorskip("no_such_module")\n'
BUSY = """
import time
import pytest

def spin(seconds):
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass

def test_spins():
    spin(0.2)

@pytest.mark.slow
def test_spins_and_says_so():
    spin(0.2)

def test_rests():
    time.sleep(0.2)
"""


@pytest.fixture
def ruled(pytester: pytest.Pytester) -> pytest.Pytester:
    """A folder of tests under the rules of ``conftest.py``."""
    pytester.makeconftest(Path(__file__).with_name("conftest.py").read_text())
    pytester.makeini("[pytest]\nmarkers = slow: marked\n")
    return pytester


@pytest.mark.parametrize("text", [SKIPPING, MISSING_MODULE])
def test_skip_fails_in_ci_and_nowhere_else(
    ruled: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    ruled.makepyfile(text)
    monkeypatch.setenv("CI", "true")
    in_ci = ruled.inline_run("-p", "no:dash", "-p", "no:xdist", "-p", "no:cov")
    assert in_ci.ret in (1, 2)
    monkeypatch.setenv("CI", "")
    elsewhere = ruled.inline_run("-p", "no:dash", "-p", "no:xdist", "-p", "no:cov")
    assert elsewhere.ret in (0, 5)


def test_test_that_takes_long_without_a_mark_fails(
    ruled: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    ruled.makepyfile(BUSY)
    with monkeypatch.context() as inner:
        inner.setenv("FARSTEER_TEST_CPU_FACTOR", "0.05")
        run = ruled.inline_run("-p", "no:dash", "-p", "no:xdist", "-p", "no:cov")
    passed, _, failed = run.listoutcomes()
    assert [report.nodeid.split("::")[1] for report in failed] == ["test_spins"]
    assert {report.nodeid.split("::")[1] for report in passed} == {
        "test_spins_and_says_so",
        "test_rests",
    }


SIGN = """
def sign(x):
    if x > 0:
        return 1
    return 0
"""


@pytest.mark.process
@pytest.mark.parametrize("workers", [0, 1])
@pytest.mark.parametrize(("least", "status"), [(66, 0), (67, 1)])
def test_run_fails_if_its_tests_cover_less_than_asked(
    ruled: pytest.Pytester, workers: int, least: int, status: int
) -> None:
    for name in ("robot_sim", "teleop"):
        ruled.mkdir(name)
    ruled.mkpydir("localization").joinpath("__init__.py").write_text(SIGN, "utf-8")
    ruled.makepyfile("import localization\ndef test_one(): assert localization.sign(2) == 1")
    run = ruled.runpytest_subprocess(
        f"-n{workers}", "-p", "tests.branch_coverage", f"--branch-coverage={least}", "-p", "no:dash"
    )
    run.stdout.fnmatch_lines([f"*66.7 %  in all, of at least {least} %"])
    assert run.ret == status


DYING = """
import os
import signal

def test_dies():
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.process
def test_signal_that_ended_a_worker_is_named(ruled: pytest.Pytester) -> None:
    ruled.makepyfile(DYING)
    run = ruled.runpytest_subprocess(
        "-n1", "--max-worker-restart=0", "-p", "no:dash", "-p", "no:cov"
    )
    run.stdout.fnmatch_lines(["*gw0 ended with SIGKILL"])


@pytest.mark.process
def test_programs_that_tests_start_heed_ctrl_c_although_a_shell_has_it_ignored(
    ruled: pytest.Pytester,
) -> None:
    ruled.makepyfile(INTERRUPTING)
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:dash", "-p", "no:cacheprovider"]
    in_background = shlex.join([*words, "-p", "no:xdist", "-p", "no:cov"])
    done = subprocess.run(
        ["sh", "-c", f"trap '' INT; exec {in_background}"],
        cwd=ruled.path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert "1 passed" in done.stdout, done.stdout
