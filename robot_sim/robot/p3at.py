"""The Pioneer 3-AT, the robot that comes with every world unless another is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from localization.types import Pose
from robot_sim.robot.platforms import P3AT as P3AT

MOUNTS: Final[Mapping[str, Pose]] = P3AT().mounts
"""``base_from_scanner`` of each scanner of the P3-AT."""

IMU_MOUNT: Final = P3AT().imu_mount
"""``base_from_imu`` of the P3-AT."""
