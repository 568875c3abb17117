"""The robot's physics against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from localization.types import Twist
from robot_sim.robot.p3at import MOUNTS, P3AT
from robot_sim.robot.skid_steer_parameters import REFERENCE_HALF_WIDTH, REFERENCE_HULL
from robot_sim.simulation import Simulation
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND


def test_hull_never_touches_the_floor(field: World) -> None:
    simulation = Simulation(field, config=BLIND)
    for forward, turn in ((0.7, 0.0), (0.0, 0.0), (-0.7, 1.0), (0.0, -2.0)):
        simulation.command(Twist.planar(forward, turn))
        for _ in range(80):
            simulation.step()
            assert simulation._data.ncon == 8


def test_vertical_scanner_sweeps_through_the_zenith_across_the_robot() -> None:
    rotation = MOUNTS["laser_vertical"].rotation
    np.testing.assert_allclose(rotation @ [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], atol=1e-12)
    assert abs((rotation @ [0.0, 0.0, 1.0])[0]) == pytest.approx(1.0)


def test_what_other_platforms_are_scaled_by_is_the_p3at_s_own() -> None:
    robot = P3AT()
    assert robot.length_scale == 1.0
    assert robot.inner_half_width == pytest.approx(REFERENCE_HALF_WIDTH, abs=1e-12)
    assert robot.height - robot.clearance == pytest.approx(REFERENCE_HULL, abs=1e-12)
