"""Users' MJCF files: drivable surfaces, options, collisions, and rejected files."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from localization.types import Scan, Twist
from robot_sim import Simulation, World, WorldError, load_world
from robot_sim.robot.platforms import HUSKY
from robot_sim.robot_placement import place_robot
from robot_sim.scene_objects.plan_elements import Placement
from robot_sim.worlds.from_mjcf import load_mjcf
from robot_sim.worlds.world import TIMESTEP_NS, WorldOptions

FLOOR = '<geom name="floor" type="plane" size="6 5 0.1" user="0.7"/>'
SPAWN = '<site name="spawn"/>'


def write(folder: Path, body: str, head: str = "", name: str = "mine") -> Path:
    path = folder / f"{name}.xml"
    path.write_text(f"<mujoco>{head}<worldbody>{body}</worldbody></mujoco>", encoding="utf-8")
    return path


def load(folder: Path, body: str, head: str = "") -> World:
    return load_mjcf(write(folder, body, head))


def drive(world: World, seconds: float, forward: float = 0.4, turn: float = 0.0) -> Simulation:
    simulation = Simulation(world, seed=1)
    for _ in range(round(50 * seconds)):
        simulation.command(Twist.planar(forward, turn))
        simulation.step()
    return simulation


def test_robot_drives_on_geoms_with_the_attribute(tmp_path: Path) -> None:
    world = load(tmp_path, FLOOR + '<site name="spawn" pos="-4 1 0" euler="0 0 90"/>')
    assert world.name == "mine"
    assert world.bounds == (-6.0, -5.0, 6.0, 5.0)
    assert world.notes == ()
    simulation = drive(world, 5.0)
    x, y, z = simulation.truth().map_from_base.position
    # Up to 0.4 m/s at 0.5 m/s^2, and on until 5 s.
    assert y == pytest.approx(1.0 + 0.4 * (5.0 - 0.4), abs=0.02)
    assert x == pytest.approx(-4.0, abs=0.01)
    assert abs(z) < 0.003


def test_friction_of_the_attribute_is_the_friction_of_the_wheels(tmp_path: Path) -> None:
    world = load(tmp_path, '<geom type="plane" size="5 5 .1" user="0.6 0.45 0.02"/>' + SPAWN)
    model = world.model
    pairs = [model.pair(i) for i in range(model.npair) if "_on_" in model.pair(i).name]
    assert len(pairs) == 4
    for pair in pairs:
        np.testing.assert_allclose(pair.friction[:2], [0.45, 0.6])
    # A more slippery side turns more: chi = 1 + (a/b)^2 (mu_lat/mu_long)^2.
    simulation = drive(world, 6.0, forward=0.0, turn=0.8)
    robot = world.robot
    chi = 1.0 + (robot.wheelbase / robot.track * 0.45 / 0.6) ** 2
    assert simulation.truth().twist.angular[2] == pytest.approx(0.8 * robot.chi / chi, rel=0.04)


def test_loose_things_are_pushed_and_seen_where_they_went(tmp_path: Path) -> None:
    body = """
      <geom name="wall" type="box" size=".1 4 .5" pos="5 0 .5"/>
      <body name="crate" pos="1 0 .26">
        <freejoint/><geom name="crate" type="box" size=".25 .25 .25" mass="3"/></body>
      <body name="door" pos="2.6 -.8 0"><joint name="hinge" axis="0 0 1" damping="2"/>
        <geom name="leaf" type="box" size=".02 .6 1" pos="0 .6 1" mass="8"/></body>
    """
    world = load(tmp_path, FLOOR + SPAWN + body)
    simulation = Simulation(world, seed=1)
    ahead = []
    for _ in range(330):
        simulation.command(Twist.planar(0.4, 0.0))
        for reading in simulation.step():
            if isinstance(reading, Scan) and reading.scanner == "laser_horizontal":
                ahead.append(float(reading.ranges[len(reading.ranges) // 2]))
    data = simulation._data
    assert data.body("crate").xpos[0] > 2.0
    assert data.body("crate").xpos[2] == pytest.approx(0.25, abs=0.02)
    assert simulation.touching == ("crate",)
    # The crate pushed the door open before it.
    assert data.joint("hinge").qpos[0] < -0.3
    assert ahead[0] == pytest.approx(0.75 - 0.125, abs=0.06)
    face = data.body("crate").xpos[0] - 0.25 - simulation.truth().map_from_base.position[0] - 0.125
    assert ahead[-1] == pytest.approx(face, abs=0.08)


def test_collisions_within_the_file_are_kept(tmp_path: Path) -> None:
    # The lid rests on the floor but passes the post, by the file's own bits; the robot meets both.
    body = """
      <geom name="post" type="box" size=".3 .3 .5" pos="2 0 .5" contype="2" conaffinity="2"/>
      <geom name="mist" type="box" size=".3 .3 .5" pos="1 2 .5" contype="0" conaffinity="0"/>
      <body name="lid" pos="2 0 .3"><freejoint/><geom name="lid" type="box" size=".2 .2 .05"/></body>
    """
    world = load(tmp_path, FLOOR + SPAWN + body)
    simulation = drive(world, 1.0, forward=0.0)
    assert simulation._data.body("lid").xpos[2] == pytest.approx(0.05, abs=0.01)
    assert "post" in drive(world, 6.0).touching
    # What nothing in the file touches is a mere sight.
    world = load_mjcf(tmp_path / "mine.xml", spawn=Placement(-0.5, 2.0))
    assert drive(world, 4.0).truth().map_from_base.position[0] == pytest.approx(0.94, abs=0.03)


def test_sites_name_places_and_the_tour(tmp_path: Path) -> None:
    sites = "".join(f'<site name="tour_{i}" pos="{i} 1 0"/>' for i in (10, 2, 0, 1))
    body = FLOOR.replace("6 5", "20 20") + SPAWN + sites
    world = load(tmp_path, body + '<site name="place_door" pos="-2 -3 0.2" euler="0 0 45"/>')
    assert world.tour == world.survey == ((0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (10.0, 1.0))
    door = world.places["door"]
    np.testing.assert_allclose(door.position, [-2.0, -3.0, 0.0], atol=1e-9)
    assert door.yaw == pytest.approx(math.pi / 4)


def test_robot_stands_on_the_storey_and_the_slope_that_the_site_is_on(tmp_path: Path) -> None:
    body = """
      <geom name="ramp" type="box" size="2 2 .05" pos="0 0 0" euler="0 -10 0" user="0.8"/>
      <geom name="upper" type="box" size="2 2 .05" pos="0 8 2.95" user="0.8"/>
      <geom name="roof" type="box" size="2 2 .05" pos="0 8 6.95" user="0.8"/>
      <site name="spawn" pos="0.5 0 0.2" euler="0 0 180"/>
      <site name="place_upstairs" pos="0 8 3.1"/>
    """
    world = load(tmp_path, body)
    # The ramp rises along x by 10 degrees; the robot faces down it.
    assert world.spawn.position[2] == pytest.approx(
        0.5 * math.tan(math.radians(10)) + 0.05 / math.cos(math.radians(10)), abs=1e-3
    )
    assert world.spawn.rotation[2, 0] == pytest.approx(-math.sin(math.radians(10)), abs=1e-3)
    assert world.places["upstairs"].position[2] == pytest.approx(3.0, abs=1e-6)
    on_top = load_mjcf(tmp_path / "mine.xml", spawn=Placement(0.0, 8.0))
    assert on_top.spawn.position[2] == pytest.approx(7.0, abs=1e-6)


def test_heightfield_is_drivable(tmp_path: Path) -> None:
    head = """<asset><hfield name="hills" nrow="3" ncol="3" size="5 5 0.4 0.1"
      elevation="0 0 0  0 0.5 0  0 0 0"/></asset>"""
    world = load(
        tmp_path,
        '<geom name="ground" type="hfield" hfield="hills" user="0.8"/><site name="spawn" pos="-3 0 1"/>',
        head,
    )
    simulation = drive(world, 6.0)
    pose = simulation.truth().map_from_base
    assert pose.position[0] == pytest.approx(-3.0 + 0.4 * 5.6, abs=0.2)
    # The hill is 0.4 m high in its middle, straight from there to its foot.
    assert pose.position[2] == pytest.approx(0.4 * (1.0 - abs(pose.position[0]) / 5.0), abs=0.03)


def test_file_keeps_its_defaults_and_the_robot_does_not_get_them(tmp_path: Path) -> None:
    head = '<default><geom rgba="1 0 0 1" friction="5 5 5" condim="6" group="2"/></default>'
    plain = load(tmp_path, FLOOR + SPAWN).model
    model = load(tmp_path, FLOOR + SPAWN + '<geom name="box" type="box" size="1 1 1" pos="4 0 1"/>',
                 head).model  # fmt: skip
    np.testing.assert_allclose(model.geom("box").rgba, [1, 0, 0, 1])
    assert model.geom("box").group[0] == 2
    for name in ("chassis", "front_left_hull", "plate"):
        np.testing.assert_array_equal(model.geom(name).friction, plain.geom(name).friction)
        np.testing.assert_array_equal(model.geom(name).condim, plain.geom(name).condim)
    np.testing.assert_allclose(
        model.body("base_link").subtreemass, plain.body("base_link").subtreemass
    )


def test_conflicting_options_are_overridden_and_noted(tmp_path: Path) -> None:
    head = """<compiler settotalmass="5"/><option timestep="0.01" integrator="RK4" cone="pyramidal"
      gravity="0 0 -3.7"><flag contact="disable" override="enable"/></option>"""
    body = (
        FLOOR
        + SPAWN
        + """<geom name="shell" type="box" size=".1 .1 .1" pos="3 0 .1" group="3"/>
      <body pos="2 2 1"><joint name="arm"/><geom type="sphere" size=".1"/></body>"""
    )
    path = write(tmp_path, body, head)
    text = path.read_text().replace(
        "</worldbody>",
        '</worldbody><actuator><motor joint="arm"/></actuator><keyframe><key qpos="0"/></keyframe>',
    )
    path.write_text(text)
    world = load_mjcf(path)
    told = "\n".join(world.notes)
    for part in (
        f"option timestep is {TIMESTEP_NS * 1e-9:g}, not 0.01", "option integrator is implicitfast, not rk4",
        "flag contact is enabled", "flag override is disabled", "1 geoms of group 3",
        "keyframes are left out", "1 actuators of the file get no commands", "settotalmass",
    ):  # fmt: skip
        assert part in told
    assert world.model.opt.timestep == pytest.approx(TIMESTEP_NS * 1e-9)
    # What is the file's own business stays: the robot is on Mars.
    assert world.model.opt.gravity[2] == pytest.approx(-3.7)
    assert drive(world, 3.0).truth().map_from_base.position[0] > 0.8


def test_other_robots_join_as_well_and_meshes_lie_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "rock.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    head = '<asset><mesh name="rock" file="rock.obj"/></asset>'
    body = FLOOR + SPAWN + '<geom type="mesh" mesh="rock" pos="3 0 0"/>'
    world = load_world(str(write(tmp_path, body, head)), robot=HUSKY)
    assert world.robot is HUSKY
    assert world.model.geom("world_geom_1").name == "world_geom_1"
    assert drive(world, 2.0).truth().map_from_base.position[0] > 0.3


@pytest.mark.parametrize(
    ("body", "head", "message"),
    [
        ('<geom name="slab" type="plane" size="5 5 .1"/><geom type="sphere" size="1"/>' + SPAWN, "",
         'no geom is drivable: give what the robot drives on its friction, as in user="0.7";'
         " there are: slab, world_geom_1"),
        (SPAWN, "", "there are: no geoms at all"),
        ('<geom name="slab" type="plane" size="5 5 .1" user="0.7 -1"/>' + SPAWN, "",
         "geom 'slab': user must be one number, friction"),
        ('<geom name="slab" type="plane" size="5 5 .1" user="0.8 0.5"/>' + SPAWN, "",
         'or three, friction along and across the wheel and rolling resistance, as in user="0.7 0.6 0.02",'
         ' got "0.8 0.5"'),
        (FLOOR, "", 'there is no spawn: add <site name="spawn"'),
        (FLOOR + '<site name="spawn" pos="50 0 0"/>', "", "'spawn' is not above anything drivable"),
        (FLOOR + SPAWN + '<geom name="pillar" type="cylinder" size=".2 1" pos=".3 0 1"/>', "",
         "spawn 'spawn': the robot at x 0.00, y 0.00 would stand inside pillar"),
        (FLOOR + SPAWN + '<geom type="ball" size="1"/>', "", "invalid keyword: 'ball'"),
        (FLOOR + SPAWN + '<geom type="mesh" mesh="rock"/>', "", "mesh 'rock' not found"),
        (FLOOR + SPAWN + '<geom type="mesh" mesh="rock"/>',
         '<asset><mesh name="rock" file="rock.stl"/></asset>', "rock.stl"),
        (FLOOR + SPAWN + '<body name="base_link"/>', "",
         "body 'base_link' has the name of a part of the robot"),
        (FLOOR + SPAWN + '<geom name="chassis" size="1"/>', "",
         "geom 'chassis' has the name of a part of the robot"),
        (FLOOR + SPAWN, '<option gravity="0 0 0"/>', "gravity must hold the robot down"),
        (FLOOR + FLOOR + SPAWN, "", "repeated name 'floor'"),
    ],
)  # fmt: skip
def test_invalid_file_is_rejected_in_one_line(
    tmp_path: Path, body: str, head: str, message: str
) -> None:
    with pytest.raises(WorldError) as caught:
        load(tmp_path, body, head)
    assert message in str(caught.value)
    assert str(caught.value).startswith("mine.xml: ")
    assert "\n" not in str(caught.value)


def test_file_that_is_not_there_or_not_xml_is_named(tmp_path: Path) -> None:
    with pytest.raises(WorldError, match=r"there is no file '.*nowhere\.xml'"):
        load_world(str(tmp_path / "nowhere.xml"))
    (tmp_path / "text.xml").write_text("hello")
    with pytest.raises(WorldError, match=r"text\.xml: XML"):
        load_world(str(tmp_path / "text.xml"))
    with pytest.raises(WorldError, match="cannot read the floor plan"):
        load_world(str(tmp_path / "nowhere.toml"))
    path = write(tmp_path, FLOOR + SPAWN)
    for options in (WorldOptions(alive=True), WorldOptions(rearranged=0)):
        with pytest.raises(WorldError, match="an MJCF file cannot be alive or rearranged"):
            load_world(str(path), options=options)


def test_file_in_another_encoding_is_refused_with_the_name_that_cannot_be_read(
    tmp_path: Path,
) -> None:
    path = write(tmp_path, FLOOR + SPAWN + '<site name="place_café" pos="1 0 0"/>')
    path.write_bytes(path.read_text(encoding="utf-8").encode("latin-1"))
    with pytest.raises(WorldError, match=r"mine.xml: the name b'place_caf\\xe9' is not UTF-8"):
        load_mjcf(path)


def test_file_is_loaded_with_any_seed(tmp_path: Path) -> None:
    path = write(tmp_path, FLOOR + SPAWN)
    assert load_world(str(path), options=WorldOptions(timing=3)).name == "mine"


def test_floor_plan_is_loaded_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "hut.toml"
    path.write_text("bounds = [0, 0, 4, 4]\nspawn = [2, 2, 0]\n")
    assert load_world(str(path)).name == "hut"


def test_robot_is_placed_though_other_joints_come_first(tmp_path: Path) -> None:
    body = '<body pos="3 3 1"><freejoint/><geom size=".2"/></body>'
    world = load(tmp_path, FLOOR + '<site name="spawn" pos="1 2 0"/>' + body)
    data = mujoco.MjData(world.model)
    place_robot(world.model, data, world.spawn)
    np.testing.assert_allclose(data.body("base_link").xpos[:2], [1.0, 2.0])
    np.testing.assert_allclose(data.qpos[:3], [3.0, 3.0, 1.0])
