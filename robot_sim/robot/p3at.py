"""Pioneer 3-AT, the default robot of every world, with the mounts of its sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from localization.types import Pose
from robot_sim.robot.platforms import P3AT as P3AT

MOUNTS: Final[Mapping[str, Pose]] = P3AT().mounts
"""``base_from_scanner`` of each scanner of the P3-AT."""

IMU_MOUNT: Final = P3AT().imu_mount
"""``base_from_imu`` of the P3-AT."""
