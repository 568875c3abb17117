"""Readings of wheels, inertial unit and odometry as ROS messages."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.logs.pose_messages import pose_with_covariance
from localization.logs.ros_geometry import pose_from_message
from localization.logs.ros_stamps import stamp_from_message
from localization.logs.ros_types import (
    IMU,
    JOINT_STATE,
    ODOMETRY,
    Message,
    MessageError,
    build,
    header_message,
    quaternion_message,
    vector_message,
)
from localization.types import Inertial, Odometry, WheelSpeeds

WHEEL_JOINTS: Final = ("left_wheels", "right_wheels")
"""Names in ``JointState``; each stands for the wheels of one side, which a belt couples."""

WHEEL_RADIUS: Final = 0.111
"""Radius [m] of a Pioneer 3-AT's wheel: 222 mm across (MobileRobots, Pioneer 3-AT data sheet)."""


def wheels_message(wheels: WheelSpeeds, wheel_radius: float = WHEEL_RADIUS) -> Message:
    """Return ``JointState`` with the angular velocity of both sides [rad/s].

    Args:
        wheels: Rim speeds [m/s].
        wheel_radius: Radius of the wheels [m].

    Raises:
        MessageError: If a speed has more digits than float32 can hold.
    """
    for name in ("left", "right"):
        speed = getattr(wheels, name)
        if not float(np.float32(speed)) == speed:
            raise MessageError(
                f"wheels.{name} must be a finite number of float32 resolution, got {speed!r}; "
                "round it with numpy.float32"
            )
    velocity = np.array([wheels.left, wheels.right]) / wheel_radius
    return build(
        JOINT_STATE,
        header=header_message(wheels.stamp, "base_link"),
        name=list(WHEEL_JOINTS),
        position=np.zeros(0),
        velocity=velocity,
        effort=np.zeros(0),
    )


def read_wheels(message: Message, wheel_radius: float = WHEEL_RADIUS) -> WheelSpeeds:
    """Return the rim speeds in a ``JointState``.

    Dividing by the radius and multiplying again changes only the last bits of a float64, which rounding to
    float32 removes: the speeds are restored exactly.

    Args:
        message: Joint velocities [rad/s].
        wheel_radius: Radius of the wheels [m].

    Raises:
        MessageError: If a side's velocity is missing.
    """
    velocity = dict(zip(message.name, message.velocity, strict=False))
    if missing := [joint for joint in WHEEL_JOINTS if joint not in velocity]:
        raise MessageError(f"joints {message.name} lack the velocity of {' and '.join(missing)}")
    left, right = (float(np.float32(wheel_radius * velocity[joint])) for joint in WHEEL_JOINTS)
    return WheelSpeeds(stamp_from_message(message.header.stamp), left, right)


def inertial_message(inertial: Inertial) -> Message:
    """Return ``Imu`` in ``base_link``, without orientation and with unknown covariances."""
    # A first element of -1 marks a field that does not exist, zeros an unknown covariance (sensor_msgs/Imu).
    no_orientation = np.zeros(9)
    no_orientation[0] = -1.0
    return build(
        IMU,
        header=header_message(inertial.stamp, "base_link"),
        orientation=quaternion_message(np.array([1.0, 0.0, 0.0, 0.0])),
        orientation_covariance=no_orientation,
        angular_velocity=vector_message(inertial.angular_velocity),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector_message(inertial.specific_force),
        linear_acceleration_covariance=np.zeros(9),
    )


def read_inertial(message: Message) -> Inertial:
    """Return the reading in an ``Imu``, assuming the axes of ``base_link``."""
    w, a = message.angular_velocity, message.linear_acceleration
    return Inertial(
        stamp_from_message(message.header.stamp),
        np.array([w.x, w.y, w.z]),
        np.array([a.x, a.y, a.z]),
    )


def odometry_message(odometry: Odometry) -> Message:
    """Return ``Odometry`` from ``odom`` to ``base_link``, with a zero twist and unknown covariances."""
    return build(
        ODOMETRY,
        header=header_message(odometry.stamp, "odom"),
        child_frame_id="base_link",
        pose=pose_with_covariance(odometry.odom_from_base, np.zeros(36)),
        twist=build(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=build(
                "geometry_msgs/msg/Twist",
                linear=vector_message(np.zeros(3)),
                angular=vector_message(np.zeros(3)),
            ),
            covariance=np.zeros(36),
        ),
    )


def read_odometry(message: Message) -> Odometry:
    """Return the pose in an ``Odometry``, assuming that it is that of ``base_link``."""
    pose = message.pose.pose
    return Odometry(stamp_from_message(message.header.stamp), pose_from_message(pose))
