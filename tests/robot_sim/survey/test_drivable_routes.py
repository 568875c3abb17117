"""Routes between goals, and free poses, in worlds of which the answer is plain."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from robot_sim import (
    ClosedDoor,
    Simulation,
    World,
    WorldError,
    WorldOptions,
    load_world,
    parse_world,
)
from robot_sim.layout.route_planning import length
from robot_sim.survey.drivable_routes import (
    GoalError,
    checked_pose,
    drivable_floor,
    drivable_route,
    free_pose,
)

ROOMS = """
bounds = [0.0, 0.0, 12.0, 6.0]
spawn = [1.5, 3.0, 0.0]
tour = [[1.5, 3.0], [3.0, 3.0], [1.5, 3.0]]
[[wall]]
name = "west"
from = [0.0, 0.0]
to = [0.0, 6.0]
[[wall]]
name = "middle"
from = [5.0, 0.0]
to = [5.0, 6.0]
doors = [{{ at = 5.0, width = {door} }}]
[[wall]]
name = "vault"
from = [9.0, 0.0]
to = [9.0, 6.0]
[[furniture]]
type = "cabinet"
name = "safe"
at = [7.0, 1.0]
size = [1.6, 1.6, 1.0]
"""


def rooms(door: float = 1.4, **options: object) -> World:
    chosen = WorldOptions(**options)  # type: ignore[arg-type]
    return parse_world(ROOMS.format(door=door), name="rooms", options=chosen)


@pytest.mark.parametrize("door", [1.4, 0.85])
def test_route_leads_through_the_door_past_each_goal(door: float) -> None:
    world = rooms(door)
    goals = [(8.0, 3.0), (3.0, 1.0)]
    legs = drivable_route(world, (1.5, 3.0), goals)
    assert len(legs) == 2
    assert math.dist(legs[0][0], (1.5, 3.0)) < 0.05
    for leg, goal in zip(legs, goals, strict=True):
        assert math.dist(leg[-1], goal) < 0.05
    assert legs[1][0] == legs[0][-1]
    # Through the door, whose middle is at 5, 5, and not much farther than that.
    for leg, (begin, end) in zip(legs, (((1.5, 3.0), goals[0]), (goals[0], goals[1])), strict=True):
        shortest = math.dist(begin, (5.0, 5.0)) + math.dist((5.0, 5.0), end)
        assert shortest - 0.6 < length(leg) < shortest + 0.8
        crossing = next((a, b) for a, b in pairwise(leg) if (a[0] < 5.0) != (b[0] < 5.0))
        (xa, ya), (xb, yb) = crossing
        at = ya + (yb - ya) * (5.0 - xa) / (xb - xa)
        assert abs(at - 5.0) < 0.5 * door - world.robot.half_width


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        (
            (5.0, 1.0),
            r"goal 2 at \[5.00, 1.00\] is in middle_0; the nearest place",
        ),
        (
            (7.0, 1.0),
            r"goal 2 at \[7.00, 1.00\] is in safe\w*; the nearest place",
        ),
        ((14.0, 3.0), r"goal 2 at \[14.00, 3.00\] is off the floor"),
        ((math.nan, 3.0), r"goal 2 at .* is off the floor"),
        ((11.0, 3.0), r"goal 2 at \[11.00, 3.00\] cannot be reached to within 0.5 m from"),
    ],
)
def test_goal_that_cannot_be_driven_to_is_named_with_the_nearest_that_can(
    goal: tuple[float, float], message: str
) -> None:
    with pytest.raises(GoalError, match=message) as caught:
        drivable_route(rooms(), (1.5, 3.0), [(8.0, 3.0), goal])
    assert caught.value.number == 1


def test_goal_near_a_wall_is_reached_when_the_robot_comes_near_enough() -> None:
    with pytest.raises(GoalError, match=r"to within 0.1 m.*nearest place .* is \[0\.53, 2\.98\]"):
        drivable_route(rooms(), (1.5, 3.0), [(0.15, 3.0)], within=[0.1])
    (leg,) = drivable_route(rooms(), (1.5, 3.0), [(0.15, 3.0)], within=[0.6])
    assert 0.15 < leg[-1][0] < 0.75


def test_door_that_is_too_narrow_for_the_robot_is_no_way() -> None:
    with pytest.raises(GoalError, match=r"goal 1 .* cannot be reached"):
        drivable_route(rooms(0.5), (1.5, 3.0), [(8.0, 3.0)])


def test_what_comes_at_its_time_is_not_heeded() -> None:
    world = rooms(extras=(ClosedDoor("middle"),))
    assert drivable_route(world, (1.5, 3.0), [(8.0, 3.0)])


def test_start_without_room_to_turn_is_refused() -> None:
    with pytest.raises(WorldError, match=r"no floor within 1 m of .* needs to turn"):
        drivable_route(rooms(), (11.0, 3.0), [(8.0, 3.0)])


def test_free_poses_are_free_differ_and_reach_the_tour() -> None:
    world = rooms()
    rng = np.random.default_rng(4)
    poses = [free_pose(world, rng) for _ in range(40)]
    for pose in poses:
        x, y = pose.position[:2]
        assert 0.4 < x < 8.6
        assert drivable_route(world, (float(x), float(y)), world.tour[:1])
        Simulation(world, start=pose)
    assert len({pose.position.tobytes() for pose in poses}) == 40
    assert any(pose.position[0] > 5.0 for pose in poses)
    again = np.random.default_rng(4)
    assert free_pose(world, again).position.tobytes() == poses[0].position.tobytes()


def test_checked_pose_names_what_is_in_the_way() -> None:
    world = rooms()
    assert checked_pose(world, 3.0, 3.0, 1.0).position.tolist() == [3.0, 3.0, 0.0]
    with pytest.raises(WorldError, match="would stand inside safe"):
        checked_pose(world, 7.0, 1.5, 0.0)
    with pytest.raises(WorldError, match="off the floor, which reaches from 0, 0 to 12, 6"):
        checked_pose(world, 20.0, 1.5, 0.0)


def test_route_leads_through_a_world_of_mjcf(tmp_path: Path) -> None:
    path = tmp_path / "hall.xml"
    path.write_text(
        """<mujoco><worldbody>
        <geom name="floor" type="box" size="4 4 0.1" pos="0 0 0.9" user="0.7"/>
        <geom name="wall" type="box" size="0.1 3 1" pos="0 1 2"/>
        <site name="spawn" pos="-2 2 1"/></worldbody></mujoco>""",
        encoding="utf-8",
    )
    world = load_world(str(path))
    (leg,) = drivable_route(world, (-2.0, 2.0), [(2.0, 2.0)])
    # Around the end of the wall at y = -2.
    assert min(y for _, y in leg) < -2.0
    pose = free_pose(world, np.random.default_rng(1))
    assert pose.position[2] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.slow
def test_route_past_six_places_of_the_office_keeps_clear_of_everything() -> None:
    world = load_world("office")
    goals = [(float(p.position[0]), float(p.position[1])) for p in world.places.values()][:6]
    start = float(world.spawn.position[0]), float(world.spawn.position[1])
    legs = drivable_route(world, start, goals)
    assert len(legs) == len(goals)
    floor = drivable_floor(world).space
    for leg in legs:
        points = np.concatenate(
            [np.linspace(a, b, 50) for a, b in pairwise(leg)] or [np.array(leg)]
        )
        assert floor.fine.at(points).min() > world.robot.half_width
