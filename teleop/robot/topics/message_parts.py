"""Parts that several of the robot's messages share: headers and odometry."""

from __future__ import annotations

from typing import Any, TypeAlias

from localization.logs.ros_geometry import pose_to_dict, vector_to_dict
from localization.logs.ros_stamps import stamp_to_dict
from localization.types import Pose, Twist

Message: TypeAlias = dict[str, Any]
"""Fields of a message by name, as the rosbridge server takes them."""

Messages: TypeAlias = tuple[Message, ...]
"""The messages of one topic in one tick."""


def header(stamp: int, frame: str) -> Message:
    """Return ``std_msgs/Header`` of a stamp [ns] and a frame."""
    return {"stamp": stamp_to_dict(stamp), "frame_id": frame}


def odometry(stamp: int, frame: str, pose: Pose, twist: Twist) -> Message:
    """Return ``nav_msgs/Odometry`` of ``base_link`` in a frame, at a stamp [ns]."""
    return {
        "header": header(stamp, frame),
        "child_frame_id": "base_link",
        "pose": {"pose": pose_to_dict(pose)},
        "twist": {
            "twist": {
                "linear": vector_to_dict(twist.linear),
                "angular": vector_to_dict(twist.angular),
            }
        },
    }
