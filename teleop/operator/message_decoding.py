"""Message dictionaries, as a rosbridge client hands them out, into the project's own values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.types import SECOND, Pose

Message: TypeAlias = Mapping[str, Any]
Floats: TypeAlias = npt.NDArray[np.float32]

_FLOAT32 = 7
"""``sensor_msgs/PointField.FLOAT32``."""


class DecodeError(ValueError):
    """A message that cannot be shown; one line says why."""


def time_of(time: Message) -> int:
    """Return the stamp [ns] of a ``builtin_interfaces/Time``; ROS 1 names its fields otherwise."""
    nanosec = time["nanosec"] if "nanosec" in time else time["nsecs"]
    return int(time["sec"] if "sec" in time else time["secs"]) * SECOND + int(nanosec)


def stamp_of(message: Message) -> int | None:
    """Return the stamp [ns] in a message's header, or None if it has none."""
    stamp = message.get("header", {}).get("stamp")
    return None if stamp is None else time_of(stamp)


def pose_of(pose: Message) -> Pose:
    """Return the pose in a ``geometry_msgs/Pose``."""
    return _pose(pose["position"], pose["orientation"])


def transform_of(transform: Message) -> Pose:
    """Return ``parent_from_child`` in a ``geometry_msgs/Transform``."""
    return _pose(transform["translation"], transform["rotation"])


def _pose(position: Message, orientation: Message) -> Pose:
    return Pose(
        np.array([position[axis] for axis in "xyz"], dtype=float),
        np.array([orientation[axis] for axis in "wxyz"], dtype=float),
    )


def covariance_of(value: npt.ArrayLike) -> FloatArray:
    """Return a (6, 6) covariance, as ROS orders it, from its 36 numbers.

    Raises:
        DecodeError: if there are not 36 finite ones.
    """
    flat = np.asarray(value, dtype=float).ravel()
    if flat.shape != (36,) or not np.isfinite(flat).all():
        raise DecodeError(f"a covariance needs 36 finite numbers, got {flat.size}")
    return flat.reshape(6, 6)


def cloud_of(message: Message) -> tuple[Floats, Floats]:
    """Return points (N, 3) and signed distances to the map (N,) [m] of a ``PointCloud2``.

    Points that are not finite are left out. A cloud without ``distance`` gives NaN for all.

    Raises:
        DecodeError: if it has no ``x y z`` in float32, or fewer bytes than it says.
    """
    order = ">" if message["is_bigendian"] else "<"
    fields = {
        field["name"]: (f"{order}f4", int(field["offset"]))
        for field in message["fields"]
        if field["datatype"] == _FLOAT32
    }
    if missing := [axis for axis in "xyz" if axis not in fields]:
        raise DecodeError(f"the cloud has no float32 field {' '.join(missing)}")
    layout = np.dtype(
        {
            "names": list(fields),
            "formats": [kind for kind, _ in fields.values()],
            "offsets": [offset for _, offset in fields.values()],
            "itemsize": int(message["point_step"]),
        }
    )
    count = int(message["width"]) * int(message["height"])
    data = bytes(message["data"])
    if len(data) < count * layout.itemsize:
        raise DecodeError(f"{count} points need {count * layout.itemsize} bytes, got {len(data)}")
    table = np.frombuffer(data, layout, count)
    points = np.stack([table[axis] for axis in "xyz"], axis=1).astype(np.float32)
    absent = np.full(count, np.nan)
    distances = np.asarray(table["distance"] if "distance" in fields else absent, dtype=np.float32)
    finite = np.isfinite(points).all(axis=1)
    return points[finite], distances[finite]
