"""What a user says of how the robot of a log is built, where the log does not say."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from localization.logs.frame_tree import SensorLayout


def layout_of(
    mount: Mapping[str, tuple[float, float, float, float]], topics: tuple[str, ...]
) -> SensorLayout:
    """Return the layout of a log.

    Args:
        mount: where frames sit on ``base_link``: x, y, z [m] and yaw [degrees].
        topics: to read; all that are understood if there are none.
    """
    from localization.logs.frame_tree import SensorLayout
    from localization.types import Pose

    mounts = {
        name: Pose.from_euler((x, y, z), yaw=math.radians(degrees))
        for name, (x, y, z, degrees) in mount.items()
    }
    return SensorLayout(mounts=mounts, topics=topics)
