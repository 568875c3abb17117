"""Facts about the robot of a log, from options of the command line."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import tyro

if TYPE_CHECKING:
    from localization.logs.frame_tree import SensorLayout
    from localization.types import Pose

MotionName: TypeAlias = Literal[
    "wheels-and-gyro", "wheels", "gyro", "odometry", "odometry-and-gyro", "scanner"
]
"""Names of the sources of motion, as on the command line."""
Mount: TypeAlias = (
    tuple[float, float, float, float, float, float] | tuple[float, float, float, float]
)
"""x, y, z [m] and roll, pitch, yaw [degrees] of a frame on ``base_link``, or yaw alone."""
MountOptions: TypeAlias = Annotated[dict[str, Mount], tyro.conf.UseAppendAction]
"""Poses of frames by name, of one option or of several."""
TopicOptions: TypeAlias = Annotated[tuple[tuple[str, ...], ...], tyro.conf.UseAppendAction]
"""Topics, of one option or of several."""


def layout_of(mount: Mapping[str, Mount], topics: TopicOptions) -> SensorLayout:
    """Return the facts about a log's robot.

    Args:
        mount: Pose of frames on ``base_link``.
        topics: Topics to read; if there are none, all of a known type.
    """
    from localization.logs.frame_tree import SensorLayout

    mounts = {name: _pose(numbers) for name, numbers in mount.items()}
    return SensorLayout(mounts=mounts, topics=tuple(chain.from_iterable(topics)))


def _pose(mount: Mount) -> Pose:
    from localization.types import Pose

    x, y, z, *angles = mount
    *tilt, yaw = map(math.radians, angles)
    roll, pitch = tilt or (0.0, 0.0)
    return Pose.from_euler((x, y, z), roll=roll, pitch=pitch, yaw=yaw)
