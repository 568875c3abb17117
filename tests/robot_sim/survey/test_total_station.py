"""The total station: through panes, past what moves, and along the ground."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot_sim.floorplan.actors_in_plan import Cart
from robot_sim.floorplan.plan import Placement, Plan, Wall, Window
from robot_sim.scene_objects.ramps_and_steps import Slab
from robot_sim.survey.total_station import TotalStation
from robot_sim.worlds.from_floorplan import build_world
from robot_sim.worlds.world import WorldOptions

EAST = np.array([[1.0, 0.0, 0.0]])


def hall(**more: object) -> Plan:
    """A hall of 20 by 8 m with a glazed wall at x = 8 and the far wall's face at x = 18."""
    pane = Window(at=4.0, width=4.0, sill=0.3, height=2.0)
    return Plan(
        name="hall",
        bounds=(0.0, 0.0, 20.0, 8.0),
        spawns={"spawn": Placement(2.0, 4.0)},
        walls=(
            Wall("glazed", (8.0, 0.0), (8.0, 8.0), windows=(pane,)),
            Wall("far", (18.1, 0.0), (18.1, 8.0), thickness=0.2),
        ),
        **more,  # type: ignore[arg-type]
    )


def test_panes_are_looked_through_and_their_frames_are_not() -> None:
    station = TotalStation(build_world(hall()))
    eyes = np.array([[2.0, 4.0, 1.0], [2.0, 4.0, 0.15], [2.0, 0.5, 1.0]])
    hits = station.look(eyes, np.repeat(EAST, 3, axis=0), 30.0)
    assert hits.distances == pytest.approx([16.0, 5.93, 5.93], abs=1e-4)
    assert hits.cosines == pytest.approx([1.0, 1.0, 1.0], abs=1e-6)


def test_reach_counts_from_the_eye_also_behind_a_pane() -> None:
    station = TotalStation(build_world(hall()))
    eye = np.array([[2.0, 4.0, 1.0]])
    assert math.isinf(station.look(eye, EAST, 15.9).distances[0])
    assert station.look(eye, EAST, 16.1).distances[0] == pytest.approx(16.0, abs=1e-4)


def test_movers_are_absent_from_the_survey() -> None:
    cart = Cart(name="cart", path=((5.0, 4.0), (5.0, 4.2)), pushed=False)
    plan = hall(actors=(cart,))
    eye = np.array([[2.0, 4.1, 0.4]])
    alive = TotalStation(build_world(plan, options=WorldOptions(alive=True)))
    assert alive.look(eye, EAST, 30.0).distances[0] == pytest.approx(16.0, abs=1e-4)


def test_ground_is_followed_up_a_ramp_but_not_onto_objects_above() -> None:
    ramp = Slab("ramp", 5.0, 4.0, length=4.0, width=2.0, rise=(0.0, 1.0))
    station = TotalStation(build_world(hall(slabs=(ramp,))))
    line = np.column_stack([np.arange(1.0, 7.0, 0.25), np.full(24, 4.0)])
    expected = np.clip((line[:, 0] - 3.0) / 4.0, 0.0, 1.0)
    assert station.ground(line, 0.0) == pytest.approx(expected, abs=1e-3)
