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


TRACED = """
import sys
import time
import pytest

@pytest.fixture
def tracer():
    return sys.gettrace()

def test_traced(tracer):
    assert None not in (tracer, sys.gettrace())

@pytest.mark.untraced
def test_untraced(tracer):
    assert (tracer, sys.gettrace()) == (None, None)

def test_traced_again(tracer):
    assert None not in (tracer, sys.gettrace())

@pytest.mark.parametrize("number", range(3))
def test_takes_long(tracer, number):
    assert (sys.gettrace() is None) == (number == 2)
    end = time.process_time() + 0.6
    while time.process_time() < end:
        pass
"""


@pytest.mark.process
def test_coverage_is_measured_in_all_tests_but_those_that_say_so(
    ruled: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COVERAGE_FILE", raising=False)  # where the outer run keeps its own
    ruled.makeini("[pytest]\nmarkers = untraced: marked\n")
    ruled.makepyfile(TRACED)
    run = ruled.runpytest_subprocess("--cov=.", "--cov-report=", "-p", "no:dash", "-p", "no:xdist")
    run.assert_outcomes(passed=6)


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
