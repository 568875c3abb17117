"""The topic ``/local_cloud/lean``: the last sweep in few bytes, for slow links."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.logs.ros_geometry import vector_to_dict
from teleop.robot.tick_record import EstimateRecord
from teleop.robot.topics.message_parts import Messages, header

RESOLUTION: Final = 0.02
"""One step of a coordinate [m]: the noise of planar scanners is 1 to 3 cm."""

MOST_POINTS: Final = 400
"""Number of points of a message: with 7 bytes each, twice a second, 45 kbit/s."""

_FAR: Final = 254
"""Distance to the map of points at 2.54 m or more [cm]."""

_UNKNOWN: Final = 255
"""Distance to the map of points near which nothing is mapped."""

_LIMITS: Final = np.iinfo(np.int16)
_FINEST: Final = 3
"""Edge of the smallest voxels [steps]."""

_POINT: Final = np.dtype([("place", "<i2", (3,)), ("distance", "u1")])

IntArray = npt.NDArray[np.int64]


def lean_cloud(tick: EstimateRecord) -> Messages:
    """Return the last registered sweep in ``map``, thinned and quantised, if it is the first of its half second."""
    e = tick.estimate
    if not tick.lean or e.sweep is None or e.match is None or e.map_from_base is None:
        return ()
    origin = e.map_from_base.position
    return (
        {
            "header": header(e.sweep.stamp, "map"),
            "origin": vector_to_dict(origin),
            "resolution": RESOLUTION,
            "data": packed(e.map_from_base.apply(e.sweep.points) - origin, e.match.distances),
        },
    )


def packed(points: FloatArray, distances: FloatArray) -> bytes:
    """Return points in the form of ``LeanCloud.data``; those beyond the range of int16, 655 m, are left out.

    Args:
        points: (N, 3), relative to the origin [m].
        distances: (N,) distance of each to the map [m]; NaN where nothing mapped is near.
    """
    steps = np.rint(points / RESOLUTION)
    kept = np.flatnonzero(((steps >= _LIMITS.min) & (steps <= _LIMITS.max)).all(axis=1))
    kept = kept[thinned(steps[kept].astype(np.int64), MOST_POINTS)]
    table = np.zeros(len(kept), dtype=_POINT)
    table["place"] = steps[kept]
    centimetres = np.rint(np.abs(distances[kept]) * 100.0)
    known = np.isfinite(centimetres)
    table["distance"] = np.where(
        known, np.minimum(np.where(known, centimetres, 0.0), _FAR), _UNKNOWN
    )
    return table.tobytes()


def thinned(steps: IntArray, most: int) -> npt.NDArray[np.intp]:
    """Return the indices of the first point in each voxel, with voxels as small as ``most`` points allow.

    Args:
        steps: (N, 3) coordinates [steps], within int16.
        most: Largest number of points.
    """
    edge, found = _FINEST, _first_of_voxels(steps, _FINEST)
    while len(found) > most:
        edge += max(1, edge // 4)
        found = _first_of_voxels(steps, edge)
    return found


def _first_of_voxels(steps: IntArray, edge: int) -> npt.NDArray[Any]:
    cells = (steps - _LIMITS.min) // edge
    number = (cells[:, 0] << 32) | (cells[:, 1] << 16) | cells[:, 2]
    return np.sort(np.unique(number, return_index=True)[1])
