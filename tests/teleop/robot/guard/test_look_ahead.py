"""How long an asked motion goes on, in a room with a wall ahead."""

from __future__ import annotations

import pytest

from localization.types import Pose, Twist
from robot_sim import SimulationConfig, World
from teleop.robot.assembly import RobotParts, build_drive
from teleop.robot.guard.look_ahead import LookAhead
from teleop.robot.guard.verdict import FARTHEST


@pytest.mark.parametrize(
    ("forward", "turn", "ahead"),
    [
        (0.5, 0.0, 3.6),  # the wall is 1.84 m before the front
        (0.7, 0.0, 2.57),
        (0.3, 0.0, FARTHEST),
        (-0.5, 0.0, FARTHEST),
        (0.0, 1.0, FARTHEST),
        (0.01, 1.0, FARTHEST),
        (0.0, 0.0, FARTHEST),
    ],
)
def test_motion_goes_on_until_the_robot_would_be_too_near_to_what_it_saw(
    office: World, forward: float, turn: float, ahead: float
) -> None:
    start = Pose.planar(23.8, 3.0, 0.0)
    config = SimulationConfig()
    drive = build_drive(RobotParts(office, simulation=config, start=start, guard=True))
    for _ in range(10):
        drive.tick(drive.simulation.stamp, ())
    assert drive.guard is not None
    assert LookAhead(drive.guard).time(Twist.planar(forward, turn)) == pytest.approx(
        ahead, abs=0.05
    )


def test_another_command_is_looked_at_at_once_and_the_same_one_after_five_ticks(
    office: World,
) -> None:
    looks: list[float] = []

    class Counting(LookAhead):
        def _look(self, forward: float, turn: float) -> float:
            looks.append(forward)
            return super()._look(forward, turn)

    drive = build_drive(RobotParts(office, simulation=SimulationConfig(), guard=True))
    assert drive.guard is not None
    ahead = Counting(drive.guard)
    for forward in (0.5, 0.4, *[0.4] * 5, 0.0, 0.4):
        ahead.time(Twist.planar(forward, 0.0))
    assert looks == [0.5, 0.4, 0.4, 0.4]
