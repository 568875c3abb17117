"""Scans of points as ``sensor_msgs/PointCloud2``."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from localization.geometry import FloatArray
from localization.logs.ros_stamps import stamp_from_message
from localization.logs.ros_types import POINT_CLOUD, Message, MessageError, build, header_message
from localization.types import PointScan

_POINT: Final = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<u4")])
_DATATYPES: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""Kinds of numbers in ``sensor_msgs/PointField``."""
_LONGEST: Final = 1e9
"""Time after the stamp [ns] from which a number is an absolute time."""


def points_message(scan: PointScan) -> Message:
    """Return ``PointCloud2`` with x, y, z [m] and each point's time ``t`` after the stamp [ns].

    Raises:
        MessageError: If float32 and uint32 cannot hold the numbers exactly.
    """
    table = np.zeros(len(scan.points), dtype=_POINT)
    for i, name in enumerate("xyz"):
        table[name] = scan.points[:, i]
    table["t"] = scan.offsets
    exact = all((table[name] == scan.points[:, i]).all() for i, name in enumerate("xyz"))
    if not exact or (table["t"] != scan.offsets).any():
        raise MessageError(
            f"points of {scan.scanner} at {scan.stamp} ns must be of float32 resolution, and their"
            " times within 4 s"
        )
    fields = [
        build("sensor_msgs/msg/PointField", name=name, offset=4 * i, datatype=kind, count=1)
        for i, (name, kind) in enumerate(zip("xyzt", (7, 7, 7, 6), strict=True))
    ]
    return build(
        POINT_CLOUD,
        header=header_message(scan.stamp, scan.scanner),
        height=1,
        width=len(table),
        fields=fields,
        is_bigendian=False,
        point_step=_POINT.itemsize,
        row_step=_POINT.itemsize * len(table),
        data=np.frombuffer(table.tobytes(), dtype=np.uint8),
        is_dense=True,
    )


def read_points(message: Message) -> PointScan:
    """Return the finite points of a ``PointCloud2``, with their times if it has any.

    Times are read from the fields ``t``, ``time``, ``timestamp`` or ``offset_time``: integers and floats from 2^31 on
    are nanoseconds, other floats seconds, either since the stamp or absolute.

    Raises:
        MessageError: If it has no x, y and z, or fewer bytes than its size or its fields need.
    """
    order = ">" if message.is_bigendian else "<"
    fields = {
        str(f.name): (order + _DATATYPES[f.datatype], int(f.offset))
        for f in message.fields
        if f.datatype in _DATATYPES
    }
    if missing := [name for name in "xyz" if name not in fields]:
        raise MessageError(f"a cloud without {' and '.join(missing)}; it has: {', '.join(fields)}")
    try:
        dtype = np.dtype(
            {
                "names": list(fields),
                "formats": [f for f, _ in fields.values()],
                "offsets": [o for _, o in fields.values()],
                "itemsize": int(message.point_step),
            }
        )
    except ValueError:
        raise MessageError(
            f"a cloud whose fields {', '.join(fields)} do not fit its {message.point_step} bytes a point"
        ) from None
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
        # ROS counts seconds in 32 bits: a larger float is in nanoseconds, as Livox's drivers write it.
        whole = times.dtype.kind in "iu" or np.abs(times).max(initial=0.0) >= 2**31
        unit = 1.0 if whole else 1e9
        since: FloatArray = np.asarray(times * unit, dtype=np.float64)
        if np.abs(since).max(initial=0.0) >= _LONGEST:
            # Absolute times: subtract the stamp before float64 rounds them to a quarter microsecond.
            since = np.asarray(times - (stamp if whole else stamp * 1e-9), dtype=np.float64)
            since *= unit
        if np.isfinite(since).all() and np.abs(since).max(initial=0.0) < _LONGEST:
            return np.rint(since).astype(np.int64)
    return np.zeros(len(table), dtype=np.int64)
