"""Worlds by name and path: rejected floor plans, and the size of the office."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robot_sim.errors import UnknownSceneError, WorldError
from robot_sim.simulation import Simulation
from robot_sim.worlds.loading import load_plan, load_world, parse_world
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND, run


def test_robot_stands_still_on_four_wheels_at_every_place(office: World) -> None:
    for name, pose in office.places.items():
        simulation = Simulation(office, start=pose, config=BLIND)
        run(simulation, 10)
        condition = simulation.condition
        assert condition.wheels_down == (True, True, True, True), name
        assert not condition.touching, name
        moved = simulation.truth().map_from_base.position - pose.position
        assert float(np.linalg.norm(moved)) < 0.002, name


def test_unknown_scene_lists_the_available_ones() -> None:
    with pytest.raises(UnknownSceneError, match="office"):
        load_world("../office")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("bounds = [0", "not valid TOML"),
        ("bounds = [0, 0, 4, 4]", "lacks the entry 'spawn'"),
        (
            'bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n[[furniture]]\ntype = "throne"\nat = [1, 1]',
            "no furniture of type 'throne'; available: desk",
        ),
        (
            'bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n[[wall]]\nname = "w"\nfrom = [0, 0]\n'
            "to = [4, 0]\ndoors = [{ at = 3.8, width = 1.0 }]",
            "wall 'w': the door at 3.8 m does not fit",
        ),
        (
            'bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n[[furniture]]\ntype = "box"\nat = [2.2, 2]',
            "x 2.00, y 2.00 would stand inside box_0_body",
        ),
        (
            'bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n[[furniture]]\ntype = "box"\nat = [1, 1]\n'
            'name = "a"\n[[furniture]]\ntype = "box"\nat = [3, 3]\nname = "a"',
            "a_body",
        ),
        (
            'bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n[[wall]]\nname = "w"\nfrom = [0, 0]\nto = [4, 0]\n'
            'material = "glas"',
            "wall 'w': material must be one of wall, wood, metal, ",
        ),
        (f"bounds = [0, 0, 4, 1{'0' * 400}]", "bounds int too large to convert to float"),
        (
            "bounds = [0, 0, 4, 4]\nspawn = [5, 2, 0]",
            "spawn 'spawn' at x 5.00, y 2.00 is off the floor",
        ),
        (
            'bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\nfloor = "none"',
            "no surface is drivable: give it a floor",
        ),
        (
            "bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n[places]\nden = [1, 1, 0]\n"
            '[[wall]]\nname = "w"\nfrom = [0, 1]\nto = [4, 1]',
            "place 'den': the robot at x 1.00, y 1.00 would stand inside w_0",
        ),
    ],
)
def test_invalid_plan_is_rejected_in_one_line(text: str, message: str) -> None:
    with pytest.raises(WorldError) as caught:
        parse_world(text, name="bad")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("file", ["world.toml", "plan.toml"])
def test_plan_may_begin_with_a_mark_and_one_that_is_not_utf_8_is_refused_by_name(
    tmp_path: Path, file: str
) -> None:
    """As a scene's folder and as a file: editors on Windows write the mark, older ones Latin-1."""
    path = tmp_path / file
    scene = tmp_path if file == "world.toml" else path
    path.write_text("bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n", encoding="utf-8-sig")
    assert load_plan(str(scene)).bounds == (0.0, 0.0, 4.0, 4.0)
    path.write_bytes(b"# ol\xe9\n")
    with pytest.raises(WorldError, match=f"cannot read the floor plan '.*{file}': 'utf-8'"):
        load_world(str(scene))
