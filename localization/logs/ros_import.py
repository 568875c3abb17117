"""Readings out of anybody's ROS messages, ROS 1 or ROS 2: whatever frames and joints they come in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from localization.geometry import FloatArray
from localization.logs import ros_messages as messages
from localization.logs.ros_geometry import pose_from_transform
from localization.logs.ros_messages import Message, MessageError
from localization.logs.ros_stamps import stamp_from_message
from localization.types import (
    Inertial,
    PointScan,
    Pose,
    Reading,
    WheelSpeeds,
)

_SCANS: Final = (messages.LASER_SCAN, messages.POINT_CLOUD)

_WORLD_FRAMES: Final = frozenset({"map", "odom", "world", "earth"})
_DATATYPES: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""Of ``sensor_msgs/PointField``."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How a robot that recorded a log is built, as far as its log does not say."""

    base: str = "base_link"
    """Frame between the wheels."""
    mounts: Mapping[str, Pose] = field(default_factory=dict)
    """``base_from_frame`` of frames, before what the log says."""
    wheel_radius: float = messages.WHEEL_RADIUS
    """By which joint velocities become rim speeds [m]."""
    topics: tuple[str, ...] = ()
    """Topics to read; all whose type is known unless given."""


class FrameTree:
    """Which frame hangs on which, as static transforms say."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._links: dict[str, dict[str, Pose]] = {}

    def add(self, message: Message) -> None:
        """Take the transforms of a ``TFMessage``; those from or to the world are nobody's mount."""
        for link in message.transforms:
            parent, child = (_bare(f) for f in (link.header.frame_id, link.child_frame_id))
            if parent in _WORLD_FRAMES or child in _WORLD_FRAMES:
                continue
            pose = pose_from_transform(link.transform)
            self._links.setdefault(parent, {})[child] = pose
            self._links.setdefault(child, {})[parent] = pose.inverse()

    def base_from(self, frame: str) -> Pose | None:
        """Return ``base_from_frame``, or None if nothing connects the two."""
        frame = _bare(frame)
        if frame in self._layout.mounts:
            return self._layout.mounts[frame]
        base = _bare(self._layout.base)
        found = {base: Pose.identity()}
        waiting = [base]
        while waiting and frame not in found:
            at = waiting.pop(0)
            for neighbour, step in self._links.get(at, {}).items():
                if neighbour not in found:
                    found[neighbour] = found[at] @ step
                    waiting.append(neighbour)
        return found.get(frame)

    @property
    def frames(self) -> tuple[str, ...]:
        """All frames there are, sorted."""
        return tuple(sorted({*self._links, *self._layout.mounts}))


def read(kind: str, message: Any, tree: FrameTree, layout: Layout) -> Reading | None:
    """Return the reading in a message; None if its type holds none.

    Args:
        kind: type, such as ``sensor_msgs/msg/Imu``.
        message: decoded by rosbags.
        tree: to bring inertial readings into the base's axes.
        layout: of the robot.

    Raises:
        MessageError: if it should hold one and does not.
    """
    match kind:
        case messages.LASER_SCAN:
            return messages.read_scan(message)
        case messages.POINT_CLOUD:
            return read_points(message)
        case messages.IMU:
            return _inertial(message, tree)
        case messages.ODOMETRY:
            return messages.read_odometry(message)
        case messages.JOINT_STATE:
            return _wheels(message, layout.wheel_radius)
        case messages.POSE_WITH_COVARIANCE:
            return messages.read_hint(message)
    return None


def read_points(message: Message) -> PointScan:
    """Return the points of a ``PointCloud2`` that are finite, with their times if it has some.

    Times are looked for in the fields ``t``, ``time``, ``timestamp`` and ``offset_time``: integers count
    nanoseconds, floats seconds, since the stamp or as absolute time.

    Raises:
        MessageError: if it has no x, y and z.
    """
    order = ">" if message.is_bigendian else "<"
    fields = {
        str(f.name): (order + _DATATYPES[f.datatype], int(f.offset))
        for f in message.fields
        if f.datatype in _DATATYPES
    }
    if missing := [name for name in "xyz" if name not in fields]:
        raise MessageError(f"a cloud without {' and '.join(missing)}; it has: {', '.join(fields)}")
    dtype = np.dtype(
        {
            "names": list(fields),
            "formats": [f for f, _ in fields.values()],
            "offsets": [o for _, o in fields.values()],
            "itemsize": int(message.point_step),
        }
    )
    rows = np.frombuffer(bytes(message.data), dtype=np.uint8)
    height, width, step = int(message.height), int(message.width), int(message.row_step)
    if len(rows) < height * step or width * dtype.itemsize > step:
        raise MessageError(
            f"a cloud of {height} x {width} points in {len(rows)} bytes is cut short"
        )
    packed = np.ascontiguousarray(
        rows[: height * step].reshape(height, step)[:, : width * dtype.itemsize]
    )
    table = packed.reshape(-1).view(dtype)
    points = np.stack([table[name].astype(float) for name in "xyz"], axis=1)
    stamp = stamp_from_message(message.header.stamp)
    offsets = _offsets(table, stamp)
    real = np.isfinite(points).all(axis=1) & (np.abs(points).max(axis=1, initial=0.0) > 0.0)
    begin = min(0, int(offsets[real].min(initial=0)))
    return PointScan(
        stamp=stamp + begin,
        scanner=str(message.header.frame_id),
        points=points[real],
        offsets=offsets[real] - begin,
    )


def _offsets(table: np.ndarray[Any, np.dtype[np.void]], stamp: int) -> np.ndarray[Any, Any]:
    for name in ("t", "time", "timestamp", "offset_time"):
        if table.dtype.names is None or name not in table.dtype.names:
            continue
        times = table[name]
        whole = times.dtype.kind in "iu"
        since: FloatArray = np.asarray(times if whole else times * 1e9, dtype=np.float64)
        if np.abs(since).max(initial=0.0) > 1e15:
            # Absolute: taken from the stamp before a float64 rounds it to a quarter microsecond.
            since = np.asarray(times - (stamp if whole else stamp * 1e-9), dtype=np.float64)
            since = since if whole else since * 1e9
        if np.isfinite(since).all() and np.abs(since).max(initial=0.0) < 1e9:
            return np.rint(since).astype(np.int64)
    return np.zeros(len(table), dtype=np.int64)


def _inertial(message: Message, tree: FrameTree) -> Inertial:
    reading = messages.read_inertial(message)
    mount = tree.base_from(str(message.header.frame_id))
    if mount is None:
        return reading
    turn = mount.rotation
    return Inertial(reading.stamp, turn @ reading.angular_velocity, turn @ reading.specific_force)


def _wheels(message: Message, radius: float) -> WheelSpeeds:
    """Rim speeds of both sides: means over all wheels whose names say which side they are on."""
    velocity = dict(zip(message.name, message.velocity, strict=False))
    sides = {
        side: [float(v) for name, v in velocity.items() if side in name and "wheel" in name]
        for side in ("left", "right")
    }
    if missing := [side for side, rates in sides.items() if not rates]:
        raise MessageError(
            f"no velocity of a {' or a '.join(missing)} wheel in joints {list(message.name)}"
        )
    left, right = (float(np.float32(radius * np.mean(sides[s]))) for s in ("left", "right"))
    if not (math.isfinite(left) and math.isfinite(right)):
        raise MessageError(f"wheel velocities must be finite, got {velocity}")
    return WheelSpeeds(stamp_from_message(message.header.stamp), left, right)


def is_scan(kind: str) -> bool:
    """Return whether messages of a type come from a scanner."""
    return kind in _SCANS


def _bare(frame: str) -> str:
    """Frame names of tf 1 may begin with a slash, and mean the same."""
    return str(frame).lstrip("/")
