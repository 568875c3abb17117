"""A robot in lockstep behind a server, for all tests of what clients can do to it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.support import Robots, lockstep


@pytest.fixture
def robots(office: World, office_cloud: Cloud, cache: Path) -> Robots:
    """Return a function that serves a robot in the office; use its result in ``async with``."""
    return partial(lockstep, office, office_cloud, cache)
