"""Angles that bring the tip to a pose, nearest first, or why there are none."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.inverse import branches, solutions
from robot_sim.arm.kinematics import Kinematics

_ROLL, _PITCH = 3, 4
_IN_LINE: Final = 1e-6
"""Pitch of the wrist below which the gripper is in line with the forearm, and the roll free [rad]."""


def tip_goals(
    kinematics: Kinematics, position: FloatArray, pointing: FloatArray, standing: FloatArray
) -> FloatArray | str:
    """Return all angles (N, 5) within limits for a pose of the tip, the nearest to where the arm stands first.

    Args:
        kinematics: The arm.
        position: (3,) of the tip, in ``arm_base`` [m].
        pointing: (3,) direction of the gripper in ``arm_base``.
        standing: Angles of the arm (5,) [rad].

    Returns:
        The angles; or, for people, why there are none.

    Raises:
        ArmError: If a number is not finite, or ``pointing`` has no length.
    """
    found = solutions(kinematics, position, pointing)
    if not len(found):
        return _why_not(kinematics, position, pointing)
    in_line = np.abs(found[:, _PITCH]) < _IN_LINE
    found[in_line, _ROLL] = standing[_ROLL]
    order = np.argsort(np.linalg.norm(found - standing, axis=1), kind="stable")
    nearest: FloatArray = found[order]
    return nearest


def _why_not(kinematics: Kinematics, position: FloatArray, pointing: FloatArray) -> str:
    table = kinematics.table
    reachable = branches(kinematics, position, pointing)
    if not len(reachable):
        upper, forearm, hand = (table.joints[k].a + table.joints[k].d for k in (1, 3, 4))
        shoulder = np.array([0.0, 0.0, table.links[0].length + table.joints[0].d])
        ahead = np.asarray(pointing) / np.linalg.norm(pointing)
        away = float(np.linalg.norm(np.asarray(position) - hand * ahead - shoulder))
        if away > upper + forearm:
            return f"the tip would be {100.0 * (away - upper - forearm):.1f} cm out of reach"
        near = abs(upper - forearm) - away
        return f"the wrist would be {100.0 * near:.1f} cm too near to the shoulder"
    beyond = np.maximum(reachable - table.upper, np.array(table.lower) - reachable)
    best = int(beyond.max(axis=1).argmin())
    worst = int(beyond[best].argmax())
    joint = table.joints[worst]
    limit = joint.upper if reachable[best, worst] > joint.upper else joint.lower
    return (
        f"{joint.name} ({joint.turns}) would be at {math.degrees(reachable[best, worst]):.0f} degrees;"
        f" its limit is {math.degrees(limit):.0f}"
    )
