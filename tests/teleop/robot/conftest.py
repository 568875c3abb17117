"""A robot in lockstep behind a server, for all tests of what clients can do to it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.robot.served_robots import Serving, served
from tests.teleop.support import InRealTime, Robots, lockstep, real_time


@pytest.fixture
def robots(office: World, office_cloud: Cloud, cache: Path) -> Robots:
    """Return a function that serves a robot in the office; use its result in ``async with``."""
    return partial(lockstep, office, office_cloud, cache)


@pytest.fixture
def serving(office: World, office_cloud: Cloud, cache: Path) -> Serving:
    """Return a function that serves a robot with a configuration; use its result in ``async with``."""
    return partial(served, office, office_cloud, cache)


@pytest.fixture
def in_real_time(office: World, office_cloud: Cloud, cache: Path) -> InRealTime:
    """Return a function that serves a robot in real time; use its result in ``async with``."""
    return partial(real_time, office, office_cloud, cache)
