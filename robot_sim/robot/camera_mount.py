"""Where a robot carries its camera, and the frames of its images.

``camera_link`` is the camera's body, x forward and z up. Images are in optical frames (REP 103): z forward, x to
the right and y down in the image. Colours and depth are seen from one point.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from localization.types import Pose
from robot_sim.robot.skid_steer_parameters import SkidSteer

CAMERA_LINK: Final = "camera_link"
"""Frame of the camera's body."""
RGB_FRAME: Final = "camera_rgb_optical_frame"
"""Frame of colour images."""
DEPTH_FRAME: Final = "camera_depth_optical_frame"
"""Frame of depth images and of the points made from them."""

LINK_FROM_OPTICAL: Final = Pose.from_euler((0.0, 0.0, 0.0), roll=-0.5 * math.pi, yaw=-0.5 * math.pi)
"""``camera_link_from_optical``: z forward, x right, y down (REP 103)."""


def camera_frames(robot: SkidSteer, place: Pose | None = None) -> Mapping[str, Pose]:
    """Return ``base_from_frame`` of the camera's three frames on a robot.

    Args:
        robot: Its parameters.
        place: Where the camera is carried, from the robot's usual place for one; there by default.
    """
    link = robot.camera_mount if place is None else robot.camera_mount @ place
    optical = link @ LINK_FROM_OPTICAL
    return MappingProxyType({CAMERA_LINK: link, RGB_FRAME: optical, DEPTH_FRAME: optical})
