"""Parcels: small boxes that lie loose, sleep until they are touched, and are in no map."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from robot_sim.errors import WorldError
from robot_sim.raycasting.ray_caster import static_geoms, visible_geoms
from robot_sim.simulation import Simulation
from robot_sim.survey.total_station import TotalStation
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import WorldOptions
from tests.robot_sim.conftest import ROOM
from tests.robot_sim.driving import BLIND, run

CRATE = """
[[furniture]]
type = "box"
name = "crate"
at = [4.8, 3.0]
size = [0.4, 0.4, 0.3]
[[parcel]]
name = "red"
at = [4.65, 3.0]
z = 0.3
mass = 0.04
size = [0.03, 0.04, 0.05]
yaw = 30.0
"""


def test_a_parcel_lies_where_the_plan_has_it_and_sleeps() -> None:
    world = parse_world(ROOM + CRATE, name="room")
    simulation = Simulation(world, config=BLIND)
    run(simulation, 25)
    data, body = simulation._data, world.model.body("red")
    np.testing.assert_allclose(data.body("red").xpos, (4.65, 3.0, 0.325), atol=3e-4)
    assert body.mass[0] == pytest.approx(0.04)
    assert data.tree_asleep[world.model.body_treeid[body.id]] >= 0
    before = data.body("red").xpos.copy()
    run(simulation, 50)
    np.testing.assert_array_equal(data.body("red").xpos, before)


def test_a_sleeping_parcel_wakes_when_the_arm_pushes_it() -> None:
    world = parse_world(ROOM + CRATE, name="room", options=WorldOptions(arm="s2"))
    simulation = Simulation(world, config=BLIND)
    arm = simulation.arm
    assert arm is not None
    # To the side, ahead, and across the crate.
    for goal in ((-60.0, 35.0, -130.0), (-60.0, 20.0, -20.0), (0.0, 20.0, -20.0)):
        for _ in range(60):
            arm.command(np.radians((*goal, 0.0, 0.0)), 0.0)
            simulation.step()
    assert simulation._data.body("red").xpos[1] > 3.02


def test_a_parcel_is_on_no_map() -> None:
    world = parse_world(ROOM + CRATE, name="room")
    geom = world.model.geom("red_side").id
    assert visible_geoms(world.model)[geom]
    assert not static_geoms(world.model)[geom]
    eye, down = np.array([[4.65, 3.0, 1.0]]), np.array([[0.0, 0.0, -1.0]])
    hits = TotalStation(world).look(eye, down, 5.0)
    assert hits.distances[0] == pytest.approx(0.7, abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass = 0.04", "mass = 2.0", "parcel 'red': mass must be 0.001 to 0.2 kg, got 2"),
        (
            "[0.03, 0.04, 0.05]",
            "[0.03, 0.04, 0.5]",
            "parcel 'red': each side must be 0.005 to 0.2 m, got 0.03 x 0.04 x 0.5 m",
        ),
        ("z = 0.3", "height = 0.3", "unknown entry 'height'"),
        ("z = 0.3", "z = inf", "parcel 'red': z must be finite"),
    ],
)
def test_a_wrong_parcel_is_named(old: str, new: str, words: str) -> None:
    assert old in CRATE
    with pytest.raises(WorldError, match=words):
        parse_world(ROOM + CRATE.replace(old, new), name="room")


def test_a_table_top_is_an_obstacle_for_an_arm_only() -> None:
    desk = '[[furniture]]\ntype = "desk"\nname = "desk"\nat = [7.0, 5.0]\n'
    for arm, collides in ((None, False), ("s2", True)):
        model = parse_world(ROOM + desk, name="room", options=WorldOptions(arm=arm)).model
        assert bool(model.geom("desk_top").contype[0]) == collides
        assert model.geom("desk_leg_0").contype[0] == 1
        assert model.geom("ceiling").contype[0] == 0


def test_two_parcels_of_one_name_are_refused() -> None:
    twice = CRATE + '[[parcel]]\nname = "red"\nat = [1.0, 1.0]\n'
    with pytest.raises(WorldError, match="repeated name 'red'"):
        parse_world(ROOM + twice, name="room")


def test_a_world_with_parcels_is_compiled_as_one_without_but_for_them() -> None:
    parcel = CRATE[CRATE.index("[[parcel]]") :]
    plain, loose = (parse_world(ROOM + text, name="room").model for text in ("", parcel))
    assert loose.nbody == plain.nbody + 1
    names = [[m.geom(g).name for g in range(m.ngeom)] for m in (plain, loose)]
    assert set(names[1]) - set(names[0]) == {"red_side"}
    assert mujoco.mj_name2id(loose, mujoco.mjtObj.mjOBJ_JOINT, "red") >= 0
