"""Facts about the robot of a log, from options of the command line."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from localization.logs.frame_tree import SensorLayout


def layout_of(
    mount: Mapping[str, tuple[float, float, float, float]], topics: tuple[str, ...]
) -> SensorLayout:
    """Return the facts about a log's robot.

    Args:
        mount: Pose of frames on ``base_link``: x, y, z [m] and yaw [degrees].
        topics: Topics to read; if there are none, all of a known type.
    """
    from localization.logs.frame_tree import SensorLayout
    from localization.types import Pose

    mounts = {
        name: Pose.from_euler((x, y, z), yaw=math.radians(degrees))
        for name, (x, y, z, degrees) in mount.items()
    }
    return SensorLayout(mounts=mounts, topics=topics)
