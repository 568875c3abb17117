"""The pose in which a robot stands on the ground somewhere: it stays there when it is simulated."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot_sim import Simulation, World, WorldError
from robot_sim.standing_pose import standing_pose
from robot_sim.worlds.loading import parse_world
from tests.robot_sim.driving import run

RAMPS = """
bounds = [-20.0, -20.0, 20.0, 20.0]
spawn = [-10.0, 0.0, 0.0]
ceiling = false
[[slab]]
name = "ramp"
at = [0.0, 0.0]
size = [8.0, 4.0]
top = [0.0, 0.8]
[[slab]]
name = "deck"
at = [10.0, 0.0]
size = [4.0, 4.0]
top = 0.3
[[furniture]]
type = "table"
at = [-10.0, 10.0]
size = [4.0, 4.0, 1.3]
"""
RISE = math.atan(0.1)
"""Angle of the ramp [rad]."""


@pytest.fixture(scope="module")
def ramps() -> World:
    """An open floor with a ramp of 10 % that rises to +x, a deck, and a table to drive under."""
    return parse_world(RAMPS, name="ramps")


@pytest.mark.parametrize(
    ("x", "y", "heading", "z", "roll", "pitch"),
    [
        (-10.0, -5.0, 0.0, 0.0, 0.0, 0.0),
        (-10.0, -5.0, 2.0, 0.0, 0.0, 0.0),
        (10.0, 0.0, 1.0, 0.3, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.4, 0.0, -RISE),
        (0.0, 0.0, math.pi, 0.4, 0.0, RISE),
        (0.0, 0.0, math.pi / 2, 0.4, -RISE, 0.0),
        (0.0, 0.0, -math.pi / 2, 0.4, RISE, 0.0),
        (-10.0, 10.0, 0.0, 0.0, 0.0, 0.0),
    ],
)
def test_robot_stands_as_the_ground_does(
    ramps: World, x: float, y: float, heading: float, z: float, roll: float, pitch: float
) -> None:
    pose = standing_pose(ramps, x, y, heading)
    assert pose.position.tolist() == pytest.approx([x, y, z], abs=2e-3)
    expected = type(pose).from_euler((x, y, z), roll=roll, pitch=pitch, yaw=heading)
    assert np.abs(pose.rotation - expected.rotation).max() < 2e-3


@pytest.mark.parametrize(("x", "y"), [(-10.0, -5.0), (0.0, 0.0), (10.0, 0.0), (-10.0, 10.0)])
@pytest.mark.parametrize("heading", [0.0, 1.0, -2.2])
def test_robot_that_is_put_down_so_stays_there(
    ramps: World, x: float, y: float, heading: float
) -> None:
    pose = standing_pose(ramps, x, y, heading)
    simulation = Simulation(ramps, start=pose)
    run(simulation, 25)
    after = simulation.truth().map_from_base
    assert np.abs(after.position - pose.position).max() < 5e-3
    assert np.abs(after.rotation - pose.rotation).max() < 5e-3
    assert all(simulation.condition.wheels_down)


@pytest.mark.parametrize("x", [30.0, -1e3, 1e300])
def test_place_without_ground_is_refused_with_its_coordinates(ramps: World, x: float) -> None:
    with pytest.raises(WorldError, match="no ground for the robot") as error:
        standing_pose(ramps, x, 0.0, 0.0)
    assert f"x {x:.6g}, y 0" in str(error.value)


def test_robot_with_a_wheel_over_the_edge_has_no_ground(ramps: World) -> None:
    with pytest.raises(WorldError, match="no ground"):
        standing_pose(ramps, 19.95, 0.0, 0.0)
