"""What holds for every test: none may be skipped in CI, and examples do not depend on the day."""

from __future__ import annotations

import os
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import settings

from localization.maps.cloud import Cloud
from robot_sim import World, load_world
from teleop.scene_clouds import load_scene_cloud

# A loaded machine is no failure, and a failure must come back when it is looked for.
settings.register_profile("steady", deadline=None, derandomize=True)
settings.load_profile("steady")


def _forbid_skip(report: pytest.TestReport | pytest.CollectReport) -> None:
    """Turn a skip into a failure: in CI everything a test wants is there, or CI is broken."""
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


@pytest.fixture(scope="session")
def office() -> World:
    """The office that comes with the project."""
    return load_world("office")


@pytest.fixture(scope="session")
def office_cloud() -> Cloud:
    """Its prebuilt cloud."""
    return load_scene_cloud("office")


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for derived files, so that no test depends on the user's."""
    return tmp_path_factory.mktemp("cache")
