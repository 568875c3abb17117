"""Floor plans as text: values that are read, and the error of each mistake."""

from __future__ import annotations

import math

import pytest

from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import CloudSpec, Door, Placement, Plan, Wall, Window
from robot_sim.floorplan.toml_reader import plan_from_toml
from robot_sim.scene_objects.floor_surfaces import SURFACES, Patch
from robot_sim.scene_objects.glazing import Glazing, Roof
from robot_sim.scene_objects.ramps_and_steps import Slab
from robot_sim.scene_objects.terrain import Hill, LevelDisc, Rut

HEAD = "bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n"


def test_text_becomes_values_in_metres_and_radians() -> None:
    plan = plan_from_toml(
        HEAD
        + """
wall_thickness = 0.3
[spawns]
corner = [1, 1, 90]
[places]
den = [3, 1, -90]
[[wall]]
from = [0, 0]
to = [4, 0]
doors = [{ at = 1, width = 0.9 }]
windows = [{ at = 3, width = 1, sill = 0.5, height = 2 }]
[[furniture]]
type = "desk"
at = [1, 3]
yaw = 180
size = [1, 2, 3]
""",
        name="it",
    )
    assert plan.bounds == (0.0, 0.0, 4.0, 4.0)
    assert plan.walls == (
        Wall(
            "wall_0", (0.0, 0.0), (4.0, 0.0), thickness=0.3,
            doors=(Door(1.0, 0.9),), windows=(Window(3.0, 1.0, 0.5, 2.0),),
        ),
    )  # fmt: skip
    (desk,) = plan.furniture
    assert (desk.name, desk.kind, desk.yaw, desk.size) == ("desk_0", "desk", math.pi, (1, 2, 3))
    assert dict(plan.spawns) == {
        "spawn": Placement(2.0, 2.0, 0.0),
        "corner": Placement(1.0, 1.0, math.pi / 2),
    }
    assert plan.spawn is plan.spawns["spawn"]
    assert plan.places["den"] == Placement(3.0, 1.0, -math.pi / 2)


def test_ground_glass_and_cloud_are_read_from_their_tables() -> None:
    plan = plan_from_toml(
        HEAD
        + """
floor = "concrete"
[cloud]
spacing = 0.2
highest = 4.5
[[slab]]
name = "ramp"
at = [1, 2]
size = [2, 1]
yaw = 90
top = [0, 0.35]
[[slab]]
at = [3, 3]
size = [1, 1]
top = 0.1
surface = "wood"
[[terrain]]
bounds = [0, 0, 4, 4]
cell = 0.5
seed = 7
hills = [{ at = [2, 2], height = 0.5, radius = 1 }]
ruts = [{ path = [[0, 0], [4, 4]] }]
levels = [{ at = [1, 1], radius = 0.5, height = 0.2 }]
[[patch]]
surface = "gravel"
at = [2, 1]
size = [2, 1]
yaw = 90
[[glazing]]
from = [0, 0]
to = [4, 0]
plinth = 0.5
[[roof]]
bounds = [0, 0, 4, 4]
eaves = 3
ridge = 4
""",
        name="it",
    )
    assert plan.cloud == CloudSpec(0.2, 4.5)
    assert plan.slabs == (
        Slab("ramp", 1.0, 2.0, 2.0, 1.0, (0.0, 0.35), yaw=math.pi / 2),
        Slab("slab_1", 3.0, 3.0, 1.0, 1.0, (0.1, 0.1), surface="wood"),
    )
    (terrain,) = plan.terrains
    assert (terrain.cell, terrain.seed, terrain.shape) == (0.5, 7, (9, 9))
    assert terrain.hills == (Hill(2.0, 2.0, 0.5, 1.0),)
    assert terrain.ruts == (Rut(((0.0, 0.0), (4.0, 4.0))),)
    assert terrain.levels == (LevelDisc(1.0, 1.0, 0.5, 0.2),)
    assert plan.patches == (Patch(SURFACES["gravel"], 2.0, 1.0, (1.0, 0.5), math.pi / 2),)
    assert plan.glazings == (Glazing("glazing_0", (0.0, 0.0), (4.0, 0.0), plinth=0.5),)
    assert plan.roofs == (Roof("roof_0", (0.0, 0.0, 4.0, 4.0), 3.0, 4.0),)


def test_survey_is_the_tour_unless_the_plan_has_one() -> None:
    assert plan_from_toml(HEAD + "tour = [[1, 1], [2, 1]]", name="it").survey == ((1, 1), (2, 1))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + "hight = 3", "unknown entry 'hight'; known entries: bounds, height, "),
        (HEAD + "[[wall]]\nfrom = [0, 0]", "wall 0: lacks the entry 'to'"),
        (
            HEAD + '[[wall]]\nname = "n"\nfrom = [0, 0]\nto = [1, 0]\ncolour = "red"',
            "wall 'n': unknown entry 'colour'; known entries: name, from, to",
        ),
        (HEAD + "[[wall]]\nfrom = [0, 0]\nto = [0, 0]", "wall 'wall_0' must be longer"),
        (
            HEAD + "[[wall]]\nfrom = [0, 0]\nto = [1, 0]\nthickness = -1",
            "wall 'wall_0': thickness must be > 0 m, got -1",
        ),
        (HEAD + "[[wall]]\nfrom = [0, 0, 0]\nto = [1, 0]", "wall 0: from must be [x, y]"),
        (
            HEAD + '[[furniture]]\ntype = "box"\nat = [1, 1]\nsize = [1, 0, 1]',
            "box 'box_0': depth must be > 0 m, got 0",
        ),
        (HEAD + '[[furniture]]\ntype = "box"\nat = [nan, 1]', "box 'box_0': x must be finite"),
        (HEAD + "[places]\nden = [1, 1]", "places den must be [x, y, yaw], got [1, 1]"),
        (HEAD + 'ceiling = "no"', "ceiling must be true or false, got 'no'"),
        (HEAD + "wall = 3", "wall must be an array of tables, got 3"),
        (
            "bounds = [4, 0, 0, 4]\nspawn = [1, 1, 0]",
            "bounds must be [x0, y0, x1, y1] with x1 > x0",
        ),
        ("bounds = [0, 0, 4]\nspawn = [1, 1, 0]", "bounds must be [x0, y0, x1, y1], got [0, 0, 4]"),
        ("bounds = [0, 0, 4, true]\nspawn = [1, 1, 0]", "bounds must be a number, got True"),
    ],
)
def test_mistake_is_reported_in_one_line_that_names_it(text: str, message: str) -> None:
    with pytest.raises(WorldError) as caught:
        plan_from_toml(text, name="bad")
    assert str(caught.value).startswith("world 'bad': ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_plan_without_a_start_is_rejected() -> None:
    with pytest.raises(WorldError, match="at least one spawn"):
        Plan("it", (0.0, 0.0, 1.0, 1.0), spawns={})
