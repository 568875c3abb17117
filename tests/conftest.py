"""Rules for every test: none is skipped in CI, none is slow without a mark, and examples are reproducible."""

from __future__ import annotations

import gc
import os
import signal
import time
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants

if TYPE_CHECKING:
    from localization.maps.cloud import Cloud
    from robot_sim import World

# `steady` draws the same examples in every run, so that a failure can be reproduced; `--hypothesis-profile=random`
# draws new ones, and more of them. No deadlines: a loaded machine is not a failure.
settings.register_profile("steady", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None, derandomize=False, max_examples=300)
settings.load_profile("steady")


def pytest_configure(config: pytest.Config) -> None:
    """Let Ctrl-C end what tests start, and keep numbers of our own source out of the steady examples.

    A shell starts what runs in its background with Ctrl-C ignored, and programs inherit that.
    Hypothesis draws some examples from the modules that are loaded, and these depend on the tests that a process ran before.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if not config.getoption("--hypothesis-profile", default=None):
        nothing = Constants()
        vars(providers)["_get_local_constants"] = lambda: nothing


CPU_LIMIT = 2.0
"""Processor time of a test without the mark `slow`, `process` or `sweep` [s], times FARSTEER_TEST_CPU_FACTOR."""


def _forbid_skip(report: pytest.TestReport | pytest.CollectReport) -> None:
    """Turn a skip into a failure: in CI everything that a test needs is installed, or CI is broken."""
    if os.environ.get("CI") != "true" or not report.skipped or hasattr(report, "wasxfail"):
        return
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
    report.outcome = "failed"
    report.longrepr = f"{report.nodeid}: tests must not be skipped in CI ({reason})"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    _forbid_skip(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    _forbid_skip(report)
    return report


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any, error: object) -> None:
    """Say how a worker of xdist ended that should not have: a signal leaves no other trace."""
    process = getattr(node.gateway._io, "popen", None)
    if error and process is not None:
        status = process.wait(20)
        name = signal.Signals(-status).name if status < 0 else f"status {status}"
        node.config.get_terminal_writer().line(f"{node.gateway.id} ended with {name}")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for no garbage while test modules are imported, nor later among what they have imported."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Fail a test that takes long and does not say so: `make quick` must stay quick."""
    start = time.process_time()
    result = yield
    taken = time.process_time() - start
    limit = CPU_LIMIT * float(os.environ.get("FARSTEER_TEST_CPU_FACTOR", "1"))
    marked = any(item.get_closest_marker(name) for name in ("slow", "process", "sweep"))
    if taken > limit and not marked:
        pytest.fail(
            f"took {taken:.1f} s of processor time, the limit is {limit:.1f} s: "
            "make it faster, or mark it with pytest.mark.slow",
            pytrace=False,
        )
    return result


@pytest.fixture(scope="session")
def office() -> World:
    """The office that comes with the project."""
    from robot_sim import load_world

    return load_world("office")


@pytest.fixture(scope="session")
def office_cloud() -> Cloud:
    """Its prebuilt cloud."""
    from teleop.scene_clouds import load_scene_cloud

    return load_scene_cloud("office")


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for derived files, so that no test depends on the user's; all processes of a run share it.

    It is the default one where XDG_CACHE_HOME is its parent. Preparing the five scenes' maps takes 24 s.
    """
    base = tmp_path_factory.getbasetemp()
    run = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = run / "cache" / "farsteer"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
