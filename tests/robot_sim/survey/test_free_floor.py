"""Free floor of any world, and routes for worlds that have none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robot_sim import World, load_world
from robot_sim.errors import WorldError
from robot_sim.layout.floor_space import FloorSpace
from robot_sim.layout.route_planning import length
from robot_sim.survey.free_floor import free_floor
from robot_sim.survey.route_proposal import reach_of, with_routes

WALLS = """
<geom name="floor" type="plane" size="6 5 .1" user="0.8"/>
<geom type="box" size="6 .05 1" pos="0 5 1"/><geom type="box" size="6 .05 1" pos="0 -5 1"/>
<geom type="box" size=".05 5 1" pos="6 0 1"/><geom type="box" size=".05 5 1" pos="-6 0 1"/>
<geom type="box" size=".05 2.3 1" pos="0 2.7 1"/><geom type="box" size=".05 2.3 1" pos="0 -2.7 1"/>
"""
"""Two rooms of 6 by 10 m with a door of 0.8 m between them."""
SPAWN = '<site name="spawn" pos="-3 0 1"/>'


def load(folder: Path, body: str) -> World:
    path = folder / "mine.xml"
    path.write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    return load_world(str(path))


def clearance(floor: FloorSpace, x: float, y: float) -> float:
    return float(floor.fine.at(np.array([x, y])))


def test_floor_ends_at_walls_and_round_legs_and_goes_on_beneath_a_table(tmp_path: Path) -> None:
    table = '<geom type="box" size=".8 .8 .02" pos="3 2 .75"/>'
    leg = '<geom type="cylinder" size=".02 .36" pos="3.7 2.7 .37"/>'
    floor = free_floor(load(tmp_path, WALLS + SPAWN + table + leg))
    assert floor.area == pytest.approx(2 * 5.9 * 9.9, abs=2.0)
    assert clearance(floor, 5.9, 0.0) == pytest.approx(0.05, abs=0.06)
    assert clearance(floor, 3.4, 2.7) == pytest.approx(0.28, abs=0.06)
    assert clearance(floor, 3.0, 1.7) > 1.0


def test_low_box_and_step_are_in_the_way_and_a_mat_and_a_ramp_are_not(tmp_path: Path) -> None:
    box = '<geom type="box" size=".3 .3 .05" pos="-4 3 .05"/>'
    mat = '<geom type="box" size=".5 .5 .01" pos="-4 -3 .01"/>'
    step = '<geom type="box" size=".5 .5 .06" pos="4 3 .06" user="0.8"/>'
    ramp = '<geom type="box" size="2 .6 .02" pos="3 -3 .1" euler="0 -5 0" user="0.8"/>'
    floor = free_floor(load(tmp_path, WALLS + SPAWN + box + mat + step + ramp))
    assert clearance(floor, -4.0, 3.0) == 0.0
    assert clearance(floor, -4.0, -3.0) > 1.0
    assert clearance(floor, 3.45, 3.0) < 0.1
    assert clearance(floor, 2.0, -3.0) > 0.3


def test_file_without_way_points_gets_a_tour_and_a_survey_through_its_door(tmp_path: Path) -> None:
    world = with_routes(load(tmp_path, WALLS + SPAWN))
    assert max(x for x, _ in world.survey) > 2.0
    assert length(world.tour) > 15.0
    assert "mine.xml has no way-points: planned a tour of" in world.notes[-1]
    reach = reach_of(world)
    assert reach.share > 0.97
    assert reach.missed == ()


def test_world_with_routes_keeps_them(tmp_path: Path) -> None:
    sites = '<site name="survey_0" pos="-3 0 1"/><site name="survey_1" pos="-3 3 1"/>'
    tour = sites.replace("survey", "tour")
    world = load(tmp_path, WALLS + SPAWN + sites + tour)
    assert with_routes(world) is world
    reach = reach_of(world)
    assert 0.1 < reach.share < 0.5
    assert all(missed.open and missed.gaps == () for missed in reach.missed)


def test_walled_in_robot_is_answered_with_the_sites_to_add(tmp_path: Path) -> None:
    cell = "".join(
        f'<geom type="box" size="{sx} {sy} 1" pos="{x} {y} 1"/>'
        for sx, sy, x, y in ((0.4, 0.05, -3, 0.4), (0.4, 0.05, -3, -0.4), (0.05, 0.4, -2.6, 0), (0.05, 0.4, -3.4, 0))
    )  # fmt: skip
    world = load(tmp_path, WALLS + SPAWN + cell)
    with pytest.raises(WorldError, match=r"^mine\.xml: no tour and no survey.*add sites survey_0"):
        with_routes(world)
