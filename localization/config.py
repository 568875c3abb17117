"""All settings of the localiser, with their units and where they come from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from localization.filter.ekf import EkfConfig
from localization.matching.matchers import FixedCovariance, Matcher
from localization.matching.registration import RegistrationConfig
from localization.monitoring.extrinsics_monitor import MountWatchConfig
from localization.monitoring.health import HealthConfig
from localization.monitoring.jump_detection import ContinuityConfig
from localization.motion.kiss_odometry import KissConfig
from localization.motion.motion_model import Suite
from localization.pipeline.replay_buffer import RewindConfig
from localization.relocalization.branch_and_bound import MapSearchConfig
from localization.relocalization.hypotheses import HypothesesConfig
from localization.relocalization.window_search import SearchConfig
from localization.types import SECOND

_PLACED_FLAT = (0.05, 0.05, 0.002, 0.001, 0.001, 0.02)
"""``LocalizerConfig.placed`` on a floor whose height and level are known."""


@dataclass(frozen=True, slots=True)
class LocalizerConfig:
    """All settings of the localiser; what is written here is what runs."""

    suite: Suite = field(default_factory=Suite)
    ekf: EkfConfig = field(default_factory=EkfConfig)
    registration: RegistrationConfig = field(default_factory=RegistrationConfig)
    kiss: KissConfig = field(default_factory=KissConfig)
    health: HealthConfig = field(default_factory=HealthConfig)
    mounts: MountWatchConfig = field(default_factory=MountWatchConfig)
    continuity: ContinuityConfig = field(default_factory=ContinuityConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    map_search: MapSearchConfig = field(default_factory=MapSearchConfig)
    hypotheses: HypothesesConfig = field(default_factory=HypothesesConfig)
    matcher: Matcher = Matcher.PLANE
    """What registers sweeps against the cloud."""
    fixed: FixedCovariance = field(default_factory=FixedCovariance)
    """What the poses of a matcher are worth that does not say so."""
    kiss_odometry: bool = True
    """Whether KISS-ICP follows the horizontal scanner; without it nobody watches the wheels for it."""
    second_opinion: bool = True
    """Whether KISS-ICP is asked now and then where the robot is."""
    least_fit: float = 0.3
    """A sweep that the map explains less is refused even if it agrees with the prediction."""
    blame_fit: float = 0.6
    """A sweep that contradicts the prediction must be explained this well for the wheels to be blamed;
    with more than 1 they never are."""
    blame: tuple[float, float, float, float] = (0.12, 0.06, 0.02, np.deg2rad(1.0))
    """How wrong slipping wheels may be over one sweep: forward, sideways, up [m], yaw [rad]."""
    slip_memory: int = SECOND // 2
    """How long after the last sign of slip the wheels are distrusted [ns]."""
    traction: float = 9.0
    """No tyre gives a robot more acceleration than this, about a friction coefficient of 0.9 [m/s^2]."""
    shove: float = 0.3
    """A robot moves no faster than its wheels roll, but for so much: people push, floors slope [m/s]."""
    traction_floor: float = 0.05
    """Change of wheel speed between two readings that noise may cause [m/s]."""
    placed: tuple[float, ...] = (0.05, 0.05, 0.02, 0.01, 0.01, 0.02)
    """How well a pose found by searching is known: x, y, z [m], roll, pitch, yaw [rad], one sigma."""
    opinion_period: int = SECOND
    """Between second opinions [ns]."""
    sweep_period: float = 0.1
    """Sweeps that come faster share their errors, those of the map and of the mounts, and inform together
    like one in this time [s]. What a sweep is worth was set at 10 Hz."""
    judged_over: float = 0.08
    """Wheels and KISS-ICP are held to each other over at least this time [s]: each sweep of a scanner of
    10 Hz, several of faster ones."""
    scanner_patience: int = 60_000_000
    """How long a scan waits for the other scanners' [ns]."""
    undo_memory: int = 60 * SECOND
    """How long a placement can be taken back [ns]. By then KISS-ICP's motion has erred by some 0.3 % of
    the way, 8 cm at half a metre a second."""
    rewind: RewindConfig = field(default_factory=RewindConfig)
    lost_search_period: int = 2 * SECOND
    """Between searches around a lost estimate [ns]."""

    def __post_init__(self) -> None:
        known = ", ".join(repr(m.value) for m in Matcher)
        if self.matcher not in list(Matcher):
            raise ValueError(f"matcher must be one of {known}, got {self.matcher!r}")
        object.__setattr__(self, "matcher", Matcher(self.matcher))

    @classmethod
    def of(cls, suite: Suite) -> LocalizerConfig:
        """Return the settings that suit a suite of sensors."""
        config = cls(suite=suite, ekf=suite.ekf())
        return replace(config, placed=_PLACED_FLAT) if suite.flat else config
