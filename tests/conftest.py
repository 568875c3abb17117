"""Rules for every test: none is skipped in CI, none is slow without a mark, and examples are reproducible."""

from __future__ import annotations

import os
import time
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from localization.maps.cloud import Cloud
    from robot_sim import World

# `steady` draws the same examples in every run, so that a failure can be reproduced; `--hypothesis-profile=random`
# draws new ones, and more of them. No deadlines: a loaded machine is not a failure.
settings.register_profile("steady", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None, derandomize=False, max_examples=300)
settings.load_profile("steady")

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
    """A folder for derived files, so that no test depends on the user's."""
    return tmp_path_factory.mktemp("cache")
