"""Poses and vectors in ROS messages.

A message comes as an object with attributes, as rosbags decodes it, or as a mapping, as rosbridge carries it;
the ``..._from_message`` functions read either. Quaternions are ``xyzw`` in messages and ``wxyz`` elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose


def pose_from_message(pose: Any) -> Pose:
    """Return the pose in a ``geometry_msgs/Pose``, metres."""
    return _pose(_field(pose, "position"), _field(pose, "orientation"))


def pose_from_transform(transform: Any) -> Pose:
    """Return ``parent_from_child`` in a ``geometry_msgs/Transform``, metres."""
    return _pose(_field(transform, "translation"), _field(transform, "rotation"))


def vector_to_dict(vector: FloatArray) -> dict[str, float]:
    """Return a vector (3,) as ``geometry_msgs/Vector3`` or ``Point`` in a dictionary."""
    x, y, z = vector.tolist()
    return {"x": x, "y": y, "z": z}


def pose_to_dict(pose: Pose) -> dict[str, dict[str, float]]:
    """Return a pose as ``geometry_msgs/Pose`` in a dictionary, metres."""
    return {"position": vector_to_dict(pose.position), "orientation": _quaternion_to_dict(pose)}


def transform_to_dict(pose: Pose) -> dict[str, dict[str, float]]:
    """Return ``parent_from_child`` as ``geometry_msgs/Transform`` in a dictionary, metres."""
    return {"translation": vector_to_dict(pose.position), "rotation": _quaternion_to_dict(pose)}


def _quaternion_to_dict(pose: Pose) -> dict[str, float]:
    w, x, y, z = pose.quaternion_wxyz.tolist()
    return {"x": x, "y": y, "z": z, "w": w}


def _pose(position: Any, orientation: Any) -> Pose:
    return Pose(
        np.array([_field(position, axis) for axis in "xyz"], dtype=float),
        np.array([_field(orientation, axis) for axis in "wxyz"], dtype=float),
    )


def _field(message: Any, name: str) -> Any:
    return message[name] if isinstance(message, Mapping) else getattr(message, name)
