"""An arm as links and joints of a URDF, with its masses: the same bodies as its model for MuJoCo is made of.

Numbers are written with all their digits, so that a reader computes the same arm to the last one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final
from xml.etree import ElementTree as ET

from localization.types import Pose
from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.parts import ARM_BASE, JAWS, ArmBody, Solid, arm_bodies, inertial
from robot_sim.array_types import FloatArray

COLOURS: Final = {
    "tube": "white",
    "servo": "black",
    "palm": "black",
    "finger": "white",
    "pad": "tyre",
}
"""Material of each of an arm's solids."""


def add_arm_links(root: ET.Element, table: ArmTable, mount: str) -> None:
    """Add an arm to a robot's URDF.

    The position of a joint is its angle, and that of ``gripper_joint`` the opening of the gripper [m]: by all of it the
    left jaw slides on the right one, which slides on the last link by half of it, the other way.

    Args:
        root: The robot, with a link ``base_link`` and the materials of ``COLOURS``.
        table: The arm.
        mount: Where it is mounted.

    Raises:
        ArmError: If it has no such mount.
    """
    gripper = table.gripper
    bodies = {body.name: body for body in arm_bodies(table)}
    for name, body in bodies.items():
        if name in JAWS:
            continue
        pose = table.mount(mount) if name == ARM_BASE else body.pose
        if body.joint is None:
            _add_link(root, body, f"{name}_joint", "fixed", body.parent, pose)
            continue
        turning = body.joint
        joint = _add_link(root, body, turning.name, "revolute", body.parent, pose)
        ET.SubElement(joint, "axis", xyz="0 0 1")
        torque = turning.servo.torque(table.supply)
        _add_limit(joint, turning.lower, turning.upper, torque, table.motion.speed)
    left, right = (bodies[name] for name in JAWS)
    half = 0.5 * gripper.opening, gripper.force, 0.5 * gripper.speed
    joint = _add_link(root, right, f"{right.name}_joint", "prismatic", right.parent, right.pose)
    ET.SubElement(joint, "axis", xyz=_numbers(*(right.slide or ())))
    _add_limit(joint, 0.0, *half)
    ET.SubElement(joint, "mimic", joint=gripper.joint, multiplier="0.5")
    joint = _add_link(root, left, gripper.joint, "prismatic", right.name, Pose.identity())
    ET.SubElement(joint, "axis", xyz=_numbers(*(left.slide or ())))
    _add_limit(joint, 0.0, gripper.opening, gripper.force, gripper.speed)


def _add_link(
    root: ET.Element, body: ArmBody, joint: str, kind: str, parent: str, pose: Pose
) -> ET.Element:
    """Add a link with its mass and shapes, and return its joint, which still lacks axis and limits."""
    link = ET.SubElement(root, "link", name=body.name)
    if body.solids:
        _add_mass(link, body)
    for solid in body.solids:
        for purpose in ("visual", "collision"):
            part = ET.SubElement(link, purpose)
            _add_origin(part, solid.pose)
            geometry = ET.SubElement(part, "geometry")
            ET.SubElement(geometry, solid.shape, dict(_size(solid)))
            if purpose == "visual":
                ET.SubElement(part, "material", name=COLOURS[solid.name])
    element = ET.SubElement(root, "joint", name=joint, type=kind)
    ET.SubElement(element, "parent", link=parent)
    ET.SubElement(element, "child", link=body.name)
    _add_origin(element, pose)
    return element


def _add_mass(link: ET.Element, body: ArmBody) -> None:
    found = inertial(body)
    element = ET.SubElement(link, "inertial")
    ET.SubElement(element, "origin", xyz=_numbers(*found.centre), rpy="0 0 0")
    ET.SubElement(element, "mass", value=_numbers(found.mass))
    axes = "xyz"
    entries = {
        f"i{axes[row]}{axes[column]}": _numbers(found.tensor[row, column])
        for row in range(3)
        for column in range(row, 3)
    }
    ET.SubElement(element, "inertia", entries)


def _add_limit(
    joint: ET.Element, lower: float, upper: float, effort: float, velocity: float
) -> None:
    limits = {"lower": lower, "upper": upper, "effort": effort, "velocity": velocity}
    ET.SubElement(joint, "limit", {name: _numbers(value) for name, value in limits.items()})


def _add_origin(element: ET.Element, pose: Pose) -> None:
    rpy = _numbers(*_roll_pitch_yaw(pose.rotation))
    ET.SubElement(element, "origin", xyz=_numbers(*pose.position), rpy=rpy)


def _roll_pitch_yaw(rotation: FloatArray) -> tuple[float, float, float]:
    """Return the angles of a rotation (3, 3) about the fixed axes, exact also where it pitches by a right angle."""
    r = rotation.tolist()
    level = math.hypot(r[2][1], r[2][2])
    pitch = math.atan2(-r[2][0], level)
    if level < 1e-9:
        # Roll and yaw then are about one axis, and rounding alone would choose between them.
        return 0.0, pitch, math.atan2(-r[0][1], r[1][1])
    return math.atan2(r[2][1], r[2][2]), pitch, math.atan2(r[1][0], r[0][0])


def _size(solid: Solid) -> Mapping[str, str]:
    if solid.shape == "box":
        return {"size": _numbers(*solid.size)}
    radius, length = solid.size
    return {"radius": _numbers(radius), "length": _numbers(length)}


def _numbers(*values: float) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)
