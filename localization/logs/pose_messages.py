"""Hints and mounts as ROS messages: poses with covariance, and static transforms."""

from __future__ import annotations

import numpy as np

from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_from_message, pose_from_transform
from localization.logs.ros_stamps import stamp_from_message
from localization.logs.ros_types import (
    POSE_WITH_COVARIANCE,
    TF,
    Message,
    MessageError,
    build,
    header_message,
    quaternion_message,
    vector_message,
)
from localization.types import Hint, Mounts, Pose


def pose_with_covariance(pose: Pose, covariance: FloatArray) -> Message:
    """Return ``PoseWithCovariance`` of a pose and its covariance (36,) in ROS's order."""
    return build(
        "geometry_msgs/msg/PoseWithCovariance",
        pose=build(
            "geometry_msgs/msg/Pose",
            position=vector_message(pose.position, "geometry_msgs/msg/Point"),
            orientation=quaternion_message(pose.quaternion_wxyz),
        ),
        covariance=covariance,
    )


def hint_message(hint: Hint) -> Message:
    """Return ``PoseWithCovarianceStamped`` in ``map``."""
    return build(
        POSE_WITH_COVARIANCE,
        header=header_message(hint.stamp, "map"),
        pose=pose_with_covariance(hint.map_from_base, hint.covariance.ravel()),
    )


def read_hint(message: Message) -> Hint:
    """Return the hint in a ``PoseWithCovarianceStamped``.

    Raises:
        MessageError: If its frame is not ``map``.
    """
    if (frame := str(message.header.frame_id)) != "map":
        raise MessageError(f"a hint must be in frame 'map', got {frame!r}")
    pose = message.pose.pose
    return Hint(
        stamp_from_message(message.header.stamp),
        pose_from_message(pose),
        np.asarray(message.pose.covariance, dtype=float).reshape(6, 6),
    )


def mounts_message(mounts: Mounts) -> Message:
    """Return ``TFMessage`` for ``/tf_static``: the transform from ``base_link`` to each scanner."""
    return build(
        TF,
        transforms=[
            build(
                "geometry_msgs/msg/TransformStamped",
                header=header_message(0, "base_link"),
                child_frame_id=scanner,
                transform=build(
                    "geometry_msgs/msg/Transform",
                    translation=vector_message(pose.position),
                    rotation=quaternion_message(pose.quaternion_wxyz),
                ),
            )
            for scanner, pose in mounts.items()
        ],
    )


def read_mounts(message: Message) -> dict[str, Pose]:
    """Return ``base_from_frame`` of each frame in a ``TFMessage`` whose parent is ``base_link``."""
    return {
        str(link.child_frame_id): pose_from_transform(link.transform)
        for link in message.transforms
        if link.header.frame_id == "base_link"
    }
