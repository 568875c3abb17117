"""What gravity asks of an arm's servos: holding torques in any attitude, and what the arm carries how far out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.arm.arm_table import KGF_CM, ArmTable
from robot_sim.arm.inverse import Vector, solutions
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.parts import ArmBody, BodyInertia, arm_bodies, inertial
from robot_sim.array_types import FloatArray

LEVEL: Final = (0.0, 0.0, -100.0 * KGF_CM)
"""Standard gravity in ``arm_base`` where the vehicle stands level [m/s^2]: what the unit kgf is made of."""
STEEPEST: Final = 60
"""How steep the gripper may point where the payload is asked for [deg]: the steeper, the less its joint bears."""


@dataclass(frozen=True, slots=True, eq=False)
class Holding:
    """What holds an arm still."""

    torques: FloatArray
    """(..., 5) of each servo, in the sense of its joint's angle [N m]."""
    moments: FloatArray
    """(..., 5, 3) that the arm bears at each servo, in ``arm_base``; its part about the joint's axis is the torque."""


@dataclass(frozen=True, slots=True)
class Payload:
    """What an arm carries at its tip in the best posture."""

    mass: float
    """[kg]; below zero if it does not hold even itself, NaN out of reach."""
    joint: str
    """The joint that bears no more."""


class Statics:
    """Holding torques of an arm; its masses are those of ``parts``."""

    def __init__(self, table: ArmTable) -> None:
        """Find where its masses are."""
        self.table = table
        bodies = {body.name: body for body in arm_bodies(table)}
        links = [bodies[link.name] for link in table.links]
        jaws = [body for body in bodies.values() if body.slide is not None]
        self._masses = [inertial(link) for link in links[1:-1]]
        self._masses.append(_together(links[-1], jaws))
        self._base = inertial(links[0])
        # The servo of a joint sits on the link before it.
        self._places = [_servo_place(link) for link in links[:-1]]

    def holding(
        self, angles: FloatArray, *, payload: float = 0.0, gravity: Vector = LEVEL
    ) -> Holding:
        """Return what holds the arm in poses.

        Args:
            angles: (..., 5) of the joints [rad].
            payload: Mass at the tip [kg].
            gravity: (3,) in ``arm_base`` [m/s^2]; not downwards there if the vehicle is tilted.
        """
        angles = np.asarray(angles, dtype=float)
        centres, places, axes, tip = self._walk(angles)
        moments = np.zeros((*angles.shape[:-1], 5, 3))
        for joint in range(5):
            for centre, link in zip(centres[joint:], self._masses[joint:], strict=True):
                moments[..., joint, :] += link.mass * (centre - places[joint])
            moments[..., joint, :] += payload * (tip - places[joint])
        # What holds masses m at r against gravity g is the sum of m r x (-g).
        moments = np.cross(moments, -np.asarray(gravity, dtype=float))
        return Holding((moments * np.stack(axes, axis=-2)).sum(axis=-1), moments)

    def centre_of_mass(
        self, angles: FloatArray, *, payload: float = 0.0
    ) -> tuple[float, FloatArray]:
        """Return mass [kg] and centre of mass (..., 3) in ``arm_base`` [m] of the arm, with a payload [kg] at its tip."""
        centres, _, _, tip = self._walk(np.asarray(angles, dtype=float))
        masses = [self._base.mass, *(link.mass for link in self._masses), payload]
        places = [self._base.centre, *centres, tip]
        moment = sum((m * place for m, place in zip(masses, places, strict=True)), np.zeros(3))
        return sum(masses), moment / sum(masses)

    def _walk(
        self, angles: FloatArray
    ) -> tuple[list[FloatArray], list[FloatArray], list[FloatArray], FloatArray]:
        """Return centres of mass of links 1 to 5, places and axes of the joints, and the tip; each (..., 3)."""
        poses = angles.shape[:-1]
        rotation: FloatArray = np.broadcast_to(np.eye(3), (*poses, 3, 3))
        origin: FloatArray = np.zeros((*poses, 3))
        shift = np.array([0.0, 0.0, self.table.links[0].length])
        alpha = 0.0
        centres, places, axes = [], [], []
        for k, joint in enumerate(self.table.joints):
            places.append(origin + rotation @ self._places[k])
            # First the end of the link before, by its a, d and alpha; then this joint's turn.
            origin, rotation = origin + rotation @ shift, rotation @ _about_x(alpha)
            rotation = rotation @ _about_z(angles[..., k] + joint.theta)
            centres.append(origin + rotation @ self._masses[k].centre)
            axes.append(rotation[..., 2])
            shift, alpha = np.array([joint.a, 0.0, joint.d]), joint.alpha
        return centres, places, axes, origin + rotation @ shift


def payloads(
    table: ArmTable,
    reach: float,
    limits: Sequence[Sequence[float]],
    *,
    elevations: Iterable[float] = range(-STEEPEST, STEEPEST + 1, 5),
    step: float = 0.01,
) -> tuple[Payload, ...]:
    """Return what the arm carries so far out, in the best of its postures at any height.

    Args:
        table: The arm.
        reach: Horizontal distance of the tip from the shoulder [m].
        limits: (K, 5) torques that the servos may bear [N m].
        elevations: Of the gripper, among which the best is taken [deg].
        step: Distance of the heights that are tried [m].

    Returns:
        One for each of the K limits.
    """
    kinematics, statics = Kinematics(table), Statics(table)
    shoulder = table.links[0].length + table.joints[0].d
    count = math.ceil(straight_reach(table) / step)
    heights = [shoulder + step * k for k in range(-count, count + 1)]
    found = [
        solutions(kinematics, (reach, 0.0, height), (math.cos(up), 0.0, math.sin(up)))
        for up in map(math.radians, elevations)
        for height in heights
    ]
    angles = np.concatenate(found)
    own = statics.holding(angles).torques
    more = statics.holding(angles, payload=1.0).torques - own
    return tuple(_best(table, own, more, np.array(limit)) for limit in limits)


def straight_reach(table: ArmTable) -> float:
    """Return the distance from the shoulder to the tip of the stretched arm [m]."""
    return sum(link.length for link in table.links[2:])


def stall_torques(table: ArmTable, supply: float) -> tuple[float, ...]:
    """Return the stall torque of each joint's servo at a supply voltage [V], in N m."""
    return tuple(joint.servo.torque(supply) for joint in table.joints)


def _best(table: ArmTable, own: FloatArray, more: FloatArray, limit: FloatArray) -> Payload:
    """Return the largest payload of postures with their own torques and those of each kg, both (N, 5)."""
    if len(own) == 0:
        return Payload(math.nan, "")
    idle = np.abs(more) < 1e-9
    slope = np.where(idle, 1.0, more)
    ends = np.stack([(limit - own) / slope, (-limit - own) / slope])
    most = np.where(idle, np.where(np.abs(own) <= limit, np.inf, -np.inf), ends.max(axis=0))
    least = np.where(idle, -np.inf, ends.min(axis=0)).max(axis=1)
    # In some postures no payload is right for all joints at once.
    carried = np.where(least <= most.min(axis=1), most.min(axis=1), -np.inf)
    best = int(carried.argmax())
    return Payload(float(carried[best]), table.joints[int(most[best].argmin())].name)


def _together(hand: ArmBody, jaws: Sequence[ArmBody]) -> BodyInertia:
    """Return the last link with its jaws, whose opening does not shift their centre."""
    parts = [(inertial(hand), np.zeros(3), np.eye(3))]
    parts += [(inertial(jaw), jaw.pose.position, jaw.pose.rotation) for jaw in jaws]
    mass = sum(part.mass for part, _, _ in parts)
    moment = sum((p.mass * (at + turned @ p.centre) for p, at, turned in parts), np.zeros(3))
    return BodyInertia(mass, moment / mass, np.zeros((3, 3)))


def _servo_place(link: ArmBody) -> FloatArray:
    return next(s.pose.position for s in link.solids if s.name == "servo")


def _about_x(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _about_z(angles: FloatArray) -> FloatArray:
    """Return rotations (..., 3, 3)."""
    c, s = np.cos(angles), np.sin(angles)
    turned = np.zeros((*np.shape(angles), 3, 3))
    turned[..., 0, 0], turned[..., 0, 1] = c, -s
    turned[..., 1, 0], turned[..., 1, 1] = s, c
    turned[..., 2, 2] = 1.0
    return turned
