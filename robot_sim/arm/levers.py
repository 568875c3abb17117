"""How far the points of an arm move when its joints turn: a bound that holds in all its poses."""

from __future__ import annotations

import math

import numpy as np

from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.parts import JAWS, ArmBody, arm_bodies
from robot_sim.array_types import FloatArray


def levers(table: ArmTable, beyond: float = 0.0) -> FloatArray:
    """Return the greatest distance (5,) of any point of the arm that a joint moves from the joint's axis [m].

    A turn by d moves no point further than ``levers @ abs(d)``: each joint moves it at most along an arc about its axis.

    Args:
        table: The arm.
        beyond: Greatest distance of a point of what is held from the origin of the last joint [m].
    """
    bodies = {body.name: body for body in arm_bodies(table)}
    slide = 0.5 * table.gripper.opening
    reaches = [_reach(bodies[link.name]) for link in table.links[1:]]
    jaws = (_from(bodies[jaw].pose.apply(_corners(bodies[jaw], slide))) for jaw in JAWS)
    ball = max(beyond, reaches[-1][0], *jaws)
    found = [ball]
    for number in range(len(reaches) - 2, -1, -1):
        about_origin, about_axis = reaches[number]
        x, y, z = bodies[table.links[number + 2].name].pose.position
        found.append(max(about_axis, math.hypot(x, y) + ball))
        ball = max(about_origin, math.hypot(x, y, z) + ball)
    return np.array(found[::-1])


def _reach(body: ArmBody) -> tuple[float, float]:
    """Return the greatest distances of a body's corners from its origin and from its z axis [m]."""
    corners = _corners(body)
    return _from(corners), _from(corners[:, :2])


def _from(points: FloatArray) -> float:
    return float(np.linalg.norm(points, axis=1).max())


def _corners(body: ArmBody, slide: float = 0.0) -> FloatArray:
    """Return the corners (N, 3) of boxes about a body's solids in its frame; tubes have round ends."""
    found = []
    for solid in body.solids:
        if solid.shape == "cylinder":
            radius, length = solid.size
            half = np.array([radius, radius, radius + 0.5 * length])
        else:
            half = 0.5 * np.array(solid.size)
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        found.append(solid.pose.apply(signs * half))
    return np.vstack(found) + slide * np.array(body.slide or (0.0, 0.0, 0.0))
