"""Parts that several of the robot's messages share: headers and odometry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, TypeAlias

import numpy as np

from localization.logs.ros_geometry import pose_to_dict, vector_to_dict
from localization.logs.ros_stamps import stamp_to_dict
from localization.types import Pose, Twist

Message: TypeAlias = dict[str, Any]
"""Fields of a message by name, as the rosbridge server takes them."""

Messages: TypeAlias = tuple[Message, ...]
"""The messages of one topic in one tick."""


_FLOAT32: Final = 7
"""``sensor_msgs/PointField.FLOAT32``."""


def header(stamp: int, frame: str) -> Message:
    """Return ``std_msgs/Header`` of a stamp [ns] and a frame."""
    return {"stamp": stamp_to_dict(stamp), "frame_id": frame}


def odometry(stamp: int, frame: str, pose: Pose, twist: Twist) -> Message:
    """Return ``nav_msgs/Odometry`` of ``base_link`` in a frame, at a stamp [ns]."""
    return {
        "header": header(stamp, frame),
        "child_frame_id": "base_link",
        "pose": {"pose": pose_to_dict(pose)},
        "twist": {"twist": twist_to_dict(twist)},
    }


def twist_to_dict(twist: Twist) -> Message:
    """Return ``geometry_msgs/Twist``."""
    return {"linear": vector_to_dict(twist.linear), "angular": vector_to_dict(twist.angular)}


def array(data: Sequence[Any] | np.ndarray[Any, Any]) -> Message:
    """Return a ``std_msgs`` array of one dimension, of numbers or of bytes."""
    return {"layout": {"dim": [], "data_offset": 0}, "data": data}


def point_cloud(
    stamp: int, frame: str, names: Sequence[str], data: bytes, *, dense: bool = True
) -> Message:
    """Return ``sensor_msgs/PointCloud2`` of points whose fields are 32-bit floats.

    Args:
        stamp: Its stamp [ns].
        frame: Its frame.
        names: Names of the fields, in their order.
        data: The points, one after the other.
        dense: Whether all numbers are finite.
    """
    step = 4 * len(names)
    fields = [
        {"name": name, "offset": 4 * i, "datatype": _FLOAT32, "count": 1}
        for i, name in enumerate(names)
    ]
    return {
        "header": header(stamp, frame),
        "height": 1,
        "width": len(data) // step,
        "fields": fields,
        "is_bigendian": False,
        "point_step": step,
        "row_step": len(data),
        "data": data,
        "is_dense": dense,
    }
