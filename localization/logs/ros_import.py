"""Readings from ROS 1 and ROS 2 messages of any robot, whatever its frames and joints."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from localization.geometry import quaternion_from_rotation, rotation_from_quaternion
from localization.logs import ros_types
from localization.logs.frame_tree import FrameTree, SensorLayout
from localization.logs.laser_scan_message import read_scan
from localization.logs.motion_messages import read_inertial, read_odometry
from localization.logs.point_cloud_message import read_points
from localization.logs.pose_messages import read_hint
from localization.logs.ros_stamps import stamp_from_message
from localization.logs.ros_types import Message, MessageError
from localization.types import Inertial, Reading, WheelSpeeds

_SCANS: Final = (ros_types.LASER_SCAN, ros_types.POINT_CLOUD)


def read(kind: str, message: Any, tree: FrameTree, layout: SensorLayout) -> Reading | None:
    """Return the reading in a message; None if messages of its type hold no reading.

    Args:
        kind: Message type such as ``sensor_msgs/msg/Imu``.
        message: Message as rosbags decodes it.
        tree: Frames, which turn inertial readings into the axes of the base.
        layout: Facts about the robot.

    Raises:
        MessageError: If the message should hold a reading and does not.
    """
    match kind:
        case ros_types.LASER_SCAN:
            return read_scan(message)
        case ros_types.POINT_CLOUD:
            return read_points(message)
        case ros_types.IMU:
            return _inertial(message, tree)
        case ros_types.ODOMETRY:
            return read_odometry(message)
        case ros_types.JOINT_STATE:
            return _wheels(message, layout.wheel_radius)
        case ros_types.POSE_WITH_COVARIANCE:
            return read_hint(message)
    return None


def _inertial(message: Message, tree: FrameTree) -> Inertial:
    reading = read_inertial(message)
    mount = tree.base_from(str(message.header.frame_id))
    if mount is None:
        raise MessageError(
            f"the pose of its frame {message.header.frame_id!r} on the base is unknown"
        )
    turn, orientation = mount.rotation, reading.orientation
    if orientation is not None:
        world_from_unit = rotation_from_quaternion(orientation)
        orientation = quaternion_from_rotation(world_from_unit @ turn.T)
    return Inertial(
        reading.stamp,
        turn @ reading.angular_velocity,
        turn @ reading.specific_force,
        orientation,
        reading.orientation_sigma,
    )


def _wheels(message: Message, radius: float) -> WheelSpeeds:
    """Rim speeds of both sides: means over all wheels with the name of the side in theirs."""
    velocity = dict(zip(message.name, message.velocity, strict=False))
    sides = {
        side: [float(v) for name, v in velocity.items() if side in name and "wheel" in name]
        for side in ("left", "right")
    }
    if missing := [side for side, rates in sides.items() if not rates]:
        raise MessageError(
            f"joints {list(message.name)} lack the velocity of a {' and a '.join(missing)} wheel"
        )
    left, right = (float(np.float32(radius * np.mean(sides[s]))) for s in ("left", "right"))
    if not (math.isfinite(left) and math.isfinite(right)):
        raise MessageError(f"wheel velocities must be finite, got {velocity}")
    return WheelSpeeds(stamp_from_message(message.header.stamp), left, right)


def is_scan(kind: str) -> bool:
    """Return whether a message type holds scans."""
    return kind in _SCANS
