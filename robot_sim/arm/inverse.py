"""Inverse kinematics of an arm in closed form: all angles that bring its tip to a place, pointing in a direction.

Joints turn yaw, shoulder, elbow, wrist roll and wrist pitch, and the last two axes meet in the wrist. So the wrist must be
a gripper's length behind the tip; two links in a vertical plane reach it with the arm's front or back and the elbow up or
down (2 x 2), and the wrist then points as it is or turned over (x 2): eight branches. The turn of the gripper about its own
axis cannot be chosen.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from robot_sim.arm.kinematics import Kinematics
from robot_sim.array_types import FloatArray
from robot_sim.errors import ArmError

_NEAR: Final = 1e-9
"""Where the wrist is so near to the base's axis [m], or the gripper in line with the forearm [rad], an angle is free."""
_BENT: Final = 1e-6
"""Where the elbow bends less [rad], it is straight: the wrist is off by less than 1e-13 m."""
_BEYOND: Final = 1e-12
"""Rounding of a cosine by which a wrist may seem out of reach."""

Vector = FloatArray | Sequence[float]


def branches(kinematics: Kinematics, position: Vector, pointing: Vector) -> FloatArray:
    """Return all joint angles (N, 5) [rad] in [-pi, pi] that reach a goal, whatever the limits.

    Args:
        kinematics: The arm.
        position: (3,) of the tip, in ``arm_base`` [m].
        pointing: (3,) direction of the gripper in ``arm_base``, of any length.

    Returns:
        Eight, fewer where elbow or wrist is straight, none out of reach. Where the gripper is in line with the
        forearm, the roll of the wrist is free, and is 0; where the wrist is above the base, the yaw is free, and turns
        the arm to where the gripper points.

    Raises:
        ArmError: If a number is not finite, or ``pointing`` has no length.
    """
    x, y, z = _three("position", position)
    ux, uy, uz = _three("pointing", pointing)
    length = math.hypot(ux, uy, uz)
    if not 1e-6 <= length <= 1e6:
        raise ArmError(f"pointing must have a length, got {[ux, uy, uz]}; try 1 0 0")
    ux, uy, uz = ux / length, uy / length, uz / length
    table = kinematics.table
    shoulder = table.links[0].length + table.joints[0].d
    hand = table.joints[4].a
    wrist = x - hand * ux, y - hand * uy, z - hand * uz - shoulder
    offsets = [joint.theta for joint in table.joints]
    found = []
    for yaw, upper, forearm in _elbows(kinematics, *wrist, yaw_if_free=_yaw(ux, uy)):
        # The pointing along the axes of frame 3: z along the forearm, x up where it lies ahead, y across.
        ahead = ux * math.cos(yaw) + uy * math.sin(yaw)
        across = ux * math.sin(yaw) - uy * math.cos(yaw)
        up = uz * math.cos(forearm) - ahead * math.sin(forearm)
        along = ahead * math.cos(forearm) + uz * math.sin(forearm)
        elbow = forearm + 0.5 * math.pi - upper
        for roll, pitch in _wrists(up, across, along, offsets[3]):
            angles = yaw, upper, elbow, roll, pitch
            found.append([_wrapped(a - b) for a, b in zip(angles, offsets, strict=True)])
    return np.array(found).reshape(-1, 5)


def solutions(kinematics: Kinematics, position: Vector, pointing: Vector) -> FloatArray:
    """Return those of the ``branches`` (N, 5) [rad] that are within the joints' limits."""
    found = branches(kinematics, position, pointing)
    within: FloatArray = np.clip(found, kinematics.table.lower, kinematics.table.upper)
    kept: FloatArray = within[np.abs(within - found).max(axis=1, initial=0.0) < _NEAR]
    return kept


def _elbows(
    kinematics: Kinematics, x: float, y: float, z: float, yaw_if_free: float
) -> Iterator[tuple[float, float, float]]:
    """Yield yaw and the elevations of upper arm and forearm for a wrist, seen from the shoulder."""
    upper, forearm = kinematics.table.joints[1].a, kinematics.table.joints[3].d
    reach = math.hypot(x, y)
    # Law of cosines; without a bend the arm is straight.
    cos = (x * x + y * y + z * z - upper * upper - forearm * forearm) / (2.0 * upper * forearm)
    if not abs(cos) <= 1.0 + _BEYOND:
        return
    bend = math.acos(max(-1.0, min(1.0, cos)))
    yaw = yaw_if_free if reach < _NEAR else math.atan2(y, x)
    bends = (bend, -bend) if math.sin(bend) > _BENT else (0.0 if cos > 0.0 else math.pi,)
    # Turned by 180 degrees, the arm reaches back over its shoulder to the same wrist.
    for turn, out in ((yaw, reach), (yaw + math.pi, -reach)):
        for elbow in bends:
            # Between the upper arm and the line from shoulder to wrist.
            inner = math.atan2(forearm * math.sin(elbow), upper + forearm * math.cos(elbow))
            elevation = math.atan2(z, out) - inner
            yield turn, elevation, elevation + elbow


def _wrists(
    up: float, across: float, along: float, straight: float
) -> Iterator[tuple[float, float]]:
    """Yield roll and pitch of the wrist, as Denavit-Hartenberg angles, for a direction in frame 3.

    The direction is (cos pitch cos roll, cos pitch sin roll, -sin pitch).
    """
    aside = math.hypot(up, across)
    if aside < _NEAR:
        yield straight, math.atan2(-along, aside)
        return
    yield math.atan2(across, up), math.atan2(-along, aside)
    yield math.atan2(-across, -up), math.atan2(-along, -aside)


def _yaw(ux: float, uy: float) -> float:
    return math.atan2(uy, ux) if math.hypot(ux, uy) > _NEAR else 0.0


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)


def _three(name: str, vector: Vector) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    if not math.isfinite(x + y + z):
        raise ArmError(f"{name} must be finite, got {[x, y, z]}")
    return x, y, z
