"""URDF of a robot, of primitive shapes: what displays draw, in the same frames as its body in the simulation.

http://wiki.ros.org/urdf/XML has the format. Everything is nominal: the imperfections of the physical robot are
not in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final
from xml.etree import ElementTree as ET

from localization.types import Pose
from robot_sim.arm.arm_table import ArmTable
from robot_sim.robot.arm_urdf import add_arm_links
from robot_sim.robot.camera_mount import CAMERA_LINK, camera_frames
from robot_sim.robot.skid_steer_parameters import REFERENCE_HALF_WIDTH, SkidSteer

_COLOURS: Final = {
    "red": (0.75, 0.1, 0.1),
    "black": (0.1, 0.1, 0.1),
    "tyre": (0.15, 0.15, 0.15),
    "blue": (0.2, 0.3, 0.6),
    "white": (0.95, 0.95, 0.95),
}
_HOUSING: Final = (0.05, 0.12)
"""Radius and height of a scanner's housing [m]."""
_CAMERA: Final = (0.04, 0.15, 0.04)
"""Length, width and height of a camera's housing [m]."""
_UPRIGHT: Final = Pose.identity()
_ACROSS: Final = Pose.from_euler((0.0, 0.0, 0.0), roll=0.5 * math.pi)
"""A cylinder's axis is z; a wheel's is y."""

_ENDS: Final = {"front": 1.0, "rear": -1.0}
_SIDES: Final = {"left": 1.0, "right": -1.0}

Shape = tuple[str, Mapping[str, str]]
"""Name and attributes of an element within ``geometry``."""


def urdf(
    robot: SkidSteer,
    mounts: Mapping[str, Pose],
    *,
    camera: Pose | None = None,
    arm: ArmTable | None = None,
    arm_mount: str = "bracket",
) -> str:
    """Return the URDF of a robot.

    Args:
        robot: Its parameters.
        mounts: ``base_from_scanner`` of the scanners that it carries, by their frames.
        camera: Where it carries a camera, from its usual place for one; it has none by default. See ``camera_mount``.
        arm: An arm that it carries, if any.
        arm_mount: Where the arm is mounted.

    Returns:
        The XML: ``base_link`` on the floor plane between the wheels, x forward; a link for each of the four
        wheels, which turn about y; a link for each scanner, and ``imu_link``; the links of an arm have masses.

    Raises:
        ArmError: If the arm has no such mount.
    """
    root = ET.Element("robot", name=robot.name)
    for name, colour in _COLOURS.items():
        material = ET.SubElement(root, "material", name=name)
        ET.SubElement(material, "color", rgba=_numbers(*colour, 1.0))
    _add_body(root, robot)
    for end, along in _ENDS.items():
        for side, across in _SIDES.items():
            _add_wheel(root, robot, f"{end}_{side}_wheel", along, across)
    for name, mount in mounts.items():
        link = _add_link(root, name, mount, "fixed")
        radius, height = _HOUSING
        _add_shape(link, _cylinder(radius, height), _UPRIGHT, "blue")
    _add_link(root, "imu_link", robot.imu_mount, "fixed")
    if camera is not None:
        for name, pose in camera_frames(robot, camera).items():
            link = _add_link(root, name, pose, "fixed")
            if name == CAMERA_LINK:
                _add_shape(link, _box(*_CAMERA), _UPRIGHT, "black")
    if arm is not None:
        add_arm_links(root, arm, arm_mount)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add_body(root: ET.Element, robot: SkidSteer) -> None:
    """Add chassis and top plate, and a white bar that marks the front."""
    base = ET.SubElement(root, "link", name="base_link")
    half_width, tall = robot.inner_half_width, robot.height - robot.clearance
    middle = robot.clearance + 0.5 * tall
    chassis = _box(robot.length, 2.0 * half_width, tall)
    _add_shape(base, chassis, Pose.from_euler((0.0, 0.0, middle)), "red")
    long, wide = 0.44 * robot.length_scale, 0.36 * half_width / REFERENCE_HALF_WIDTH
    _add_shape(
        base, _box(long, wide, 0.01), Pose.from_euler((0.0, 0.0, robot.height + 0.03)), "black"
    )
    bar = Pose.from_euler((0.5 * robot.length - 0.02, 0.0, robot.height + 0.005))
    _add_shape(base, _box(0.04, 2.0 * half_width, 0.01), bar, "white", collides=False)


def _add_wheel(root: ET.Element, robot: SkidSteer, name: str, along: float, across: float) -> None:
    height = robot.wheel_radius - robot.tyre_deflection
    place = (0.5 * along * robot.wheelbase, 0.5 * across * robot.track, height)
    link = _add_link(root, name, Pose.from_euler(place), "continuous")
    shape = _cylinder(robot.wheel_radius, 2.0 * robot.wheel_half_width)
    _add_shape(link, shape, _ACROSS, "tyre")


def _add_link(root: ET.Element, name: str, base_from_link: Pose, kind: str) -> ET.Element:
    """Add a link, and its joint with ``base_link``."""
    link = ET.SubElement(root, "link", name=name)
    joint = ET.SubElement(root, "joint", name=f"{name}_joint", type=kind)
    ET.SubElement(joint, "parent", link="base_link")
    ET.SubElement(joint, "child", link=name)
    _add_origin(joint, base_from_link)
    if kind == "continuous":
        ET.SubElement(joint, "axis", xyz="0 1 0")
    return link


def _add_shape(
    link: ET.Element, shape: Shape, link_from_shape: Pose, colour: str, *, collides: bool = True
) -> None:
    for purpose in ("visual", "collision") if collides else ("visual",):
        part = ET.SubElement(link, purpose)
        _add_origin(part, link_from_shape)
        name, attributes = shape
        ET.SubElement(ET.SubElement(part, "geometry"), name, dict(attributes))
        if purpose == "visual":
            ET.SubElement(part, "material", name=colour)


def _add_origin(element: ET.Element, pose: Pose) -> None:
    # The roll, pitch and yaw of URDF are about the fixed axes x, y, z: those of REP 103.
    ET.SubElement(element, "origin", xyz=_numbers(*pose.position), rpy=_numbers(*pose.euler))


def _box(length: float, width: float, height: float) -> Shape:
    return "box", {"size": _numbers(length, width, height)}


def _cylinder(radius: float, length: float) -> Shape:
    return "cylinder", {"radius": _numbers(radius), "length": _numbers(length)}


def _numbers(*values: float) -> str:
    return " ".join(f"{round(float(value), 9) + 0.0:.9g}" for value in values)
