"""Boxes in the arm's jaws: picked up while the robot stands, and carried over ten metres and three turns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.common.figures import Figure, share
from localization.types import Twist
from robot_sim import Simulation, SimulationConfig, World, WorldOptions, parse_world
from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.inverse import solutions
from robot_sim.arm.kinematics import Kinematics
from robot_sim.array_types import FloatArray

ARM = load_arm()
PICKS = 40
ASKEW = (15.0, 35.0)
"""Greatest yaws of a box against the gripper [deg]; the second is more than a person would try."""
MASSES = (0.01, 0.02, 0.04)
"""Masses of the boxes that are carried [kg]."""
CARRYING = ((0, 100, -110, 0, -20), (0, 30, -100, 0, 0), (0, 0, 0, 0, 0))
"""Poses in which a box is carried [deg]: bent high, folded, and outstretched."""
RATES = (0.6, 1.14)
"""Rates of the turns [rad/s]: the greatest with something in hand, and what made a first model lose its box."""
CASE = "box of 30 mm"
PLAN = """
bounds = [-20.0, -20.0, 20.0, 20.0]
spawn = [0.0, 0.0, 0.0]
ceiling = false
[[furniture]]
type = "box"
name = "crate"
at = [{behind}, {y}]
size = [0.24, 0.6, {z}]
[[parcel]]
name = "parcel"
at = [{x}, {y}]
z = {z}
yaw = {yaw}
mass = {mass}
"""


@dataclass(frozen=True)
class Place:
    """Where a box stands, on a crate before the robot, and how the gripper comes at it."""

    x: float = 0.58
    y: float = 0.0
    z: float = 0.30
    askew: float = 0.0
    """Its yaw against the way the gripper comes [deg]."""
    mass: float = 0.02
    """[kg]."""
    down: float = 30.0
    """Angle by which the gripper points down [deg]."""

    def world(self) -> World:
        """Return a world with it."""
        yaw = math.degrees(self.aside) + self.askew
        text = PLAN.format(
            behind=self.x + 0.1, x=self.x, y=self.y, z=self.z, yaw=yaw, mass=self.mass
        )
        return parse_world(text, name="crate", options=WorldOptions(arm="s2"))

    @property
    def aside(self) -> float:
        """Direction from the arm to the box [rad]."""
        return math.atan2(self.y, self.x - ARM.mount("bracket").position[0])


@dataclass
class Picker:
    """A robot whose arm follows a script: minimum-jerk moves, the wanted angles by the closed form."""

    world: World

    def __post_init__(self) -> None:
        self.simulation = Simulation(self.world, config=SimulationConfig(scanners=()))
        assert self.simulation.arm is not None
        self.arm, self.kinematics = self.simulation.arm, Kinematics(ARM)
        self.wanted, self.opening = np.array(ARM.poses["stow"]), 0.0
        self.lost = 0
        """Ticks in which nothing was held while driving."""

    def wait(self, seconds: float) -> None:
        """Stand still, or drive on."""
        for _ in range(round(50 * seconds)):
            self.arm.command(self.wanted, self.opening)
            self.simulation.step()
            self.lost += not self.arm.reading.held

    def drive(self, forward: float, turn: float, seconds: float) -> None:
        """Drive for a time, and stop."""
        self.simulation.command(Twist.planar(forward, turn))
        self.wait(seconds)
        self.simulation.command(Twist.planar(0.0, 0.0))
        self.wait(0.8)

    def angles(self, position: FloatArray, pointing: FloatArray) -> FloatArray:
        """Return the angles nearest to the present ones that bring the tip somewhere in ``base_link``.

        Raises:
            ValueError: None do.
        """
        mount = ARM.mount("bracket")
        there = mount.inverse()
        found = solutions(
            self.kinematics, there.rotation @ position + there.position, there.rotation @ pointing
        )
        if not len(found):
            raise ValueError("out of reach")
        nearest: FloatArray = found[np.argmin(np.abs(found - self.wanted).max(axis=1))]
        return nearest

    def go(self, goal: FloatArray, rate: float = 1.5) -> None:
        """Move the joints together, none faster than a rate [rad/s]."""
        start = self.wanted
        for s in _minimum_jerk(max(0.3, 1.875 * float(np.abs(goal - start).max()) / rate)):
            self.wanted = start + s * (goal - start)
            self.wait(0.02)

    def line(
        self, start: FloatArray, end: FloatArray, pointing: FloatArray, seconds: float
    ) -> None:
        """Move the tip along a line in ``base_link``."""
        for s in _minimum_jerk(seconds):
            self.wanted = self.angles(start + s * (end - start), pointing)
            self.wait(0.02)

    def pick(self, place: Place) -> bool:
        """Take the box up by 8 cm; return whether it is held then."""
        aside, down = place.aside, math.radians(place.down)
        pointing = np.array(
            [math.cos(down) * math.cos(aside), math.cos(down) * math.sin(aside), -math.sin(down)]
        )
        # A little above the middle, so that the fingers keep off the crate.
        at = np.array([place.x, place.y, place.z + 0.019]) + 0.012 * pointing
        self.opening = ARM.gripper.opening
        self.go(self.angles(at - 0.06 * pointing, pointing))
        self.wait(0.3)
        self.line(at - 0.06 * pointing, at, pointing, 0.8)
        self.wait(0.3)
        self.opening = 0.0
        self.wait(0.8)
        self.line(at, at + np.array([0.0, 0.0, 0.08]), pointing, 0.8)
        self.wait(0.2)
        return self.arm.reading.held == "parcel"

    @property
    def in_hand(self) -> FloatArray:
        """Where the box is, in ``tool0`` [mm]."""
        data = self.simulation._data
        tool = data.body("tool0")
        where: FloatArray = tool.xmat.reshape(3, 3).T @ (data.body("parcel").xpos - tool.xpos)
        return 1e3 * where


def _minimum_jerk(seconds: float) -> Iterator[float]:
    ticks = max(1, round(50 * seconds))
    for tick in range(1, ticks + 1):
        u = tick / ticks
        yield 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5


def picked(seed: int, askew: float = ASKEW[0]) -> tuple[bool, float]:
    """Pick up a box somewhere in reach, swing it by 46 degrees and back, and hold it for 2 s.

    Args:
        seed: Seed of where it stands, of its mass and of how the gripper comes.
        askew: Its greatest yaw against the gripper [deg].

    Returns:
        Whether it was held all the time, and how far it slipped in the hand [mm].
    """
    rng = np.random.default_rng(seed)
    while True:
        place = Place(
            x=rng.uniform(0.52, 0.64),
            y=rng.uniform(-0.08, 0.08),
            z=rng.uniform(0.08, 0.45),
            askew=rng.uniform(-askew, askew),
            mass=rng.uniform(0.01, 0.04),
            down=rng.uniform(15.0, 45.0),
        )
        picker = Picker(place.world())
        try:
            held = picker.pick(place)
        except ValueError:
            continue  # drawn out of reach
        break
    before, wanted = picker.in_hand, picker.wanted
    swing = np.array([math.copysign(math.radians(46.0), -wanted[0]), 0.0, 0.0, 0.0, 0.0])
    picker.lost = 0
    picker.go(wanted + swing)
    picker.go(wanted)
    picker.wait(2.0)
    slip = float(np.linalg.norm(picker.in_hand - before))
    return held and picker.lost == 0, slip


def carried(
    mass: float, pose: Sequence[float], rate: float, *, metres: float = 10.0, turns: int = 3
) -> tuple[bool, float]:
    """Carry a box in a pose [deg] over so many metres and turns by 90 degrees at a rate [rad/s].

    Returns:
        Whether it was held all the time, and how far it slipped in the hand [mm].
    """
    place = Place(mass=mass)
    picker = Picker(place.world())
    if not picker.pick(place):
        return False, math.inf
    # Away from the crate, and past it.
    picker.drive(-0.3, 0.0, 3.0)
    picker.go(np.radians(pose))
    picker.drive(0.0, 0.3, math.radians(90.0) / 0.3)
    before, picker.lost = picker.in_hand, 0
    for leg in range(turns + 1):
        picker.drive(0.5, 0.0, metres / (turns + 1) / 0.5)
        if leg < turns:
            picker.drive(0.0, rate, math.radians(90.0) / rate)
    return picker.lost == 0, float(np.linalg.norm(picker.in_hand - before))


def grasps() -> Iterator[Figure]:
    """Measure picks of a standing robot, and boxes that are carried."""
    for askew in ASKEW:
        found = [picked(seed, askew) for seed in range(PICKS)]
        slips = np.array([slip for _, slip in found])
        name = f"picked up, swung and held 2 s, up to {askew:g} degrees askew"
        goal = 100.0 if askew == ASKEW[0] else None
        yield share(CASE, name, "held", sum(held for held, _ in found), PICKS, least=goal)
        yield Figure(CASE, name, "slip p50", float(np.median(slips)), "mm", PICKS)
        yield Figure(CASE, name, "slip, most", float(slips.max()), "mm", PICKS)
    for rate in RATES:
        trips = [carried(mass, pose, rate) for mass in MASSES for pose in CARRYING]
        name = f"carried 10 m and three turns at {rate:g} rad/s"
        good, far = sum(held for held, _ in trips), max(slip for _, slip in trips)
        # Only the slower of both is allowed while something is held.
        goal = rate == RATES[0]
        yield share(CASE, name, "held", good, len(trips), least=100.0 if goal else None)
        yield Figure(CASE, name, "slip, most", far, "mm", len(trips), most=10.0 if goal else None)
