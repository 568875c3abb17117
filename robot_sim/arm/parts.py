"""Bodies of an arm: where each of its masses and shapes sits. Its models for MuJoCo and for ROS are both made of these.

A body's frame lies on the axis of the joint that moves it: it is the Denavit-Hartenberg frame before that joint, turned
by the joint's angle and its offset theta. Links are rods, whose masses so act at half their length; servos sit at the
joints, on the link before; the gripper's three parts together weigh what the last link does, at half its length.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from localization.types import Pose
from robot_sim.arm.arm_table import ArmTable, Gripper, Joint, Link, Servo
from robot_sim.array_types import FloatArray
from robot_sim.errors import ArmError

ARM_BASE: Final = "arm_base"
"""Body that is mounted on the vehicle."""
TOOL: Final = "tool0"
"""Frame at the tip: x along the gripper, z up where the arm lies straight ahead."""
JAWS: Final = ("arm_jaw_left", "arm_jaw_right")
"""The jaws; their frame is ``tool0`` while they are closed."""

_PALM_LENGTH: Final = 0.02
"""Length of the palm, which ends where the fingers begin [m]: long enough for the servo that moves them."""

_ALONG_X: Final = Pose.from_euler((0.0, 0.0, 0.0), pitch=0.5 * math.pi)
_TOOL_UP: Final = Pose.from_euler((0.0, 0.0, 0.0), roll=-0.5 * math.pi)
"""``frame_5_from_tool0``."""

Direction = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Solid:
    """A shape with a mass spread evenly within it."""

    name: str
    """``tube``, ``servo``, ``palm``, ``finger`` or ``pad``."""
    shape: Literal["cylinder", "box"]
    """A cylinder's axis is z."""
    size: tuple[float, ...]
    """Radius and length of a cylinder; length, width and height of a box [m]."""
    pose: Pose
    """``body_from_solid``."""
    mass: float
    """[kg]."""


@dataclass(frozen=True, slots=True)
class ArmBody:
    """A rigid part of the arm."""

    name: str
    """Name of body and frame."""
    parent: str
    """Body on which it sits; of ``arm_base`` ``base_link``."""
    pose: Pose
    """``parent_from_body`` while its joint is at zero; the identity for ``arm_base``, which a mount places."""
    joint: Joint | None
    """The joint that turns it about its z, if one does."""
    slide: Direction | None
    """Direction in its own frame in which it slides by half the gripper's opening, if it is a jaw."""
    solids: tuple[Solid, ...]
    """What it is made of; nothing for ``tool0``."""


@dataclass(frozen=True, slots=True)
class BodyInertia:
    """Mass of a body."""

    mass: float
    """[kg]."""
    centre: FloatArray
    """(3,) centre of mass in the body's frame [m]."""
    tensor: FloatArray
    """(3, 3) inertia about the centre of mass, along the body's axes [kg m^2]."""


def arm_bodies(table: ArmTable) -> tuple[ArmBody, ...]:
    """Return ``arm_base``, links 1 to 5, ``tool0`` and the jaws, each behind its parent.

    Raises:
        ArmError: If the jaws are too heavy for the last link's mass to act at half its length.
    """
    base, upright, upper, forearm, wrist, hand = table.links
    ends = (_translation(z=base.length), *(_end(joint) for joint in table.joints))
    servos = [_servo(j.servo, end) for j, end in zip(table.joints, ends[:-1], strict=True)]
    # Joint 4 turns about the forearm, and its servo sits where link 3 ends and link 4 begins.
    along_forearm = Pose(np.zeros(3), ends[3].quaternion_wxyz)
    split = _translation(z=forearm.length)
    servos[3] = _servo(table.joints[3].servo, along_forearm @ split)
    solids = (
        (_rod(base, Pose.identity()), servos[0]),
        (_rod(upright, Pose.identity()), servos[1]),
        (_rod(upper, _ALONG_X), servos[2]),
        (_rod(forearm, along_forearm), servos[3]),
        (_rod(wrist, split), servos[4]),
        _hand(hand, table.gripper, table.name),
    )
    turns = (_turned(end, j) for end, j in zip(ends, table.joints, strict=False))
    names, poses = [link.name for link in table.links], (Pose.identity(), *turns)
    parents, joints = ("base_link", *names), (None, *table.joints)
    links = (
        ArmBody(name, parent, pose, joint, None, of)
        for name, parent, pose, joint, of in zip(
            names, parents[:-1], poses, joints, solids, strict=True
        )
    )
    tip, last = ends[-1] @ _TOOL_UP, names[-1]
    sides = zip(JAWS, (1.0, -1.0), strict=True)
    jaws = (ArmBody(n, last, tip, None, (0.0, s, 0.0), _jaw(table.gripper, s)) for n, s in sides)
    return (*links, ArmBody(TOOL, last, tip, None, None, ()), *jaws)


def placed(body: ArmBody, angles: Mapping[str, float], opening: float) -> Pose:
    """Return ``parent_from_body`` as the URDF has it: turned by its joint, or slid by half the gripper's opening.

    Args:
        body: Body of the arm.
        angles: Of all joints by name [rad].
        opening: Distance of the jaws [m].
    """
    yaw = 0.0 if body.joint is None else angles[body.joint.name]
    slide = 0.5 * opening * np.array(body.slide or (0.0, 0.0, 0.0))
    return body.pose @ Pose.from_euler(slide, yaw=yaw)


def inertial(body: ArmBody) -> BodyInertia:
    """Return mass, centre of mass and inertia of a body that is made of something."""
    mass = sum(solid.mass for solid in body.solids)
    centre = sum((s.mass * s.pose.position for s in body.solids), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for solid in body.solids:
        axes, offset = solid.pose.rotation, solid.pose.position - centre
        own = axes * _moments(solid) @ axes.T
        # The parallel axis theorem.
        tensor += own + solid.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return BodyInertia(mass, centre, 0.5 * (tensor + tensor.T))


def _moments(solid: Solid) -> FloatArray:
    """Return the principal moments (3,) of an even cylinder about z, or of an even box [kg m^2]."""
    if solid.shape == "cylinder":
        radius, length = solid.size
        across = (3.0 * radius**2 + length**2) / 12.0
        return solid.mass * np.array([across, across, 0.5 * radius**2])
    x, y, z = solid.size
    return solid.mass / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])


def _end(joint: Joint) -> Pose:
    """Return the constant part of a joint's row: d along z, a along x, alpha about x."""
    return Pose.from_euler((joint.a, 0.0, joint.d), roll=joint.alpha)


def _turned(end: Pose, joint: Joint) -> Pose:
    return end @ Pose.from_euler((0.0, 0.0, 0.0), yaw=joint.theta)


def _rod(link: Link, start: Pose) -> Solid:
    """Return a link's tube, from a frame whose z points along it."""
    middle = start @ _translation(z=0.5 * link.length)
    return Solid("tube", "cylinder", (link.radius, link.length), middle, link.mass)


def _servo(servo: Servo, place: Pose) -> Solid:
    """Return a servo at a joint: its shaft is along its height."""
    return Solid("servo", "box", servo.size, place, servo.mass)


def _hand(link: Link, gripper: Gripper, arm: str) -> tuple[Solid, ...]:
    """Return tube and palm of the last link, so heavy that with the jaws they balance at half its length."""
    tube_length = link.length - gripper.finger - _PALM_LENGTH
    places = 0.5 * tube_length, tube_length + 0.5 * _PALM_LENGTH, link.length - 0.5 * gripper.finger
    jaws = 2.0 * gripper.jaw_mass
    moment = link.mass * 0.5 * link.length - jaws * places[2]
    palm = (moment - (link.mass - jaws) * places[0]) / (places[1] - places[0])
    tube = link.mass - jaws - palm
    if not (tube_length > 0.0 and palm > 0.0 and tube > 0.0):
        raise ArmError(
            f"{arm}: gripper: no mass of tube and palm makes link 5 balance at half its length;"
            " try a smaller jaw_mass or finger"
        )
    thick, high = 2.0 * gripper.pad[1], 2.0 * gripper.pad[2]
    size = (_PALM_LENGTH, gripper.opening + 2.0 * thick, high)
    palm_pose = _translation(x=places[1]) @ _TOOL_UP
    rod = Link(link.name, tube_length, tube, link.radius)
    return _rod(rod, _ALONG_X), Solid("palm", "box", size, palm_pose, palm)


def _jaw(gripper: Gripper, side: float) -> tuple[Solid, ...]:
    """Return a finger and, at its tip, its pad; both touch the plane between the jaws when these are closed."""
    length, thick, high = (2.0 * half for half in gripper.pad)
    density = gripper.jaw_mass / gripper.finger
    stem = gripper.finger - length
    across = 0.5 * side * thick
    parts = (("finger", stem, -length - 0.5 * stem), ("pad", length, -0.5 * length))
    return tuple(
        Solid(name, "box", (long, thick, high), _translation(x, across), density * long)
        for name, long, x in parts
    )


def _translation(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose.from_euler((x, y, z))
