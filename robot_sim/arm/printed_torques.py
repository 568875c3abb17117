"""The paper's static torques: its formulas and table 4, and where it is misprinted.

*Simulation And Real Time Of VR Controlled Robotic Manipulator Using ROS*, section VI. All five links lie in one horizontal
line; masses of links act at half their length, those of servos at the joints. Torques are in kgf cm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.arm.arm_table import ArmTable
from robot_sim.array_types import FloatArray

PRINTED: Final = (6.236, 4.750, 1.628, 0.531, 0.332)
"""Table 4: torques of links 1 to 5 [kgf cm]."""
AGREEMENT: Final = 0.002
"""Share within which it can be met: one of its rows is rounded, another cut off."""

Torques = tuple[float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Misprint:
    """A place where the paper contradicts itself or mechanics."""

    place: str
    """Where it is."""
    printed: str
    """What is printed there."""
    read: str
    """What we read instead."""
    shown: str
    """What shows it, in figures."""


def paper_torques(table: ArmTable) -> Torques:
    """Return tau 1 to tau 5 [kgf cm] by the paper's formulas, as we read them."""
    _, l1, l2, l3, l4, l5 = (100.0 * link.length for link in table.links)
    _, w1, w2, w3, w4, w5 = (link.mass for link in table.links)
    _, j2, j3, j4, j5 = (joint.servo.mass for joint in table.joints)
    t5 = l5 / 2 * w5
    t4 = l4 / 2 * w4 + (l4 + l5 / 2) * w5 + l4 * j5
    t3 = l3 / 2 * w3 + (l3 + l4 / 2) * w4 + (l3 + l4 + l5 / 2) * w5 + (l3 + l4) * j5 + l3 * j4
    t2 = l2 / 2 * w2 + (l2 + l3 / 2) * w3 + (l2 + l3 + l4 / 2) * w4
    t2 += (l2 + l3 + l4 + l5 / 2) * w5 + l2 * j3 + (l2 + l3) * j4 + (l2 + l3 + l4) * j5
    t1 = l1 / 2 * w1 + (l1 + l2 / 2) * w2 + (l1 + l2 + l3 / 2) * w3 + (l1 + l2 + l3 + l4 / 2) * w4
    t1 += (l1 + l2 + l3 + l4 + l5 / 2) * w5 + l1 * j2 + (l1 + l2) * j3
    t1 += (l1 + l2 + l3) * j4 + (l1 + l2 + l3 + l4) * j5
    return t1, t2, t3, t4, t5


def first_torque_as_printed(table: ArmTable) -> float:
    """Return tau 1 [kgf cm] with the first term as printed: half of link 2's length for link 1's mass."""
    (_, one, two, *_), mass = table.links, table.links[1].mass
    return paper_torques(table)[0] + 50.0 * (two.length - one.length) * mass


def printed_matrix(theta: float, alpha: float, r: float, d: float) -> FloatArray:
    """Return the paper's homogeneous matrix (4, 4) as it is printed, with row 2, column 3 of the wrong sign."""
    ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array(
        [
            [ct, -st * ca, st * sa, r * ct],
            [st, ct * ca, ct * sa, r * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def misprints(table: ArmTable) -> tuple[Misprint, ...]:
    """Return the misprints of matrix, formulas and table 4, with our figures beside them."""
    one, _, three, four, _ = paper_torques(table)
    joints = table.joints
    determinant = np.linalg.det(printed_matrix(math.radians(60.0), joints[0].alpha, 0.0, 0.0))
    swapped = three + 100.0 * table.links[3].length * (joints[4].servo.mass - joints[3].servo.mass)
    as_printed = first_torque_as_printed(table)
    return (
        Misprint(
            "homogeneous matrix, row 2, column 3",
            "cos(theta) sin(alpha)",
            "-cos(theta) sin(alpha)",
            f"as printed it is no rotation: its determinant is {determinant:.2f} at joint 1 = 60 deg",
        ),
        Misprint(
            "torque of link 1, first term",
            "L2/2 w1",
            "L1/2 w1",
            f"{one:.4f}, which rounds to the table's {PRINTED[0]}; as printed {as_printed:.3f}",
        ),
        Misprint(
            "torque of link 3, last term",
            "L3 joint 5",
            "L3 joint 4",
            f"joint 4 sits where link 3 ends; the servos weigh the same, so both give {swapped:.4f}",
        ),
        Misprint("torque of link 4, last term", "w of 'joint'", "joint 5", "it ends link 4"),
        Misprint(
            "table 4, link 4",
            f"{PRINTED[3]}",
            f"{four:.3f}",
            f"{four:.5f} is cut off, while link 1 is rounded",
        ),
        Misprint(
            "table 4, link 1",
            "a torque of joint 1",
            "a bending moment",
            "joint 1 turns about the vertical: gravity asks 0 of its servo",
        ),
        Misprint(
            "table 4, link 4",
            "a torque of joint 4",
            "a bending moment",
            "joint 4 rolls about the forearm: gravity asks 0 of its servo while the wrist is straight",
        ),
        Misprint(
            "tables 2 to 4, units",
            "weight in kg, torque in kg cm",
            "mass in kg, torque in kgf cm",
            "1 kgf cm = 0.0980665 N m",
        ),
    )
