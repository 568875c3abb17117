"""The office with spare bodies, and a robot in it whose world the referee controls."""

from __future__ import annotations

from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World, WorldOptions, load_world
from tests.teleop.scenario.standard.support import Desk


@pytest.fixture(scope="session")
def spare_office() -> World:
    """The office with two boxes and a person to spawn."""
    boxes = ((0.6, 0.6, 1.0), (0.6, 0.6, 1.0))
    return load_world("office", options=WorldOptions(spare_boxes=boxes, spare_people=1))


@pytest.fixture
def desk(spare_office: World, office_cloud: Cloud, cache: Path) -> Desk:
    """A robot in lockstep."""
    return Desk(spare_office, office_cloud, cache)


@pytest.fixture(scope="module")
def shared_desk(spare_office: World, office_cloud: Cloud, cache: Path) -> Desk:
    """One robot for all tests in which nothing is carried out."""
    return Desk(spare_office, office_cloud, cache)
