"""Places of a scenario by name and by coordinates, and poses that are wrong by as much as is said."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import Pose
from robot_sim import World, WorldError, load_world
from teleop.scenario.session.places import (
    displaced,
    goal_points,
    named_poses,
    pose_of,
    position_of,
    start_pose,
)
from tests.teleop.scenario.session.support import scenario


@pytest.fixture(scope="module")
def corridor() -> World:
    return load_world("corridor")


def test_place_goes_by_its_name_or_its_coordinates(corridor: World) -> None:
    assert position_of(corridor, "niche") == (34.0, 4.0)
    assert position_of(corridor, (1.0, 2.0)) == (1.0, 2.0)
    assert position_of(corridor, (1.0, 2.0, 90.0)) == (1.0, 2.0)


def test_heading_is_in_degrees_and_zero_if_it_is_not_given(corridor: World) -> None:
    assert pose_of(corridor, (10.0, 4.0)).yaw == pytest.approx(0.0)
    assert pose_of(corridor, (10.0, 4.0, -90.0)).yaw == pytest.approx(-math.pi / 2)
    assert pose_of(corridor, "niche").yaw == pytest.approx(math.pi / 2)


def test_start_poses_are_places_too(corridor: World) -> None:
    assert set(corridor.spawns) | set(corridor.places) == set(named_poses(corridor))


def test_unknown_place_is_refused_with_the_nearest_names(corridor: World) -> None:
    with pytest.raises(WorldError, match=r"no place 'nich'; did you mean niche") as error:
        position_of(corridor, "nich")
    assert "east" not in str(error.value)
    with pytest.raises(WorldError, match="three_quarters"):
        pose_of(corridor, "\x1b[2J")


def test_robot_starts_at_the_worlds_own_start_unless_another_is_given(corridor: World) -> None:
    assert start_pose(corridor, scenario().start) is corridor.spawn
    named = start_pose(corridor, scenario(start={"at": "middle"}).start)
    assert named.position[0] == pytest.approx(40.0)


def test_goals_have_names_for_people(corridor: World) -> None:
    goals = [{"at": "niche"}, {"at": [4.25, 4.0], "within": 0.2, "stay": 1.5}]
    first, second = goal_points(corridor, scenario(goals=goals))
    assert (first.name, first.x, first.within, first.stay) == ("niche", 34.0, 0.5, 0)
    assert (second.name, second.x, second.within, second.stay) == (
        "4.25, 4",
        4.25,
        0.2,
        1_500_000_000,
    )


SEEDS = st.integers(0, 2**63 - 1)


@given(SEEDS, st.floats(0.0, 1e3), st.floats(-math.pi, math.pi), st.integers(0, 10_000))
def test_displaced_pose_is_off_by_exactly_as_much_as_is_said(
    seed: int, off: float, turned: float, stream: int
) -> None:
    pose = Pose.from_euler((1.0, 2.0, 0.3), roll=0.05, pitch=-0.1, yaw=0.7)
    wrong = displaced(pose, off, turned, seed=seed, stream=stream)
    assert np.linalg.norm(wrong.position - pose.position) == pytest.approx(off, abs=1e-9)
    assert wrong.position[2] == pose.position[2]
    turn = pose.rotation.T @ wrong.rotation
    assert (np.trace(turn) - 1.0) / 2.0 == pytest.approx(math.cos(turned), abs=1e-9)
    again = displaced(pose, off, turned, seed=seed, stream=stream)
    assert again.position.tobytes() == wrong.position.tobytes()


def test_directions_differ_by_seed_and_by_stream() -> None:
    pose = Pose.identity()
    bearings = {
        math.atan2(*displaced(pose, 1.0, 0.0, seed=seed, stream=stream).position[:2].tolist())
        for seed in range(5)
        for stream in range(5)
    }
    assert len(bearings) == 25
    assert max(bearings) > 1.0
    assert min(bearings) < -1.0
