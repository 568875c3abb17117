"""Exact conversion of any reading to a ROS message and back."""

from __future__ import annotations

from collections.abc import Callable

from localization.logs.laser_scan_message import read_scan, scan_message
from localization.logs.motion_messages import (
    WHEEL_RADIUS,
    inertial_message,
    odometry_message,
    read_inertial,
    read_odometry,
    read_wheels,
    wheels_message,
)
from localization.logs.point_cloud_message import points_message
from localization.logs.pose_messages import hint_message, read_hint
from localization.logs.ros_types import (
    IMU,
    JOINT_STATE,
    LASER_SCAN,
    ODOMETRY,
    POSE_WITH_COVARIANCE,
    Message,
)
from localization.types import (
    Hint,
    Inertial,
    Odometry,
    PointScan,
    Reading,
    Scan,
    WheelSpeeds,
)


def reading_message(reading: Reading, wheel_radius: float = WHEEL_RADIUS) -> Message:
    """Return the message of any reading; ``__msgtype__`` is the message's type.

    Args:
        reading: Reading to convert.
        wheel_radius: Radius [m] by which rim speeds become joint velocities.

    Raises:
        MessageError: If no message holds the reading exactly.
    """
    match reading:
        case Scan():
            return scan_message(reading)
        case PointScan():
            return points_message(reading)
        case WheelSpeeds():
            return wheels_message(reading, wheel_radius)
        case Inertial():
            return inertial_message(reading)
        case Odometry():
            return odometry_message(reading)
        case Hint():
            return hint_message(reading)


def readers(wheel_radius: float = WHEEL_RADIUS) -> dict[str, Callable[[Message], Reading]]:
    """Return for each message type the function that converts such a message to a reading."""
    return {
        LASER_SCAN: read_scan,
        JOINT_STATE: lambda message: read_wheels(message, wheel_radius),
        IMU: read_inertial,
        ODOMETRY: read_odometry,
        POSE_WITH_COVARIANCE: read_hint,
    }
