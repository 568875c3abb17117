"""Messages on the robot's input topics, read into inbox messages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from localization.logs.ros_geometry import pose_from_message
from localization.logs.ros_stamps import stamp_from_message
from localization.types import Hint, InvalidReadingError, Twist
from teleop.joystick import JoystickError, VelocityRequest, read_joy
from teleop.robot.inbox import DriveCommand


def joy_command(client: str, message: Mapping[str, Any]) -> DriveCommand:
    """Return the drive command in a ``sensor_msgs/Joy``.

    Raises:
        JoystickError: If an axis is missing or is not a finite number.
    """
    request = read_joy(list(message["axes"]), list(message["buttons"]))
    return DriveCommand(client, request, stamp_from_message(message["header"]["stamp"]))


def twist_command(client: str, message: Mapping[str, Any]) -> DriveCommand:
    """Return the drive command in a ``geometry_msgs/Twist``; it has no deadman button.

    Raises:
        JoystickError: If forward speed or turn rate is not a finite number.
    """
    forward, turn = float(message["linear"]["x"]), float(message["angular"]["z"])
    if not (math.isfinite(forward) and math.isfinite(turn)):
        raise JoystickError(f"cmd_vel must be finite, got {forward}, {turn}")
    request = VelocityRequest(Twist.planar(forward, turn), enabled=True)
    return DriveCommand(client, request, stream=True)


def hint_reading(message: Mapping[str, Any]) -> Hint:
    """Return the pose hint in a ``geometry_msgs/PoseWithCovarianceStamped``, for the robot to date.

    Args:
        message: The message; its stamp is ignored, for it is of the client's clock.

    Raises:
        InvalidReadingError: If the frame is not ``map``, or pose or covariance is invalid.
    """
    frame = message["header"]["frame_id"]
    if frame not in ("map", "/map"):
        raise InvalidReadingError(f"hint header.frame_id must be 'map', got {frame!r}")
    covariance = np.asarray(message["pose"]["covariance"], dtype=float).reshape(6, 6)
    return Hint(0, pose_from_message(message["pose"]["pose"]), covariance)
