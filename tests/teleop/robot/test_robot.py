"""One tick of the robot: what goes in, what comes out, in which order."""

from __future__ import annotations

import numpy as np
import pytest

from localization.types import Hint, Inertial, Pose
from robot_sim import TICK_NS, Simulation, World
from teleop.robot.inbox import Disconnected, EStop, InboxMessage, PoseHint
from teleop.robot.robot import Robot
from teleop.robot.safety.control_state import SafetyConfig
from teleop.robot.tick_record import TickRecord
from tests.teleop.robot.conftest import RobotOf
from tests.teleop.robot.sticks import stick

NEUTRAL, FULL = stick("operator", 0.0), stick("operator", 0.7)


@pytest.fixture
def robot(office: World, robot_of: RobotOf) -> Robot:
    return robot_of(Simulation(office, seed=0))


def drive(robot: Robot, message: InboxMessage | None, ticks: int) -> TickRecord:
    """Send the same message every tick; None sends nothing."""
    for _ in range(ticks):
        tick = robot.tick(robot.simulation.stamp, () if message is None else (message,))
    return tick


def test_tick_ends_with_an_inertial_reading_20_ms_later(robot: Robot) -> None:
    tick = robot.tick(0, ())
    assert tick.stamp == tick.truth.stamp == tick.estimate.stamp == TICK_NS
    assert isinstance(tick.readings[-1], Inertial)
    assert len(tick.estimates) == 1


def test_tick_hands_hints_to_the_localiser_before_its_readings(robot: Robot) -> None:
    hint = Hint(0, Pose.planar(1.0, 1.0, 0.0), np.zeros((6, 6)))
    tick = robot.tick(0, (PoseHint("a", hint),))
    first = tick.readings[0]
    assert isinstance(first, Hint)
    assert first.map_from_base is hint.map_from_base


@pytest.mark.slow
@pytest.mark.parametrize("end", ["silence", "disconnect", "e-stop", "released deadman"])
def test_robot_brakes_within_the_promised_distance_from_full_speed(robot: Robot, end: str) -> None:
    drive(robot, NEUTRAL, 1)
    moving = drive(robot, FULL, 150)
    assert moving.truth.twist.linear[0] > 0.68
    last: dict[str, InboxMessage | None] = {
        "silence": None,
        "disconnect": Disconnected("operator"),
        "e-stop": EStop("somebody"),
        "released deadman": stick("operator", 0.7, enabled=False),
    }
    begun = robot.simulation.stamp
    tick = drive(robot, last[end], 1)
    wait = SafetyConfig().watchdog if end == "silence" else 0
    while tick.control.twist.linear.any():
        tick = drive(robot, None, 1)
        assert tick.stamp - begun <= wait + 2 * TICK_NS
    braking = tick.truth.map_from_base.position
    stopped = drive(robot, None, 75)
    assert abs(stopped.truth.twist.linear[0]) < 0.005
    assert np.linalg.norm(stopped.truth.map_from_base.position - braking) <= 0.35


def test_truth_is_out_of_the_localisers_reach(robot: Robot) -> None:
    """Whatever hangs on the localiser, neither the simulation nor its truth is among it."""
    seen: set[int] = set()
    todo: list[object] = [robot.estimation.localizer]
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
