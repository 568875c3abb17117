"""ROS 2 message types: their classes, their CDR form, and the parts that many of them share.

A message is an object of the rosbags type store, so that a log, a WebSocket and a test use the same classes
without a ROS installation.
"""

from __future__ import annotations

from typing import Any, Final, TypeAlias

from rosbags.typesys import Stores, get_typestore

from localization.errors import LocalizationError
from localization.geometry import FloatArray
from localization.logs.ros_stamps import stamp_to_dict
from localization.types import SECOND

Message: TypeAlias = Any
"""An instance of one of ``TYPES.types``; those classes are made at run time."""

TYPES: Final = get_typestore(Stores.ROS2_JAZZY)
"""Message classes, their definitions and their CDR form."""

LASER_SCAN: Final = "sensor_msgs/msg/LaserScan"
JOINT_STATE: Final = "sensor_msgs/msg/JointState"
IMU: Final = "sensor_msgs/msg/Imu"
POINT_CLOUD: Final = "sensor_msgs/msg/PointCloud2"
ODOMETRY: Final = "nav_msgs/msg/Odometry"
POSE_WITH_COVARIANCE: Final = "geometry_msgs/msg/PoseWithCovarianceStamped"
TF: Final = "tf2_msgs/msg/TFMessage"

_STAMP_LIMIT: Final = 2**31 * SECOND
"""Smallest stamp [ns] beyond the range of ``builtin_interfaces/Time``."""


class MessageError(LocalizationError):
    """A value that no message can hold, or a message that holds no reading; one line says why."""


def build(message_type: str, /, **fields: object) -> Message:
    """Return a message of a type, such as ``sensor_msgs/msg/Imu``, with all its fields given."""
    return TYPES.types[message_type](**fields)  # type: ignore[arg-type]


def stamp_message(stamp: int) -> Message:
    """Return ``builtin_interfaces/Time`` of a stamp [ns].

    Raises:
        MessageError: If the stamp is negative or at least 2^31 s.
    """
    if not 0 <= stamp < _STAMP_LIMIT:
        raise MessageError(f"stamp must be in [0, 2^31) s, got {stamp} ns")
    return build("builtin_interfaces/msg/Time", **stamp_to_dict(stamp))


def header_message(stamp: int, frame: str) -> Message:
    """Return ``std_msgs/Header`` of a stamp [ns] and a frame."""
    return build("std_msgs/msg/Header", stamp=stamp_message(stamp), frame_id=frame)


def vector_message(xyz: FloatArray, message_type: str = "geometry_msgs/msg/Vector3") -> Message:
    """Return ``geometry_msgs/Vector3``, or ``Point``, of a vector (3,)."""
    x, y, z = map(float, xyz)
    return build(message_type, x=x, y=y, z=z)


def quaternion_message(wxyz: FloatArray) -> Message:
    """Return ``geometry_msgs/Quaternion`` of a quaternion (4,) in the order wxyz."""
    w, x, y, z = map(float, wxyz)
    return build("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def to_cdr(message: Message) -> bytes:
    """Return a message's bytes: little-endian CDR."""
    return bytes(TYPES.serialize_cdr(message, message.__msgtype__, little_endian=True))


def from_cdr(data: bytes, message_type: str) -> Message:
    """Return the message in CDR bytes."""
    return TYPES.deserialize_cdr(data, message_type)


def definition(message_type: str) -> str:
    """Return a type's ``.msg`` text followed by those of the types it uses, as MCAP requires."""
    return TYPES.generate_msgdef(message_type, ros_version=2)[0]
