"""One tick of the robot: what goes in, what comes out, in which order."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.cloud import Cloud
from localization.localizer import Localizer
from localization.prepared import prepare
from localization.types import Hint, Inertial, Pose, Twist
from robot_sim import TICK_NS, Simulation, World
from teleop.robot.robot import WATCHDOG, Robot


@pytest.fixture
def robot(office: World, office_cloud: Cloud, cache: Path) -> Robot:
    simulation = Simulation(office, seed=0)
    world = prepare(office_cloud, cache=cache)
    return Robot(simulation, Localizer(world, simulation.mounts))


def test_tick_advances_time_by_one_tick_and_ends_with_an_inertial_reading(robot: Robot) -> None:
    snapshot = robot.tick(0, ())
    assert snapshot.stamp == snapshot.truth.stamp == snapshot.estimate.stamp == TICK_NS
    assert isinstance(snapshot.readings[-1], Inertial)
    assert len(snapshot.estimates) == 1


def test_tick_hands_hints_to_the_localiser_before_its_readings(robot: Robot) -> None:
    hint = Hint(0, Pose.planar(1.0, 1.0, 0.0), np.zeros((6, 6)))
    snapshot = robot.tick(0, (hint,))
    assert snapshot.readings[0] is hint


def test_robot_drives_on_a_command_and_stops_when_commands_cease(robot: Robot) -> None:
    now = 0
    for _ in range(100):
        robot.tick(now, (Twist.planar(0.5, 0.0),))
        now += TICK_NS
    assert robot.simulation.truth().twist.linear[0] > 0.4
    silent = now
    while now - silent < WATCHDOG + 10**9:
        snapshot = robot.tick(now, ())
        now += TICK_NS
    assert not snapshot.command.linear.any()
    assert abs(snapshot.truth.twist.linear[0]) < 0.005


def test_newest_command_of_a_tick_wins(robot: Robot) -> None:
    snapshot = robot.tick(0, (Twist.planar(0.5, 0.0), Twist.planar(0.1, 0.2)))
    assert snapshot.command.linear[0] == 0.1


def test_truth_is_out_of_the_localisers_reach(robot: Robot) -> None:
    """Whatever hangs on the localiser, neither the simulation nor its truth is among it."""
    seen: set[int] = set()
    todo: list[object] = [robot.localizer]
    while todo:
        item = todo.pop()
        if id(item) in seen:
            continue
        seen.add(id(item))
        assert not type(item).__module__.startswith(("robot_sim", "mujoco", "teleop"))
        if hasattr(item, "__dict__"):
            todo += list(vars(item).values())
        if type(item).__module__.startswith("localization"):
            todo += [getattr(item, name, None) for name in getattr(item, "__slots__", ())]
        if isinstance(item, dict):
            todo += list(item.values())
        elif isinstance(item, list | tuple | set):
            todo += list(item)
    assert len(seen) > 50
