"""Readings of wheels, inertial unit and odometry as ROS messages."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
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
from localization.types import Inertial, Odometry, Twist, WheelSpeeds

WHEEL_JOINTS: Final = ("left_wheels", "right_wheels")
"""Names in ``JointState``; each stands for the wheels of one side, which a belt couples."""

_NO_MOTION: Final = Twist(np.zeros(3), np.zeros(3))
_NO_TURN: Final = np.array([1.0, 0.0, 0.0, 0.0])
_NO_TURN.flags.writeable = False
_NOT_UNIT: Final = 1e-3
"""Departure of a quaternion's norm from 1 from which it is no orientation."""
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
    """Return ``Imu`` in ``base_link``; the covariances of angular velocity and specific force are unknown."""
    # A first element of -1 marks a field that does not exist, zeros an unknown covariance (sensor_msgs/Imu).
    covariance = np.zeros(9)
    orientation = inertial.orientation
    if orientation is None:
        orientation = _NO_TURN
        covariance[0] = -1.0
    elif inertial.orientation_sigma is not None:
        covariance[::4] = np.square(inertial.orientation_sigma)
    return build(
        IMU,
        header=header_message(inertial.stamp, "base_link"),
        orientation=quaternion_message(orientation),
        orientation_covariance=covariance,
        angular_velocity=vector_message(inertial.angular_velocity),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector_message(inertial.specific_force),
        linear_acceleration_covariance=np.zeros(9),
    )


def read_inertial(message: Message) -> Inertial:
    """Return the reading in an ``Imu``, assuming the axes of ``base_link``.

    Its orientation is left out if the message says that it has none, or if it is one that drivers leave there who
    know none: all zeros, or the identity with an unknown covariance.
    """
    w, a = message.angular_velocity, message.linear_acceleration
    orientation, sigma = _orientation(message)
    return Inertial(
        stamp_from_message(message.header.stamp),
        np.array([w.x, w.y, w.z]),
        np.array([a.x, a.y, a.z]),
        orientation,
        sigma,
    )


def _orientation(message: Message) -> tuple[FloatArray | None, FloatArray | None]:
    """Return the quaternion wxyz (4,) in an ``Imu`` and its standard deviations (3,) [rad]; None where unknown."""
    q, covariance = message.orientation, np.asarray(message.orientation_covariance, dtype=float)
    quaternion = np.array([q.w, q.x, q.y, q.z], dtype=float)
    variance = covariance[::4]
    unknown = not np.isfinite(variance).all() or (variance < 0.0).any() or not variance.any()
    norm = float(np.linalg.norm(quaternion))
    missing = covariance[0] == -1.0 or not math.isfinite(norm) or abs(norm - 1.0) > _NOT_UNIT
    if missing or (unknown and np.array_equal(quaternion, _NO_TURN)):
        return None, None
    return quaternion, None if unknown else np.sqrt(variance)


def odometry_message(odometry: Odometry) -> Message:
    """Return ``Odometry`` from ``odom`` to ``base_link``, with unknown covariances, and a zero twist if it has none."""
    twist = odometry.twist or _NO_MOTION
    return build(
        ODOMETRY,
        header=header_message(odometry.stamp, "odom"),
        child_frame_id="base_link",
        pose=pose_with_covariance(odometry.odom_from_base, np.zeros(36)),
        twist=build(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=build(
                "geometry_msgs/msg/Twist",
                linear=vector_message(twist.linear),
                angular=vector_message(twist.angular),
            ),
            covariance=np.zeros(36),
        ),
    )


def read_odometry(message: Message) -> Odometry:
    """Return the pose and twist in an ``Odometry``, assuming that they are those of ``base_link``.

    A twist of zeros or with values that are not finite counts as none.
    """
    pose, given = message.pose.pose, message.twist.twist
    linear, angular = (np.array([v.x, v.y, v.z]) for v in (given.linear, given.angular))
    rates = np.concatenate([linear, angular])
    twist = Twist(linear, angular) if rates.any() and np.isfinite(rates).all() else None
    return Odometry(stamp_from_message(message.header.stamp), pose_from_message(pose), twist)
