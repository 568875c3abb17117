"""Survey from stops: points on the surfaces of all rooms, none on glass, the same for the same seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from robot_sim.floorplan.plan import Door, Piece, Placement, Plan, Wall, Window
from robot_sim.survey.total_station import TotalStation
from robot_sim.worlds.from_floorplan import build_world
from teleop.errors import SettingError
from teleop.world_building.station_survey import StationConfig, survey_from_stations

HALF = 0.07
"""Half the thickness of the walls [m]."""


WINDOW = Window(at=1.5, width=1.6)
ROOMS = Plan(
    name="small",
    bounds=(0.0, 0.0, 6.0, 4.0),
    spawns={"spawn": Placement(1.5, 2.0)},
    height=2.5,
    walls=(
        Wall("south", (0.0, 0.0), (6.0, 0.0), height=2.5, windows=(WINDOW,)),
        Wall("east", (6.0, 0.0), (6.0, 4.0), height=2.5, windows=(WINDOW,)),
        Wall("north", (6.0, 4.0), (0.0, 4.0), height=2.5),
        Wall("west", (0.0, 4.0), (0.0, 0.0), height=2.5),
        Wall("middle", (3.0, 0.0), (3.0, 4.0), height=2.5, doors=(Door(2.0, 1.0),)),
    ),
    furniture=(Piece("cabinet", "cabinet", 0.6, 0.4), Piece("desk", "desk", 5.0, 3.4)),
    places={"east": Placement(4.5, 2.0)},
    tour=((1.5, 2.0), (4.5, 2.0)),
)
"""Two rooms of 3 by 4 m with a door between them and a window in each; 2.5 m high."""


@pytest.fixture(scope="module")
def small() -> World:
    return build_world(ROOMS)


@pytest.fixture(scope="module")
def cloud(small: World) -> Cloud:
    return survey_from_stations(small)


@pytest.mark.slow
def test_points_lie_on_surfaces_with_normals_that_look_into_the_open(
    small: World, cloud: Cloud
) -> None:
    """Seen along its normal from 15 cm away, a point is where the surface is."""
    normals = cloud.normals.astype(np.float64)
    ahead = TotalStation(small).look(cloud.points + 0.15 * normals, -normals, 0.5)
    error = ahead.distances - 0.15
    assert np.mean(np.isfinite(error)) > 0.995
    error = error[np.isfinite(error)]
    assert np.sqrt(np.mean(error**2)) < 0.010
    assert np.mean(np.abs(error) > 0.05) < 0.01


@pytest.mark.slow
def test_both_rooms_have_floor_ceiling_and_both_faces_of_their_wall(cloud: Cloud) -> None:
    points, normals = cloud.points, cloud.normals
    for low, high in ((0.2, 2.8), (3.2, 5.8)):
        inside = (points[:, 0] > low) & (points[:, 0] < high)
        assert np.sum(inside & (np.abs(points[:, 2]) < 0.02)) > 500
        assert np.sum(inside & (np.abs(points[:, 2] - 2.5) < 0.02)) > 500
    for face, side in ((3.0 - HALF, -1.0), (3.0 + HALF, 1.0)):
        assert np.sum((np.abs(points[:, 0] - face) < 0.02) & (normals[:, 0] * side > 0.9)) > 500


def test_panes_leave_no_points_and_the_walls_around_them_do(cloud: Cloud) -> None:
    points = cloud.points
    beside = (np.abs(points[:, 1]) < 0.15) & (points[:, 0] > 0.1) & (points[:, 0] < 2.9)
    open_ = np.abs(points[:, 0] - 1.5) < 0.7
    glazed = (points[:, 2] > 1.0) & (points[:, 2] < 2.0)
    assert np.sum(beside & open_ & glazed) == 0
    assert np.sum(beside & open_ & (points[:, 2] < 0.85)) > 30
    assert np.sum(beside & ~open_ & glazed) > 50


@pytest.mark.slow
def test_same_seed_gives_the_same_cloud(small: World, cloud: Cloud) -> None:
    again = survey_from_stations(small)
    assert np.array_equal(again.points, cloud.points)
    assert np.array_equal(again.normals, cloud.normals)


@pytest.mark.slow
def test_world_without_routes_is_surveyed_from_its_places(small: World) -> None:
    bare = replace(small, tour=(), survey=())
    points = survey_from_stations(bare).points
    assert points[:, 0].min() < 0.1
    assert points[:, 0].max() > 5.9


def test_impossible_station_is_refused_by_name() -> None:
    with pytest.raises(SettingError, match="resolution must be > 0, got 0"):
        StationConfig(resolution=0.0)
    with pytest.raises(SettingError, match="sigma must be >= 0 m, got -1"):
        StationConfig(sigma=-1.0)


def boarded(thickness: float) -> World:
    """The rooms with nothing in them, parted by a wall of a thickness [m]."""
    *outer, middle = ROOMS.walls
    walls = (*(replace(wall, windows=()) for wall in outer), replace(middle, thickness=thickness))
    return build_world(replace(ROOMS, walls=walls, furniture=()))


@pytest.mark.long
@pytest.mark.slow
def test_both_faces_of_a_board_are_in_the_map() -> None:
    warnings: list[str] = []
    thin = survey_from_stations(boarded(0.04), warn=warnings.append)
    thick = survey_from_stations(boarded(0.3))

    def count(cloud: Cloud, half: float, side: float) -> int:
        on = np.abs(side * (cloud.points[:, 0] - 3.0) - half) < 0.02
        on &= side * cloud.normals[:, 0] > 0.9
        return len(np.unique(np.floor(cloud.points[on, 1:] / 0.1).astype(int), axis=0))

    for side in (-1.0, 1.0):
        assert count(thin, 0.02, side) > 0.9 * count(thick, 0.15, side) > 300
    assert warnings == []
