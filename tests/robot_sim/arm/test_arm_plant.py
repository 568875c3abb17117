"""The arm inside a simulation: it starts folded, follows its commands as far as its servos can, and reports contacts."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from robot_sim.arm.arm_plant import ArmPlant
from robot_sim.arm.arm_table import load_arm
from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError
from robot_sim.simulation import Simulation
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import World, WorldOptions
from tests.robot_sim.conftest import ROOM
from tests.robot_sim.driving import BLIND, run

TABLE = load_arm()
WALL = """
[[furniture]]
type = "cabinet"
name = "wall"
at = [4.65, 3.0]
size = [0.1, 2.0, 0.5]
"""


@pytest.fixture(scope="module")
def room_with_arm() -> World:
    return parse_world(ROOM, name="room", options=WorldOptions(arm="s2"))


@pytest.fixture(scope="module")
def narrow() -> World:
    """A room with an obstacle that begins 0.6 m ahead of the robot's centre."""
    return parse_world(ROOM + WALL, name="narrow", options=WorldOptions(arm="s2"))


def arm_of(simulation: Simulation) -> ArmPlant:
    assert simulation.arm is not None
    return simulation.arm


def move(simulation: Simulation, goal: FloatArray, seconds: float, opening: float = 0.0) -> None:
    """Move all joints to a goal with a minimum-jerk profile, and wait half a second."""
    arm = arm_of(simulation)
    start, ticks = arm.reading.angles.copy(), round(50 * seconds)
    for tick in range(ticks + 25):
        u = min(1.0, (tick + 1) / ticks)
        arm.command(start + (10 * u**3 - 15 * u**4 + 6 * u**5) * (goal - start), opening)
        simulation.step()


def test_the_arm_starts_folded_and_stays_so(room_with_arm: World) -> None:
    simulation = Simulation(room_with_arm, config=BLIND)
    stow = np.array(TABLE.poses["stow"])
    np.testing.assert_array_equal(arm_of(simulation).reading.angles, stow)
    run(simulation, 50)
    reading = arm_of(simulation).reading
    # A servo gives all its torque at an error of its dead band: a folded arm sags by less than half of it.
    assert np.abs(reading.angles - stow).max() < math.radians(0.25)
    assert (reading.touching, reading.held, reading.hit) == ((), "", False)
    assert reading.stamp == simulation.stamp
    assert simulation.condition.touching == ()


def test_the_arm_reaches_its_command_but_for_dead_band_play_and_sag(room_with_arm: World) -> None:
    simulation = Simulation(room_with_arm, config=BLIND)
    goal = np.array(TABLE.poses["straight"])
    move(simulation, goal, 1.2)
    error = np.abs(arm_of(simulation).reading.angles - goal)
    for joint, off in zip(TABLE.joints, error, strict=True):
        band = joint.servo.dead_band / (TABLE.pulses.longest - TABLE.pulses.shortest) * math.pi
        assert off < band + 0.5 * joint.servo.play + math.radians(0.3)


def test_servos_of_an_outstretched_arm_bear_its_weight(room_with_arm: World) -> None:
    simulation = Simulation(room_with_arm, config=BLIND)
    move(simulation, np.zeros(5), 1.2)
    # The paper's table 4 in N m, of the joints that gravity loads; the arm does not lie quite flat.
    expected = np.array([0.0, 4.7505, 1.6285, 0.0, 0.3324]) * 0.0980665
    np.testing.assert_allclose(arm_of(simulation).reading.torques, expected, atol=0.003)


def test_an_arm_that_is_pressed_against_a_wall_gives_no_more_than_its_stall_torque(
    narrow: World,
) -> None:
    simulation = Simulation(narrow, config=BLIND)
    arm, most = arm_of(simulation), 0.0
    for tick in range(100):
        # Straight ahead through the obstacle, by which the gripper stops.
        arm.command(np.array([0.0, math.radians(20.0), 0.0, 0.0, 0.0]) * min(1.0, tick / 50), 0.0)
        simulation.step()
        most = max(most, float(np.abs(arm.reading.torques).max()))
    assert arm.reading.hit
    assert arm.reading.touching == ("wall_body",)
    assert most <= TABLE.joints[1].servo.torque(TABLE.supply) + 1e-12
    assert "wall_body" not in simulation.condition.touching


def test_the_gripper_opens_and_closes_at_its_speed(room_with_arm: World) -> None:
    simulation = Simulation(room_with_arm, config=BLIND)
    arm, gripper = arm_of(simulation), TABLE.gripper
    arm.command(np.array(TABLE.poses["stow"]), gripper.opening)
    openings = []
    for _ in range(60):
        simulation.step()
        openings.append(arm.reading.opening)
    assert openings[-1] == pytest.approx(gripper.opening, abs=1e-4)
    assert np.diff(openings).max() <= 1.05 * gripper.speed * 0.02
    # Both jaws move alike.
    assert float(np.ptp(arm._jaws)) < 1e-4


def test_only_an_arm_that_touches_something_is_solved_by_newtons_method(narrow: World) -> None:
    simulation = Simulation(narrow, config=BLIND)
    solvers = set()
    assert narrow.model.opt.solver == mujoco.mjtSolver.mjSOL_NEWTON
    for tick in range(150):
        # Straight ahead until the gripper touches the wall, and back.
        goal = np.radians((0.0, 20.0, 0.0, 0.0, 0.0)) if tick < 75 else TABLE.poses["stow"]
        arm_of(simulation).command(np.array(goal), 0.0)
        simulation.step()
        touching = bool(arm_of(simulation).reading.touching)
        solvers.add((touching, mujoco.mjtSolver(simulation._physics.model.opt.solver)))
    assert (True, mujoco.mjtSolver.mjSOL_NEWTON) in solvers
    assert (False, mujoco.mjtSolver.mjSOL_CG) in solvers
    assert (False, mujoco.mjtSolver.mjSOL_NEWTON) not in solvers


def test_a_robot_is_not_placed_with_its_arm_in_a_wall(narrow: World) -> None:
    simulation = Simulation(narrow, config=BLIND)
    close = narrow.spawn.position + np.array([0.25, 0.0, 0.0])
    with pytest.raises(WorldError, match="would stand inside wall_body"):
        simulation.carry_to(type(narrow.spawn)(close, narrow.spawn.quaternion_wxyz))


def test_an_arm_that_does_not_exist_is_named() -> None:
    with pytest.raises(WorldError, match="world 'room': no arm 's9'; there are: s2"):
        parse_world(ROOM, name="room", options=WorldOptions(arm="s9"))


def test_a_mount_that_does_not_exist_is_named() -> None:
    options = WorldOptions(arm="s2", arm_mount="roof")
    with pytest.raises(WorldError, match="world 'room': no mount 'roof' of arm 's2'; there are"):
        parse_world(ROOM, name="room", options=options)
