"""ROS time stamps and integer nanoseconds.

A ROS stamp has seconds and nanoseconds: ``sec`` and ``nanosec`` in ROS 2, ``secs`` and ``nsecs`` in ROS 1.
It comes as an object with attributes, as rosbags decodes it, or as a mapping, as rosbridge carries it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from localization.types import SECOND


def stamp_to_dict(stamp: int) -> dict[str, int]:
    """Return a stamp [ns] as the ROS 2 message ``builtin_interfaces/Time`` in a dictionary."""
    sec, nanosec = divmod(stamp, SECOND)
    return {"sec": sec, "nanosec": nanosec}


def stamp_from_message(time: Any) -> int:
    """Return the stamp [ns] of a ROS 1 or ROS 2 time message, which may be an object or a mapping.

    Raises:
        KeyError: If a mapping lacks the fields of a stamp.
        AttributeError: If an object lacks the attributes of a stamp.
    """
    if isinstance(time, Mapping):
        if "secs" in time or "nsecs" in time:
            return int(time["secs"]) * SECOND + int(time["nsecs"])
        return int(time["sec"]) * SECOND + int(time["nanosec"])
    return int(time.sec) * SECOND + int(time.nanosec)
