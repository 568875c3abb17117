"""A robot in lockstep behind a server, for all tests of what clients can do to it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer
from robot_sim import Simulation, World
from teleop.robot.drive import Drive
from teleop.robot.robot import Robot
from tests.teleop.robot.served_robots import Serving, served
from tests.teleop.support import InRealTime, Robots, lockstep, real_time

RobotOf = Callable[[Simulation], Robot]


@pytest.fixture(scope="session")
def robot_of(office_cloud: Cloud, cache: Path) -> RobotOf:
    """Return a function that makes the robot of a simulation, with the office as its map."""
    prepared = prepare(office_cloud, cache=cache)
    return lambda simulation: Robot(Drive(simulation), Localizer(prepared, simulation.mounts))


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
