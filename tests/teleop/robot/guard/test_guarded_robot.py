"""What the guard means for the rest of the robot: its arm, its steps, and being carried."""

from __future__ import annotations

import json

import numpy as np
import pytest

from localization.types import Pose
from robot_sim import WorldOptions
from robot_sim.floorplan.plan import Placement
from robot_sim.worlds.loading import parse_world
from teleop.robot.arm.arm_commands import JointJog
from teleop.robot.arm.arm_state import ArmMode
from teleop.robot.assembly import RobotParts, build_drive
from teleop.robot.drive import Drive
from teleop.robot.guard.guard import Guard
from teleop.robot.guard.outline import Box, Outline
from teleop.robot.inbox import ArmWish, WorldCall
from teleop.robot.playground.playground import Playground
from tests.robot_sim.conftest import ROOM
from tests.teleop.robot.guard.support import hold, robot_in, room_with
from tests.teleop.robot.playground.test_playground import moved


def test_gap_to_a_point_is_that_of_hull_or_arm_whichever_is_nearer() -> None:
    outline = Outline(0.25, 0.25, 0.25, Box(0.2, 0.5, -0.1, 0.1))
    ahead, aside, inside = outline.gaps(
        np.zeros(3), np.array([[0.8, 0.0], [0.4, 0.4], [0.45, 0.05]])
    )
    assert (ahead, aside) == pytest.approx((0.3, np.hypot(0.15, 0.15)))
    assert inside == pytest.approx(-0.05)
    assert outline.radius == pytest.approx(np.hypot(0.5, 0.1))


def test_person_who_comes_near_the_arm_stops_it_and_who_stands_there_does_not() -> None:
    world = parse_world(ROOM, name="room", options=WorldOptions(arm="s2", spare_people=1))
    drive = build_drive(RobotParts(world, start=Pose.planar(4.0, 4.0, 0.0), guard=True))

    def jogged(rate: float, ticks: int) -> list[str]:
        said = []
        for _ in range(ticks):
            now = drive.simulation.stamp
            jog = JointJog((rate, 0.0, 0.0, 0.0, 0.0))
            record = drive.tick(now, (ArmWish("anna", jog, arrival=now),))
            assert record.arm is not None
            said.append(record.arm.reason if record.arm.mode is ArmMode.HELD else "")
        return said

    assert not any(jogged(0.2, 30))
    (person,) = (spare for spare in world.spares if spare.kind == "person")
    drive.simulation.spares.put(person.name, Placement(5.3, 4.0))
    assert any("somebody comes near the arm" in words for words in jogged(0.2, 20))
    jogged(0.0, 5)  # a zero, after which the client may move it again
    assert not any(jogged(0.2, 20))


@pytest.mark.parametrize("turn", [0.0, -1.2])
def test_person_who_walks_at_a_robot_that_turns_away_meets_it_at_rest(turn: float) -> None:
    drive, person = _robot_and_person(Pose.planar(5.0, 4.0, 0.0))
    hold(drive, 0.3, turn, 0.6)
    walker = drive.simulation.truth().map_from_base.position[:2] - (0.0, 2.2)
    for _ in range(150):
        way = drive.simulation.truth().map_from_base.position[:2] - walker
        walker = walker + 1.3 * 0.02 * way / np.linalg.norm(way)
        drive.simulation.spares.put(person, Placement(*walker))
        (record,) = hold(drive, 0.3, turn, 0.02)
        if record.condition.touching:
            break
        twist = record.truth.twist
        speed = np.hypot(*twist.linear[:2]) + 0.3 * abs(twist.angular[2])
    assert record.condition.touching
    assert speed < 0.05


def test_robot_is_free_again_once_a_person_who_leant_over_it_has_gone() -> None:
    drive, person = _robot_and_person(Pose.planar(5.0, 4.0, 0.0))
    x, y, _ = drive.simulation.truth().map_from_base.position
    drive.simulation.spares.put(person, Placement(x - 0.1, y + 0.2))
    assert hold(drive, 0.0, 0.0, 0.3)[-1].condition.touching
    drive.simulation.spares.remove(person)
    hold(drive, 0.0, 0.0, 0.3)
    for turn in (0.3, -0.3):
        assert hold(drive, 0.0, turn, 0.2)[-1].guard.factor == 1.0


def _robot_and_person(start: Pose) -> tuple[Drive, str]:
    """Return a robot that has looked around an empty room, and the name of who can be put there."""
    world = parse_world(ROOM, name="room", options=WorldOptions(spare_people=1))
    drive = build_drive(RobotParts(world, start=start, guard=True))
    hold(drive, 0.0, 0.0, 0.3)
    (person,) = (spare for spare in world.spares if spare.kind == "person")
    return drive, person.name


@pytest.mark.slow
def test_arm_that_reaches_out_makes_the_robot_stop_so_much_earlier() -> None:
    world = parse_world(ROOM, name="room", options=WorldOptions(arm="s2"))
    drive = build_drive(RobotParts(world, start=Pose.planar(8.3, 4.0, 0.0), guard=True))
    hold(drive, 0.0, 0.0, 0.3)
    assert isinstance(drive.guard, Guard)
    arm = drive.guard.outline.arm
    assert arm is not None
    assert arm.front > 0.3
    last = hold(drive, 0.5, 0.0, 6.0)[-1]
    assert not last.condition.touching
    assert last.guard.factor == 0.0
    assert 0.0 < 10.0 - last.truth.map_from_base.position[0] - arm.front < 0.12


def test_robot_that_is_carried_off_unasked_is_not_held_by_what_stood_around_it_before() -> None:
    """Low things beside it, of which only the vertical scanner knows, are never seen through."""
    low = '[[furniture]]\ntype = "box"\nat = [4.0, 4.4]\nsize = [0.6, 0.2, 0.2]\n'
    drive = robot_in(room_with(low), 3.6, 4.0)
    hold(drive, 0.2, 0.0, 2.5)
    assert isinstance(drive.guard, Guard)
    assert drive.guard.room((0.0, 0.5), 1.0).length < 0.9
    drive.simulation.carry_to(Pose.planar(7.0, 3.0, 2.0))
    hold(drive, 0.0, 0.0, 0.3)
    assert drive.guard.room((0.0, 0.5), 1.0).length == 1.0


def test_nothing_is_remembered_of_where_the_robot_was_before_it_was_carried() -> None:
    drive = robot_in(room_with(""), 9.4, 4.0)
    drive.playground = Playground(drive.simulation, drive.forget_surroundings)
    hold(drive, 0.0, 1.0, 3.6)  # now the wall is behind it, where it is blind
    hold(drive, 0.0, 0.0, 0.4)
    assert isinstance(drive.guard, Guard)
    backward = (-0.1, 0.0)
    assert drive.guard.room(backward, 1.0).length < 0.4
    request = moved(Pose.planar(4.0, 4.0, 0.0))
    hold(drive, 0.0, 0.0, 0.3, WorldCall("anna", 1, "SetEntityState", json.dumps(request)))
    assert drive.simulation.truth().map_from_base.position[0] < 4.1
    assert drive.guard.room(backward, 1.0).length == 1.0
