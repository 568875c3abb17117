"""The office with spare bodies, and a robot in it whose world the referee controls."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Protocol

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World, WorldOptions, load_world
from teleop.rosbridge.auth.credentials import Credentials
from tests.teleop.scenario.standard.support import Desk


class Desks(Protocol):
    """Makes robots in lockstep, each in a world of its own."""

    def __call__(
        self,
        *,
        tokens: Credentials | None = None,
        restarts: bool = True,
        playing: bool = False,
        ends: int | None = None,
    ) -> Desk:
        """Make a robot: with other tokens than the referee's, without a reset of everything, or whose time goes on by
        itself or ends after some ticks."""


@pytest.fixture(scope="session")
def spare_office() -> World:
    """The office with two boxes and a person to spawn."""
    boxes = ((0.6, 0.6, 1.0), (0.6, 0.6, 1.0))
    return load_world("office", options=WorldOptions(spare_boxes=boxes, spare_people=1))


@pytest.fixture
def desks(spare_office: World, office_cloud: Cloud, cache: Path) -> Desks:
    """Return a function that makes robots."""
    return partial(Desk, spare_office, office_cloud, cache)


@pytest.fixture
def desk(desks: Desks) -> Desk:
    """A robot without other tokens."""
    return desks()


@pytest.fixture(scope="module")
def shared_desk(spare_office: World, office_cloud: Cloud, cache: Path) -> Desk:
    """One robot for all tests in which nothing is carried out."""
    return Desk(spare_office, office_cloud, cache)
