"""The office and its cloud, prepared once for all tests of a worker."""

from __future__ import annotations

from pathlib import Path

import pytest

from localization.cloud import Cloud
from robot_sim import World, load_world
from teleop.scenario.run import cloud_of


@pytest.fixture(scope="session")
def office() -> World:
    return load_world("office")


@pytest.fixture(scope="session")
def office_cloud() -> Cloud:
    return cloud_of("office")


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for derived files, so that no test depends on the user's."""
    return tmp_path_factory.mktemp("cache")
