"""State of the localiser at one moment, as one value: everything that the next reading is judged by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from localization.config import LocalizerConfig
from localization.filter.ekf import FilterState, initial_state
from localization.monitoring.belief import Belief
from localization.monitoring.health import HealthMonitor
from localization.monitoring.jump_detection import JumpDetector
from localization.monitoring.silence_detection import ListeningTime, SourceTimes
from localization.monitoring.wheel_modes import WheelModes
from localization.motion.kiss_odometry import KissState
from localization.motion.motion_model import MotionModel
from localization.motion.odometry_track import OdometryTrack
from localization.pipeline.scan_synchronizer import ScanSynchronizer
from localization.pipeline.undo import ReplacedEstimate
from localization.relocalization.relocalizer import CurrentPose, RelocalizerState
from localization.types import SECOND, Mounts, Pose


@dataclass(frozen=True, slots=True, eq=False)
class LastSweep:
    """What the next sweep is compared with."""

    stamp: int = 0
    """Time of the last sweep [ns]."""
    odom_from_base: Pose = field(default_factory=Pose.identity)
    """Pose at that time."""
    map_from_base: Pose = field(default_factory=Pose.identity)
    """Pose at that time, corrected by the sweep."""
    listened: int = 0
    """Time listened until then [ns]."""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Forward and to the left [m/s], and turning [rad/s], since the sweep before it."""

    def moved_on(self, seconds: float) -> Pose:
        """Return ``base_then_from_base_now`` of a robot that went on at that velocity."""
        ahead, left, turned = (seconds * rate for rate in self.velocity)
        return Pose.planar(ahead, left, turned)

    def before(self, map_from_base: Pose, odom_from_base: Pose) -> LastSweep:
        """Return the last sweep of a robot that is found somewhere: odometry leads back to where it was then.

        Args:
            map_from_base: where it is found now.
            odom_from_base: now.
        """
        back = odom_from_base.inverse() @ self.odom_from_base
        return replace(self, map_from_base=map_from_base @ back)

    def carried(self, odom_from_base: Pose) -> Pose:
        """Return ``map_from_base`` where odometry leads from it to another ``odom_from_base``."""
        return self.map_from_base @ (self.odom_from_base.inverse() @ odom_from_base)


class State(NamedTuple):
    """The localiser at one moment. ``step`` makes the next state; nothing changes this one.

    Late readings are a fold of ``step`` from an earlier state, and undoing a placement goes back to one. It
    is a tuple with names because the next state is made with every reading, and ``_replace`` is quick.
    """

    motion: MotionModel
    """Readings of wheels and gyro that are not used up yet."""
    filter: FilterState
    """The filter."""
    track: OdometryTrack
    """The recent poses in ``odom``."""
    scans: ScanSynchronizer
    """The scans of the next sweep."""
    wheels: WheelModes
    """Whether the wheels roll or slip."""
    health: HealthMonitor
    """The evidence for and against the estimate."""
    jump: JumpDetector
    """What the last sweep saw, in ``odom``."""
    kiss: KissState
    """Laser odometry."""
    search: RelocalizerState
    """The search for the robot."""
    last: LastSweep
    """The last sweep."""
    agreed: LastSweep
    """The last sweep until which nothing contradicted the wheels."""
    replaced: ReplacedEstimate | None
    """The estimate that the last placement replaced, while that can be undone."""
    stamp: int
    """Time of the newest reading that advanced time [ns]; 0 before the first."""
    odom_from_base: Pose
    """Pose by dead reckoning."""
    placed: bool
    """Whether the filter's pose is one in the map."""
    received: Mapping[str, SourceTimes]
    """Newest reading of each source and how often they arrive: scanners by their frames, "wheels" and "gyro"."""
    left_out: int
    """Number of scans since the last sweep that were left out."""
    listening: ListeningTime
    """Time in which they are missed if they do not come."""

    @classmethod
    def initial(cls, mounts: Mounts, config: LocalizerConfig) -> State:
        """Return the state before the first reading."""
        return cls(
            motion=MotionModel(config.sensors, config.ekf.effective_track, config.health.silence),
            filter=initial_state(config.ekf),
            track=OdometryTrack(max(2 * SECOND, config.late_readings.horizon)),
            scans=ScanSynchronizer(len(mounts), config.scanner_patience),
            wheels=WheelModes.rolling_on(config.wheels, config.sensors, config.ekf),
            health=HealthMonitor(config.health, config.belief, Belief.of_found(config.belief)),
            jump=JumpDetector(config.jump_detection),
            kiss=KissState(),
            search=RelocalizerState(),
            last=LastSweep(),
            agreed=LastSweep(),
            replaced=None,
            stamp=0,
            odom_from_base=Pose.identity(),
            placed=False,
            received={},
            left_out=0,
            listening=ListeningTime(),
        )

    def blind(self, silence: int) -> bool:
        """Return whether scans were left out for longer than a source may be silent [ns]."""
        return self.left_out > 0 and self.stamp - self.last.stamp > silence

    @property
    def current(self) -> CurrentPose:
        """The estimate as the search needs it."""
        health = self.health
        return CurrentPose(
            self.filter.pose,
            self.filter.covariance,
            self.placed,
            health.lost,
            health.doubtful,
            health.belief.odds,
        )
