"""Rows on the arm: the paper's torques, one geometry in three models, and what the arm does to the vehicle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.printed_torques import AGREEMENT, PRINTED
from robot_sim.arm.statics import Statics
from robot_sim.array_types import FloatArray
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.validation import friction_theory
from robot_sim.validation.arm_bench import (
    UPRIGHT,
    flat_moments,
    simulated,
    tipping,
    tips_apart,
    torques_apart,
)
from robot_sim.validation.drive_bench import DriveBench, HeldArm, chi, ramped
from robot_sim.validation.row import Row, within

POSES: Final = 2000
"""Number of random poses in which the three models are compared."""
MOTIONS: Final = 500
"""Number of random motions of which their torques are."""
_AHEAD: Final = (0.0, 0.0, 0.0, 0.0, 0.0)
_ASIDE: Final = (0.5 * math.pi, 0.0, 0.0, 0.0, 0.0)
_PAPER: Final = "the paper's"
_CLOSED: Final = "four Coulomb contacts, loads by lever, solved independently of MuJoCo"
_LEVER: Final = "the centre of mass above the lower wheels' contacts"


@dataclass(frozen=True, slots=True)
class Carriage:
    """A way to carry the arm."""

    name: str
    """For people."""
    mount: str
    """Where it is mounted."""
    angles: tuple[float, ...]
    """Its pose [rad]."""
    payload: float = 0.0
    """Mass at its tip [kg]."""


PLATE: Final = Carriage("ahead on the plate", "plate", _AHEAD)
"""The other mount."""
LOADED: Final = Carriage("ahead on the bracket, 100 g", "bracket", _AHEAD, 0.1)
"""More than it stands for long, outstretched: the worst that can be."""
ASIDE: Final = Carriage("aside on the bracket, 100 g", "bracket", _ASIDE, 0.1)
"""The same to the left."""
RATES: Final = (0.2, 2.0, 6.4)
"""Wheel rates in place [rad/s]: slow, common, and the fastest."""
_GROUP: Final = "The vehicle with the arm"


def models() -> Iterator[Row]:
    """Yield table 4, mass and reach, and how far the arm's three models are apart."""
    group, table = "The arm", load_arm()
    for n, (printed, moment) in enumerate(zip(PRINTED, flat_moments(table), strict=True), start=1):
        name = f"torque of link {n}, all links flat in one line"
        source = f"{_PAPER} table 4"
        yield within(
            group, name, printed, AGREEMENT, moment, unit="kgf cm", source=source, digits=4
        )
    arm = simulated(table)
    tip, shoulder = arm.tip(np.array(UPRIGHT)), arm.data.body(table.links[2].name)
    reach = 100.0 * float(np.linalg.norm(tip[:3, 3] - shoulder.xpos))
    mass = 1000.0 * float(arm.model.body(table.links[0].name).subtreemass[0])
    source = f"{_PAPER} table 2"
    yield Row(
        group, "reach from the shoulder", 41.19, 0.001, reach, unit="cm", source=source, digits=2
    )
    source = f"{_PAPER} tables 2 and 3"
    yield Row(group, "mass", 479.0, 0.001, mass, unit="g", source=source, digits=2)
    draw = np.random.default_rng(0)
    poses = draw.uniform(table.lower, table.upper, (POSES, 5))
    motions = np.stack(
        [poses[:MOTIONS], *draw.normal(0.0, [[[3.0]], [[20.0]]], (2, MOTIONS, 5))], 1
    )
    name = f"tips of matrices, simulation and URDF apart, the worst of {POSES} poses"
    source = "one table of numbers"
    apart = 1e12 * tips_apart(table, poses)
    yield Row(group, name, 0.0, 1.0, apart, unit="pm", source=source, digits=1)
    name = f"torques of simulation and URDF apart, the worst of {MOTIONS} motions"
    apart = 1e12 * torques_apart(table, motions)
    yield Row(group, name, 0.0, 1.0, apart, unit="pN m", source=source, digits=1)


def turning() -> Iterator[Row]:
    """Yield chi in place with the arm."""
    stowed = Carriage("stowed on the bracket", "bracket", load_arm().poses["stow"])
    for rate in RATES:
        yield _chi(stowed, rate)
    for carriage in (PLATE, LOADED, ASIDE):
        yield _chi(carriage, 2.0)


def _chi(carriage: Carriage, rate: float) -> Row:
    robot = P3AT()
    ahead, left, _ = _centre(robot, carriage).tolist()
    run = DriveBench(robot, arm=_held(carriage)).run(ramped(-rate, rate, 3.0)).after(1.0)
    target = friction_theory.turning_chi(robot, ahead, left)
    name = f"chi, arm {carriage.name}, wheels at {rate:g} rad/s"
    return within(_GROUP, name, target, 0.02, chi(robot, run), source=_CLOSED, digits=4)


def tipping_over() -> Iterator[Row]:
    """Yield the slopes at which the vehicle tips over, without the arm and with it downhill."""
    for carriage in (None, PLATE, LOADED):
        yield _slope(carriage, "facing down", (1.0, 0.0))
    for carriage in (None, ASIDE):
        yield _slope(carriage, "downhill to the left", (0.0, 1.0))


def _slope(carriage: Carriage | None, where: str, direction: tuple[float, float]) -> Row:
    robot = P3AT()
    centre = _centre(robot, carriage)
    lever = float((0.5 * np.array([robot.wheelbase, robot.track]) - centre[:2]) @ direction)
    target = math.degrees(friction_theory.tip_over(lever, float(centre[2])))
    arm = None if carriage is None else _held(carriage)
    value = math.degrees(tipping(robot, arm, direction, math.radians(target)))
    how = "without the arm" if carriage is None else f"arm {carriage.name}"
    name = f"slope at which it tips over, {where}, {how}"
    return within(_GROUP, name, target, 0.02, value, unit="deg", source=_LEVER, digits=1)


def _held(carriage: Carriage) -> HeldArm:
    return HeldArm(load_arm(), carriage.mount, carriage.angles, carriage.payload)


def _centre(robot: SkidSteer, carriage: Carriage | None) -> FloatArray:
    """Return the centre of mass (3,) of a robot with an arm in ``base_link`` [m]."""
    data = DriveBench(robot).data
    own: FloatArray = data.body("base_link").subtree_com.copy()
    if carriage is None:
        return own
    statics, mount = Statics(load_arm()), load_arm().mount(carriage.mount)
    angles = np.array(carriage.angles)
    mass, centre = statics.centre_of_mass(angles, payload=carriage.payload)
    both: FloatArray = (robot.mass * own + mass * mount.apply(centre)) / (robot.mass + mass)
    return both
