"""Bumps, kerbs, ramps and drops in small worlds: the robot's motion and its reported condition."""

from __future__ import annotations

import math

import numpy as np
import pytest

from localization.types import Pose, Twist
from robot_sim.drive.bumpers import Bumpers
from robot_sim.drive.drivetrain import DriveConfig
from robot_sim.drive.motor_controller import FirmwareConfig
from robot_sim.drive.robot_condition import Condition, attitude
from robot_sim.robot.mujoco_body import FLOOR_BIT
from robot_sim.robot.platforms import PLATFORMS
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND

FIRM = SimulationConfig(drive=DriveConfig(firmware=FirmwareConfig()), scanners=())
BARE = "bounds = [-20.0, -20.0, 20.0, 20.0]\nspawn = [0.0, 0.0, 0.0]\nceiling = false\n"
RAMP = 0.35
"""Rise over run; the data sheet's grade."""
HEIGHT = 1.4
ALL_DOWN = (True, True, True, True)


def wall(x: float, y0: float, y1: float, thickness: float = 0.05) -> str:
    return f'[[wall]]\nname = "w"\nfrom = [{x}, {y0}]\nto = [{x}, {y1}]\nthickness = {thickness}\n'


def kerb(height: float) -> str:
    """A step up at x = 1, as high all the way."""
    return (
        f'[[slab]]\nname = "kerb"\nat = [6.0, 0.0]\nsize = [10.0, 6.0]\ntop = {height}\n'
        'surface = "concrete"\n'
    )


def deck(height: float) -> str:
    """A step down at x = 1."""
    return (
        f'[[slab]]\nname = "deck"\nat = [-2.0, 0.0]\nsize = [6.0, 8.0]\ntop = {height}\n'
        'surface = "concrete"\n'
    )


def ramp(grade: float) -> str:
    """Up from x = 1 to x = 5, then level."""
    top = 4.0 * grade
    return (
        f'[[slab]]\nname = "ramp"\nat = [3.0, 0.0]\nsize = [4.0, 8.0]\ntop = [0.0, {top}]\n'
        f'surface = "concrete"\n[[slab]]\nname = "top"\nat = [7.0, 0.0]\nsize = [4.0, 8.0]\n'
        f'top = {top}\nsurface = "concrete"\n'
    )


def world_of(*parts: str) -> World:
    return parse_world(BARE + "".join(parts), name="hand-made")


def drive(
    simulation: Simulation, forward: float, seconds: float, turn: float = 0.0
) -> list[Condition]:
    """Drive; return the condition after each tick."""
    simulation.command(Twist.planar(forward, turn))
    conditions = []
    for _ in range(round(50 * seconds)):
        simulation.step()
        conditions.append(simulation.condition)
    return conditions


def pressed(conditions: list[Condition]) -> tuple[set[int], set[int]]:
    """Return the front and the rear segments that were ever pressed."""
    front = {i for c in conditions for i, p in enumerate(c.bumpers.front) if p}
    rear = {i for c in conditions for i, p in enumerate(c.bumpers.rear) if p}
    return front, rear


def steepest(conditions: list[Condition]) -> float:
    """Return the largest tilt [degrees]."""
    return math.degrees(max(c.tilt for c in conditions))


def place(simulation: Simulation) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return simulation.truth().map_from_base.position


def creep(simulation: Simulation, seconds: float = 4.0) -> float:
    """Return how fast a commanded standstill moves [m/s], after it has settled."""
    drive(simulation, 0.0, 2.0)
    before = place(simulation)
    drive(simulation, 0.0, seconds)
    return float(np.linalg.norm(place(simulation) - before)) / seconds


@pytest.fixture(scope="module")
def ahead() -> World:
    return world_of(wall(1.0, -9.0, 9.0))


@pytest.fixture(scope="module")
def slope() -> World:
    return world_of(ramp(RAMP))


def test_on_level_ground_there_are_no_troubles(field: World) -> None:
    simulation = Simulation(field, config=BLIND)
    assert simulation.condition.wheels_down == ALL_DOWN
    for c in drive(simulation, 0.5, 2.0, 1.0) + drive(simulation, 0.0, 1.0):
        assert c.bumpers == Bumpers()
        assert c.wheels_down == ALL_DOWN
        assert c.troubles == ()
        assert not c.touching
        assert not c.grounded
        assert c.tilt < math.radians(0.2)
        assert c.stamp <= simulation.stamp
    assert simulation.condition.stamp == simulation.stamp


# Bumps


@pytest.mark.parametrize(
    ("yaw", "speed", "front", "rear"),
    [
        (0.0, 0.3, {1, 2, 3}, set()),
        (180.0, -0.3, set(), {1, 2, 3}),
        (60.0, 0.3, {4}, set()),
        (-60.0, 0.7, {0}, set()),
        (120.0, -0.3, set(), {4}),
        (-120.0, -0.3, set(), {0}),
    ],
)
def test_wall_presses_the_segments_that_meet_it(
    ahead: World, yaw: float, speed: float, front: set[int], rear: set[int]
) -> None:
    simulation = Simulation(ahead, config=BLIND, start=Pose.planar(0.0, 0.0, math.radians(yaw)))
    conditions = drive(simulation, speed, 6.0)
    met = next(i for i, c in enumerate(conditions) if c.bumpers.pressed)
    # Later the wall turns the robot.
    assert pressed(conditions[: met + 3]) == (front, rear)
    assert "w_0" in {name for c in conditions[-10:] for name in c.touching}
    assert place(simulation)[0] < 0.78
    assert steepest(conditions) < 2.0


@pytest.mark.parametrize(
    ("y", "front"), [(0.0, {2}), (0.12, {1}), (-0.12, {3}), (0.2, {0, 1}), (-0.2, {3, 4})]
)
def test_post_presses_the_segment_in_front_of_it(y: float, front: set[int]) -> None:
    simulation = Simulation(world_of(wall(1.0, y - 0.01, y + 0.01, 0.02)), config=BLIND)
    conditions = drive(simulation, 0.3, 3.2)
    assert pressed(conditions) == (front, set())
    assert steepest(conditions) < 2.0


def test_bumper_is_released_when_the_robot_backs_off(ahead: World) -> None:
    simulation = Simulation(ahead, config=BLIND)
    assert drive(simulation, 0.3, 4.0)[-1].troubles == ("bumped in front",)
    last = drive(simulation, -0.3, 2.0)[-1]
    assert last.troubles == ()


@pytest.mark.parametrize("speed", [0.3, 0.7])
def test_wheels_that_scrape_along_a_wall_do_not_climb_it(speed: float) -> None:
    world = world_of(
        '[[wall]]\nname = "w"\nfrom = [-9.0, 0.285]\nto = [19.0, 0.285]\nthickness = 0.05\n'
    )
    simulation = Simulation(world, config=BLIND)
    conditions = drive(simulation, speed, 6.0, 0.05)
    assert sum("w_0" in c.touching for c in conditions) > 20
    assert steepest(conditions) < 2.0
    assert place(simulation)[0] > 0.5


def test_touch_that_ends_within_the_tick_counts(ahead: World) -> None:
    # 2 mm before the wall and quick, but pulled back so hard that the tick ends clear of it.
    simulation = Simulation(ahead, config=BLIND, start=Pose.planar(0.719, 0.0, 0.0))
    model, data = simulation._model, simulation._data
    base = model.body("base_link").id
    data.qvel[model.joint("base_link").dofadr[0]] = 2.5
    data.xfrc_applied[base, 0] = -8.9e3
    simulation.step()
    assert simulation.touching == ()
    assert simulation.condition.touching == ("w_0",)
    assert pressed([simulation.condition]) == ({1, 2, 3}, set())
    simulation.step()
    assert not simulation.condition.touching


def test_controller_stops_at_a_bump_reports_a_stall_and_allows_reversing(
    ahead: World,
) -> None:
    simulation = Simulation(ahead, config=FIRM)
    packets = []
    simulation.command(Twist.planar(0.4, 0.0))
    for _ in range(200):
        simulation.step()
        if simulation.packet is not None:
            packets.append(simulation.packet)
    last = packets[-1]
    assert last.left_stalled
    assert last.right_stalled
    assert last.bumpers.front == (False, True, True, True, False)
    assert not last.moving
    assert not packets[5].left_stalled
    # It holds its wheels; pushing takes 10 N m.
    assert np.abs(simulation._data.actuator_force).max() < 4.0
    drive(simulation, -0.3, 1.0)
    assert place(simulation)[0] < 0.6
    assert simulation.packet is not None
    assert not simulation.packet.left_stalled


# Kerbs


@pytest.mark.parametrize("speed", [0.2, 0.7, -0.5])
def test_kerb_of_5_cm_is_climbed_and_measured(speed: float) -> None:
    start = Pose.planar(0.0, 0.0, 0.0 if speed > 0.0 else math.pi)
    simulation = Simulation(world_of(kerb(0.05)), config=BLIND, start=start)
    conditions = drive(simulation, speed, 2.0 / abs(speed) + 2.0)
    assert place(simulation)[2] == pytest.approx(0.05, abs=0.002)
    # Five centimetres over the wheelbase are 10.5 degrees.
    assert 10.0 < steepest(conditions) < 13.0
    assert conditions[-1].troubles == ()
    assert conditions[-1].wheels_down == ALL_DOWN


@pytest.mark.parametrize("speed", [0.2, 0.5])
def test_kerb_of_10_cm_holds_the_rear_wheels(speed: float) -> None:
    simulation = Simulation(world_of(kerb(0.10)), config=BLIND)
    conditions = drive(simulation, speed, 3.0 / speed)
    # The front wheels are up, the rear ones against the edge.
    assert place(simulation)[0] == pytest.approx(1.06, abs=0.02)
    assert math.degrees(conditions[-1].pitch) == pytest.approx(-22.0, abs=1.0)
    assert not conditions[-1].fallen
    # It comes off again.
    assert math.degrees(drive(simulation, -0.3, 4.0)[-1].tilt) < 0.5
    assert place(simulation)[0] < 0.5


def test_motors_that_push_without_turning_are_reported_as_stalled() -> None:
    simulation = Simulation(world_of(kerb(0.10)), config=BLIND)
    conditions = drive(simulation, 0.1, 20.0)
    first = next(i for i, c in enumerate(conditions) if c.troubles)
    assert "stalled" in conditions[first].troubles[0]
    assert any(c.troubles == ("motors stalled",) for c in conditions[first:])
    # The rear wheels get there after 10 s.
    assert first > 500
    assert drive(simulation, -0.2, 2.0)[-1].troubles == ()


def test_controller_cuts_the_power_of_stalled_motors() -> None:
    simulation = Simulation(world_of(kerb(0.10)), config=FIRM)
    simulation.command(Twist.planar(0.1, 0.0))
    torques, stalls = [], 0
    for _ in range(1000):
        simulation.step()
        torques.append(np.abs(simulation._data.actuator_force).max())
        stalls += simulation.packet is not None and simulation.packet.left_stalled
    assert stalls >= 2
    # Power goes and comes: the wheels push, and relax again.
    late = np.array(torques[-200:])
    assert late.max() > 4.0
    assert late.min() < 1.0


def test_platform_of_20_cm_meets_the_chassis_and_presses_the_bumpers() -> None:
    simulation = Simulation(world_of(kerb(0.20)), config=BLIND)
    conditions = drive(simulation, 0.3, 5.0)
    assert pressed(conditions) == ({1, 2, 3}, set())
    assert conditions[-1].touching == ("kerb",)
    assert not conditions[-1].grounded
    assert steepest(conditions) < 2.0


# Ramps


def test_ramp_of_35_percent_is_driven_up_and_over(slope: World) -> None:
    simulation = Simulation(slope, config=BLIND)
    conditions = drive(simulation, 0.4, 16.0)
    assert place(simulation)[2] == pytest.approx(HEIGHT, abs=0.002)
    assert steepest(conditions) == pytest.approx(math.degrees(math.atan(RAMP)), abs=1.5)
    assert all(c.troubles == () for c in conditions)
    assert not any(c.grounded for c in conditions)


@pytest.mark.parametrize("yaw", [0.0, 180.0])
def test_braked_robot_stands_on_the_ramp_and_drives_down_again(slope: World, yaw: float) -> None:
    towards = 1.0 if yaw == 0.0 else -1.0
    simulation = Simulation(slope, config=BLIND, start=Pose.planar(0.0, 0.0, math.radians(yaw)))
    drive(simulation, towards * 0.4, 7.0)
    assert place(simulation)[2] > 0.4
    assert creep(simulation) < 0.001
    assert simulation.condition.troubles == ()
    assert simulation.condition.pitch * towards == pytest.approx(-math.atan(RAMP), abs=0.01)
    drive(simulation, towards * -0.4, 7.0)
    assert place(simulation)[2] == pytest.approx(0.0, abs=0.002)
    assert place(simulation)[1] == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize("grade", [0.18, RAMP])
def test_side_slope_is_held_and_reported_as_roll(grade: float) -> None:
    across = Pose.from_euler((3.0, -2.0, 2.0 * grade), pitch=-math.atan(grade)) @ Pose.planar(
        0.0, 0.0, math.pi / 2
    )
    world = world_of(ramp(grade))
    simulation = Simulation(world, config=BLIND, start=across)
    # Uphill is on the right.
    assert simulation.condition.roll == pytest.approx(-math.atan(grade), abs=1e-6)
    assert creep(simulation) < 0.001
    drive(simulation, 0.3, 6.0)
    x, y, _ = place(simulation)
    assert y > -0.5
    # Downhill drift over more than 1.5 m.
    assert 2.95 < x <= 3.0
    assert simulation.condition.troubles == ()


# Drops


@pytest.mark.parametrize("speed", [0.2, 0.7])
def test_robot_drives_down_a_step_of_10_cm_without_falling(speed: float) -> None:
    simulation = Simulation(
        world_of(deck(0.10)), config=BLIND, start=Pose.from_euler((0.3, 0.0, 0.10))
    )
    conditions = drive(simulation, speed, 2.0 / speed + 2.0)
    assert place(simulation)[2] == pytest.approx(0.0, abs=0.002)
    assert not any(c.fallen for c in conditions)
    assert any(c.wheels_down != ALL_DOWN for c in conditions)
    assert conditions[-1].wheels_down == ALL_DOWN


def deepest(simulation: Simulation) -> float:
    """Return how far any part of the robot is inside the ground [m]."""
    return max((-float(c.dist) for c in simulation._data.contact), default=0.0)


@pytest.mark.parametrize(
    ("height", "speed", "yaw"), [(0.15, 0.7, 45.0), (0.40, 0.2, 0.0), (1.0, 0.7, 45.0)]
)
def test_physics_stays_stable_in_a_drop_and_a_fall_is_reported(
    height: float, speed: float, yaw: float
) -> None:
    start = Pose.from_euler((0.3, 0.0, height), yaw=math.radians(yaw))
    simulation = Simulation(world_of(deck(height)), config=BLIND, start=start)
    simulation.command(Twist.planar(speed, 0.0))
    tilts, lowest, penetration = [], [], 0.0
    for _ in range(350):
        simulation.step()
        c = simulation.condition
        tilts.append(c.tilt)
        assert c.fallen == (c.tilt > math.radians(60.0))
        assert ("fallen" in c.troubles) == c.fallen
        lowest.append(place(simulation)[2])
        penetration = max(penetration, deepest(simulation))
        # Falling from a metre gives 4.4 m/s, and the wheels add theirs.
        assert np.linalg.norm(simulation.truth().twist.linear) < 6.0
    if height >= 0.40:
        assert max(tilts) > math.radians(60.0)
    assert min(lowest) > -0.01
    # Tyres are soft when they land; nothing sinks in for good.
    assert penetration < 0.06
    assert deepest(simulation) < 0.005


def test_robot_on_its_back_stays_there_and_keeps_reporting(field: World) -> None:
    on_its_back = Pose.from_euler((0.0, 0.0, 0.6), roll=math.pi)
    simulation = Simulation(field, config=BLIND, start=on_its_back)
    c = drive(simulation, 0.5, 3.0)[-1]
    assert c.fallen
    assert c.grounded
    assert c.troubles[0] == "fallen"
    assert not any(c.wheels_down)
    # It lies on the scanners and the plate, not in the ground.
    assert place(simulation)[2] > 0.3
    assert deepest(simulation) < 0.005
    assert np.linalg.norm(simulation.truth().twist.linear) < 0.02


# The underside


@pytest.mark.parametrize("name", sorted(PLATFORMS))
def test_the_underside_is_clear_of_level_ground_and_of_steps_that_wheels_can_take(
    name: str,
) -> None:
    robot = PLATFORMS[name]
    world = parse_world(BARE, name="bare", robot=robot)
    simulation = Simulation(world, config=BLIND)
    model = simulation._model
    front = 0.5 * robot.wheelbase + robot.wheel_radius
    for part in ("belly", "nose"):
        geom = model.geom(part)
        bottom, reach = geom.pos[2] - geom.size[2], geom.size[0]
        assert geom.contype[0] == FLOOR_BIT
        assert bottom >= robot.clearance - 1e-9
        # Whatever is lower than the wheels' centres meets the wheels first.
        assert reach < front or bottom > robot.wheel_radius
    assert model.body_mass[model.body("base_link").id] == pytest.approx(
        robot.mass - 4.0 * robot.wheel_mass
    )


@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.3, -0.2), (-1.0, 0.5), (3.0, 0.1)])
def test_attitude_is_that_of_rep_103(roll: float, pitch: float) -> None:
    pose = Pose.from_euler((0.0, 0.0, 0.0), roll=roll, pitch=pitch, yaw=1.0)
    found_roll, found_pitch, upright = attitude(pose.quaternion_wxyz)
    assert (found_roll, found_pitch) == pytest.approx((roll, pitch), abs=1e-9)
    assert upright == pytest.approx(float(pose.rotation[2, 2]), abs=1e-12)
