"""Distances of an arm to what is around it, against MuJoCo's exact distances of pairs in the full model."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

from localization.types import Pose
from robot_sim.arm.arm_table import ArmTable, load_arm
from robot_sim.arm.arm_touch import arm_parts
from robot_sim.arm.body import add_arm
from robot_sim.arm.clearance import MARGIN, Clearance
from robot_sim.arm.obstacles import Box
from robot_sim.arm.parts import JAWS
from robot_sim.array_types import FloatArray
from robot_sim.collision_bits import FLOOR_BIT, OBSTACLE_BIT
from robot_sim.errors import ArmError
from robot_sim.robot.mujoco_body import add_robot
from tests.robot_sim.driving import state_of

TABLE = load_arm()
LOWER = ("arm_base", "arm_link_1", "arm_link_2")
STRAIGHT = np.zeros(5)


class Room:
    """A vehicle with an arm on a floor, and solids of every kind around it."""

    def __init__(self, *solids: str) -> None:
        assets = """<asset>
          <mesh name="wedge" vertex="0 0 0  .1 0 0  0 .12 0  0 0 .15  .05 .02 .1"/>
          <hfield name="hills" nrow="4" ncol="4" size=".2 .2 .1 .05"
            elevation="0 .5 .2 0  .3 1 .6 .1  .2 .4 .9 0  0 .1 .3 0"/></asset>"""
        world = '<geom name="floor" type="plane" size="0 0 1" contype="2" conaffinity="2"/>'
        text = f"<mujoco>{assets}<worldbody>{world}{''.join(solids)}</worldbody></mujoco>"
        spec = mujoco.MjSpec.from_string(text)
        add_robot(spec, ("floor",))
        add_arm(spec, spec.body("base_link"), TABLE, "bracket")
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.clearance = Clearance(TABLE)
        self.look()

    def look(self, held: str = "") -> None:
        """Let the clearance follow the state."""
        mujoco.mj_kinematics(self.model, self.data)
        self.clearance.follow(self.model, self.data, held)

    def take(self, angles: FloatArray, opening: float = 0.0) -> None:
        """Put the arm into a pose."""
        first = int(self.model.joint("arm_joint_1").qposadr[0])
        self.data.qpos[first : first + 5] = angles
        for jaw in JAWS:
            self.data.joint(jaw).qpos[:] = 0.5 * opening
        mujoco.mj_kinematics(self.model, self.data)

    def exact(self, horizon: float = 0.1) -> float:
        """Return the smallest distance of the arm's own solids to what they must keep from [m]."""
        model, data = self.model, self.data
        distances = [horizon]
        for part, other in self._pairs():
            between = np.linalg.norm(data.geom_xpos[part] - data.geom_xpos[other])
            reach = horizon + model.geom_rbound[part] + model.geom_rbound[other]
            if model.geom_rbound[other] == 0.0 or between < reach:
                distances.append(mujoco.mj_geomDistance(model, data, part, other, horizon, None))
        return min(distances)

    def _pairs(self) -> Iterator[tuple[int, int]]:
        model = self.model
        bodies = [model.body(b).name for b in model.geom_bodyid]
        arm = arm_parts(model)[model.geom_bodyid]
        own = model.body_rootid[model.geom_bodyid] == model.body("base_link").id
        collides = (model.geom_contype != 0) & (model.geom_rgba[:, 3] > 0.0)
        for part, other in itertools.product(np.flatnonzero(arm), np.flatnonzero(collides)):
            name, against = bodies[part], bodies[other]
            if not own[other]:
                wanted = name != "arm_base"
            elif not arm[other]:
                # The upper arm reaches a scanner, and no other part of the vehicle.
                housing = model.geom(other).name == "laser_horizontal_housing"
                wanted = name not in LOWER or (name == "arm_link_2" and housing)
            else:
                wanted = name not in LOWER and against in LOWER
                wanted &= (name, against) != ("arm_link_3", "arm_link_2")
            if wanted:
                yield int(part), int(other)


def solid(name: str, kind: str, size: str, pos: str, more: str = "") -> str:
    return f'<geom name="{name}" type="{kind}" size="{size}" pos="{pos}" euler="20 30 40" {more}/>'


def level(name: str, size: str, pos: str, more: str = "") -> str:
    return f'<geom name="{name}" type="box" size="{size}" pos="{pos}" {more}/>'


SOLIDS = {
    "box": solid("crate", "box", ".05 .08 .03", ".5 .1 .3"),
    "sphere": solid("ball", "sphere", ".06", ".5 -.1 .4"),
    "capsule": solid("pole", "capsule", ".03 .1", ".45 .2 .3"),
    "cylinder": solid("post", "cylinder", ".04 .1", ".45 -.2 .3"),
    "ellipsoid": solid("bush", "ellipsoid", ".04 .1 .07", ".55 0 .25"),
    "mesh": solid("rock", "mesh", "1", ".5 .1 .2", 'mesh="wedge"'),
    "hfield": '<geom name="hill" type="hfield" hfield="hills" pos=".5 0 .02"/>',
}


def poses(count: int, seed: int = 0, table: ArmTable = TABLE) -> FloatArray:
    chance = np.random.default_rng(seed)
    return chance.uniform(table.lower, table.upper, (count, 5))


@pytest.mark.parametrize("kind", SOLIDS)
def test_distances_to_every_kind_of_solid_are_exact(kind: str) -> None:
    room = Room(SOLIDS[kind])
    chance = np.random.default_rng(1)
    apart = 0
    for angles in poses(60):
        room.take(angles, chance.uniform(0.0, 0.06))
        room.look()
        exact, ours = room.exact(), room.clearance.distance(angles)
        if exact > 0.0:
            apart += 1
            assert ours == pytest.approx(exact, abs=2e-6)
        else:
            assert ours < 2e-6
    assert apart > 20


def test_distances_to_many_boxes_are_those_of_the_nearest() -> None:
    chance = np.random.default_rng(2)
    centres = chance.uniform((0.3, -0.4, 0.05), (0.75, 0.4, 0.6), (40, 3))
    room = Room(
        *(
            solid(f"b{k}", "box", ".02 .03 .01", " ".join(f"{x:g}" for x in c))
            for k, c in enumerate(centres)
        )
    )
    for angles in poses(40, seed=3):
        room.take(angles)
        room.look()
        exact = room.exact()
        assert room.clearance.free(angles) == (exact >= MARGIN)
        if exact > 0.0:
            assert room.clearance.distance(angles) == pytest.approx(exact, abs=2e-6)


def test_the_gradient_is_that_of_the_distance_by_the_angles() -> None:
    room = Room(*(SOLIDS[kind] for kind in ("box", "capsule", "cylinder")))
    seen = 0
    for angles in poses(80, seed=4):
        nearest = room.clearance.nearest(angles, 0.03)
        if nearest is None or nearest.distance < 1e-3:
            continue
        seen += 1
        measured = []
        for step in 1e-6 * np.eye(5):
            sides = [
                min(
                    n.distance
                    for n in room.clearance.near(angles + sign * step, 0.05)
                    if n.names == nearest.names
                )
                for sign in (-1, 1)
            ]
            measured.append((sides[1] - sides[0]) / 2e-6)
        np.testing.assert_allclose(nearest.gradient, measured, atol=1e-4)
    assert seen > 10


@pytest.mark.parametrize(("mount", "apart"), [("bracket", 0.03), ("plate", 0.0019)])
def test_every_named_pose_is_free_of_the_vehicle_and_itself(mount: str, apart: float) -> None:
    spec = mujoco.MjSpec()
    add_robot(spec, ())
    model = spec.compile()
    data = state_of(model)
    clearance = Clearance(TABLE, mount)
    clearance.follow(model, data)
    for angles in TABLE.poses.values():
        assert clearance.distance(angles) > apart


def test_a_pose_is_free_at_two_millimetres_and_not_below() -> None:
    clearance = Clearance(TABLE)
    # The jaws' ends are 41.19 cm ahead of the shoulder, which is 0.29 m ahead of base_link.
    ahead = 0.29 + 0.14 + 0.1334 + 0.1385
    for gap, free in ((0.0021, True), (0.0019, False)):
        wall = Box("wall", Pose.from_euler((ahead + gap + 0.05, 0.0, 0.3)), (0.05, 0.5, 0.3))
        clearance.surround((wall,))
        assert clearance.distance(STRAIGHT) == pytest.approx(gap, abs=1e-6)
        assert clearance.free(STRAIGHT) is free
        assert clearance.nearest(STRAIGHT).names[1] == "wall"  # type: ignore[union-attr]


def test_what_is_too_near_can_be_left_and_not_approached() -> None:
    clearance = Clearance(TABLE)
    clearance.surround((Box("ceiling", Pose.from_euler((0.6, 0.0, 0.4102)), (0.2, 0.2, 0.1)),))
    low, high = np.array([0.0, -0.02, 0.0, 0.0, 0.0]), np.array([0.0, 0.02, 0.0, 0.0, 0.0])
    touching = clearance.touching(STRAIGHT)
    assert {other for _, other in touching} == {"ceiling"}
    assert all(distance < MARGIN for distance in touching.values())
    assert not clearance.free(STRAIGHT)
    assert clearance.free(STRAIGHT, touching)
    assert clearance.free(low, touching)
    assert not clearance.free(high, touching)


def picked(name: str, pos: str) -> str:
    return f'<body name="{name}" pos="{pos}"><freejoint/><geom type="box" size=".015 .015 .015" mass=".02"/></body>'


def test_jaws_may_touch_what_can_be_picked_up_and_the_forearm_may_not() -> None:
    # The tip is 0.7019 m ahead and 0.29355 m up.
    assert Room(picked("dice", ".69 0 .2936")).clearance.free(STRAIGHT)
    room = Room(picked("dice", ".5 0 .2936"))
    assert room.clearance.nearest(STRAIGHT).names == ("arm_link_3", "dice")  # type: ignore[union-attr]
    assert not room.clearance.free(STRAIGHT)


def test_what_is_held_belongs_to_the_arm() -> None:
    room = Room(
        picked("dice", ".69 0 .2936"),
        level("ledge", ".1 .1 .01", ".7 0 .26"),
    )
    alone = room.clearance.levers.copy()
    room.take(STRAIGHT)
    room.look()
    assert room.clearance.nearest(STRAIGHT).names[0] != "dice"  # type: ignore[union-attr]
    room.look(held="dice")
    nearest = room.clearance.nearest(STRAIGHT)
    # The box's underside is 8.6 mm above the ledge, the jaws' 11.6 mm.
    assert nearest is not None
    assert nearest.names == ("dice", "ledge")
    assert nearest.distance == pytest.approx(0.2936 - 0.015 - 0.27, abs=1e-6)
    assert (room.clearance.levers >= alone).all()
    assert not room.clearance.free(np.array([0.0, -0.03, 0.0, 0.0, 0.0]))
    room.look()
    assert room.clearance.free(np.array([0.0, -0.02, 0.0, 0.0, 0.0]))
    np.testing.assert_array_equal(room.clearance.levers, alone)


def test_a_box_that_is_held_is_as_near_as_its_corners() -> None:
    clearance = Clearance(TABLE)
    tip = 0.29 + 0.14 + 0.1334 + 0.1385
    clearance.surround((Box("wall", Pose.from_euler((tip + 0.15, 0.0, 0.3)), (0.05, 0.5, 0.3)),))
    clearance.hold(Box("held", Pose.from_euler((0.0, 0.0, 0.0)), (0.03, 0.02, 0.01)))
    assert clearance.nearest(STRAIGHT).names == ("held", "wall")  # type: ignore[union-attr]
    assert clearance.distance(STRAIGHT) == pytest.approx(0.07, abs=1e-6)
    clearance.hold(None)
    assert clearance.nearest(STRAIGHT, 0.0706) is None


def test_obstacles_that_move_and_come_are_followed() -> None:
    door = '<body name="door" mocap="true" pos="3 0 .3"><geom type="box" size=".02 .3 .3"/></body>'
    room = Room(door)
    assert room.clearance.distance(STRAIGHT, 0.05) == 0.05
    room.data.mocap_pos[0] = (0.75, 0.0, 0.3)
    room.look()
    assert room.clearance.nearest(STRAIGHT).names[1] == "door"  # type: ignore[union-attr]
    assert room.clearance.distance(STRAIGHT) == pytest.approx(0.73 - 0.7019, abs=1e-6)
    room.data.mocap_pos[0] = (3.0, 0.0, 0.3)
    room.look()
    assert room.clearance.distance(STRAIGHT, 0.05) == 0.05


def test_obstacles_are_found_where_the_vehicle_has_gone() -> None:
    room = Room(level("crate", ".05 .05 .3", "9.75 -2 .3"))
    base = room.data.joint("base_link").qpos
    base[:] = (9.0, -2.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    room.look()
    assert room.clearance.nearest(STRAIGHT).names[1] == "crate"  # type: ignore[union-attr]
    assert room.clearance.distance(STRAIGHT) < 0.0
    # Turned to the left the arm points away from it along y, and its palm is beside the crate.
    base[:] = (9.65, -2.6, 0.0, np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
    room.look()
    palm = TABLE.gripper.opening / 2 + 2 * TABLE.gripper.pad[1]
    assert room.clearance.nearest(STRAIGHT).names == ("arm_link_5", "crate")  # type: ignore[union-attr]
    assert room.clearance.distance(STRAIGHT) == pytest.approx(9.7 - 9.65 - palm, abs=1e-6)


def test_things_above_the_robot_which_physics_leaves_out_are_obstacles() -> None:
    room = Room(level("table", ".2 .2 .02", ".4 0 .71", 'contype="0" conaffinity="0"'))
    upright = np.array([0.0, np.pi / 2, 0.0, 0.0, 0.0])
    assert not room.clearance.free(upright)


def test_an_unknown_mount_is_refused_with_those_there_are() -> None:
    with pytest.raises(ArmError, match=r"no mount 'roof' of arm 's2'; there are: bracket, plate"):
        Clearance(TABLE, "roof")


def test_bits_of_floors_and_obstacles_count_alike() -> None:
    for bit in (FLOOR_BIT, OBSTACLE_BIT):
        step = solid("step", "box", ".1 .1 .1", ".7 0 .25", f'contype="{bit}" conaffinity="{bit}"')
        assert not Room(step).clearance.free(STRAIGHT)
