"""Settings of mapping without known poses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from localization.errors import LocalizationError
from localization.mapping.drive_knots import RefinementConfig
from localization.mapping.gyro_heading import GyroHeadingConfig
from localization.mapping.loop_closure_types import ClosureConfig
from localization.mapping.odometry_front_end import OdometerConfig
from localization.mapping.pose_front_end import PoseOdometerConfig
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import SECOND


class MappingError(LocalizationError):
    """Readings that allow no map; one line names the reason and what would work."""


@dataclass(frozen=True, slots=True)
class SlamConfig:
    """Settings of mapping without known poses."""

    odometer: OdometerConfig = field(default_factory=OdometerConfig)
    """Settings of the odometry."""
    pose_odometer: PoseOdometerConfig = field(default_factory=PoseOdometerConfig)
    """Settings of the odometry of a base that integrates poses by itself."""
    closures: ClosureConfig = field(default_factory=ClosureConfig)
    """Settings of the loop closure."""
    refinement: RefinementConfig = field(default_factory=RefinementConfig)
    """Settings of the final refinement."""
    keep_distance: float = 0.02
    """A sweep is kept after the robot has moved this far [m]."""
    keep_turn: float = np.deg2rad(1.0)
    """A sweep is also kept after the robot has turned by this angle [rad]."""
    keep_pause: int = SECOND // 2
    """A sweep is also kept after this time [ns]: a few sweeps of a standing robot reduce the noise."""
    key_distance: float = 0.5
    """A key frame is made after the robot has moved this far [m]."""
    key_turn: float = np.deg2rad(20.0)
    """A key frame is also made after the robot has turned by this angle [rad]."""
    edge_floor: tuple[float, float] = (0.003, np.deg2rad(0.05))
    """Lower bound of the odometry's error between key frames, one sigma [m, rad]."""
    gyro: GyroHeadingConfig = field(default_factory=GyroHeadingConfig)
    """Errors of the headings that a gyro measures between key frames."""
    passes: int = 4
    """Number of searches for loops at most; closed loops make others easier to find."""
    min_distance: float = 2.0
    """Least length of a drive [m]."""

    @classmethod
    def of(cls, suite: SensorConfiguration, *, level: bool = True) -> SlamConfig:
        """Return the settings for a robot's sensors, on level ground or not."""
        flat = suite.flat or level
        odometer = OdometerConfig(sensors=SensorConfiguration(suite.motion, flat=flat))
        if suite.motion in (Motion.ODOMETRY, Motion.ODOMETRY_AND_GYRO):
            # Poses of a base that may drift by metres; the scans alone hold the map's heading.
            return cls(
                odometer=odometer,
                pose_odometer=PoseOdometerConfig(gyro=suite.gyro),
                gyro=GyroHeadingConfig(scale=0.01),
                closures=ClosureConfig(
                    drift=0.002,
                    drift_yaw=0.0,
                    walk=0.04,
                    walk_yaw=np.deg2rad(0.4),
                    max_window=10.0,
                    min_distance=12.0,
                    candidates_per_key=2,
                ),
                refinement=RefinementConfig(rounds=0, level=True),
                key_turn=np.deg2rad(25.0),
                edge_floor=(0.01, np.deg2rad(0.2)),
            )
        return cls(odometer=odometer, refinement=RefinementConfig(level=flat))
