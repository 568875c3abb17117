"""Decoding of message dictionaries: header stamps, covariances and point clouds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_from_transform
from localization.logs.ros_stamps import stamp_from_message
from localization.types import Pose
from teleop.errors import TeleopError

Message: TypeAlias = Mapping[str, Any]
Floats: TypeAlias = npt.NDArray[np.float32]

_FLOAT32 = 7
"""``sensor_msgs/PointField.FLOAT32``."""


class DecodeError(TeleopError, ValueError):
    """A message cannot be shown; the message of the error says why in one line."""


def stamp_of(message: Message) -> int | None:
    """Return the stamp [ns] in a message's header; None if it has no header."""
    stamp = message.get("header", {}).get("stamp")
    return None if stamp is None else stamp_from_message(stamp)


def map_from_base(transforms: Sequence[Mapping[str, Any]]) -> Pose | None:
    """Chain ``map`` to ``odom`` to ``base_link``; None before the robot is localised."""
    poses = {t["child_frame_id"]: pose_from_transform(t["transform"]) for t in transforms}
    if "odom" not in poses or "base_link" not in poses:
        return None
    return poses["odom"] @ poses["base_link"]


def covariance_of(value: npt.ArrayLike) -> FloatArray:
    """Return a covariance (6, 6) in ROS's order from its 36 numbers.

    Raises:
        DecodeError: If there are not 36 finite numbers.
    """
    flat = np.asarray(value, dtype=float).ravel()
    if flat.shape != (36,) or not np.isfinite(flat).all():
        raise DecodeError(f"a covariance needs 36 finite numbers, got {flat.size}")
    return flat.reshape(6, 6)


def scan_points(message: Message) -> FloatArray:
    """Return the points (N, 3) of a ``LaserScan`` in the scanner's frame [m]; beams without return give none."""
    ranges = np.asarray(message["ranges"], dtype=float)
    angles = float(message["angle_min"]) + float(message["angle_increment"]) * np.arange(
        len(ranges)
    )
    low, high = float(message["range_min"]), float(message["range_max"])
    with np.errstate(invalid="ignore"):
        good = np.isfinite(ranges) & (ranges >= low) & (ranges <= high)
    x, y = ranges[good] * np.cos(angles[good]), ranges[good] * np.sin(angles[good])
    return np.column_stack([x, y, np.zeros(len(x))])


def cloud_of(message: Message) -> tuple[Floats, Floats]:
    """Return points (N, 3) and signed distances to the map (N,) [m] of a ``PointCloud2``.

    Points that are not finite are dropped. A cloud without ``distance`` gives NaN for all.

    Raises:
        DecodeError: If there is no ``x y z`` in float32, or there are fewer bytes than the size requires.
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
