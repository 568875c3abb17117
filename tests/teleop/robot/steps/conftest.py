"""A robot for tests of steps, in the office."""

from __future__ import annotations

from functools import partial
from typing import Protocol

import pytest

from localization.maps.cloud import Cloud
from localization.types import Pose
from robot_sim import SimulationConfig, World
from tests.teleop.robot.steps.support import StepRig


class Rigs(Protocol):
    """Makes robots."""

    def __call__(
        self,
        *,
        start: Pose | None = None,
        config: SimulationConfig | None = None,
        guard: bool = False,
    ) -> StepRig:
        """Make a robot at a start, with sensors of its own."""


@pytest.fixture
def rig(office: World, office_cloud: Cloud) -> StepRig:
    """Return a robot at the office's spawn, where a metre is free on all sides."""
    return StepRig(office, office_cloud)


@pytest.fixture
def rigs(office: World, office_cloud: Cloud) -> Rigs:
    """Return what makes robots in the office."""
    return partial(StepRig, office, office_cloud)
