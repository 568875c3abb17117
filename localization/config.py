"""All settings of the localiser, and how they are kept as JSON in logs and run folders."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast, get_type_hints

import numpy as np

from localization.errors import LocalizationError
from localization.filter.ekf_config import EkfConfig
from localization.matching.matchers import FixedCovariance, Matcher
from localization.matching.registration import RegistrationConfig
from localization.matching.scan_consistency import ScanConsistencyConfig
from localization.monitoring.belief import BeliefConfig
from localization.monitoring.extrinsics_monitor import ExtrinsicsMonitorConfig
from localization.monitoring.health import HealthConfig
from localization.monitoring.jump_detection import JumpDetectionConfig
from localization.monitoring.wheel_modes import WheelConfig
from localization.motion.kiss_icp import KissConfig
from localization.motion.late_readings import LateReadingsConfig
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.relocalization.branch_and_bound import MapSearchConfig
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_schedule import SearchScheduleConfig
from localization.types import SECOND

_KISS_POSITION = 0.025
"""``KissConfig.sigma_floor`` without a gyro, which would show how the robot turned during a sweep [m]."""
_KISS_ANGLE = np.deg2rad(0.6)
"""``KissConfig.sigma_floor_angle`` without a gyro [rad]."""


@dataclass(frozen=True, slots=True)
class LocalizerConfig:
    """All settings of the localiser; what is no setting is a constant beside the code that uses it."""

    sensors: SensorConfiguration = field(default_factory=SensorConfiguration)
    ekf: EkfConfig = field(default_factory=EkfConfig)
    registration: RegistrationConfig = field(default_factory=RegistrationConfig)
    kiss: KissConfig = field(default_factory=KissConfig)
    health: HealthConfig = field(default_factory=HealthConfig)
    belief: BeliefConfig = field(default_factory=BeliefConfig)
    extrinsics_monitor: ExtrinsicsMonitorConfig = field(default_factory=ExtrinsicsMonitorConfig)
    jump_detection: JumpDetectionConfig = field(default_factory=JumpDetectionConfig)
    wheels: WheelConfig = field(default_factory=WheelConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    map_search: MapSearchConfig = field(default_factory=MapSearchConfig)
    search_schedule: SearchScheduleConfig = field(default_factory=SearchScheduleConfig)
    scan_consistency: ScanConsistencyConfig = field(default_factory=ScanConsistencyConfig)
    matcher: Matcher = Matcher.PLANE
    """The method that registers sweeps against the cloud."""
    fixed_covariance: FixedCovariance = field(default_factory=FixedCovariance)
    """The covariance assumed for a matcher that reports none."""
    kiss_odometry: bool = True
    """Whether KISS-ICP tracks the horizontal scanner; without it wheel slip is detected less often."""
    min_inlier_ratio: float = 0.3
    """A sweep of which the map explains a smaller share is rejected even if it agrees with the prediction."""
    good_inlier_ratio: float = 0.6
    """A sweep of which the map explains this share fits it: only such a one is tried with a wider prior if it contradicts
    the prediction; above 1, none is."""
    retry_sigma: tuple[tuple[float, float, float, float], ...] = (
        (0.15, 0.10, 0.01, np.deg2rad(3.0)),
        (0.35, 0.25, 0.01, np.deg2rad(10.0)),
    )
    """Errors by which the prior is widened, one after the other, for a sweep that fits the map but not the
    prediction, one sigma: forward, sideways, up [m], yaw [rad]. The first is also what wheels may have slipped by since
    the last sweep."""
    retry_below: float = 0.8
    """Where motion comes as displacements, a sweep of which the map explains a smaller share is tried with wider
    priors, and from other headings."""
    sweep_distance: float = 0.03
    """Sweeps that come as displacements count in full if the robot has moved on by this distance [m]."""
    map_share: float = 0.7
    """Part of the noise of a map's points that all points near a place have in common: however many sweeps are
    registered there, the position is known no better."""
    scanner_patience: int = 60_000_000
    """A scan waits at most this long for those of the other scanners [ns]."""
    undo_memory: int = 60 * SECOND
    """A placement can be undone for this long [ns]. By then KISS-ICP's motion has an error of about 0.3 %
    of the distance travelled: 8 cm at half a metre a second."""
    late_readings: LateReadingsConfig = field(default_factory=LateReadingsConfig)

    def __post_init__(self) -> None:
        known = ", ".join(repr(m.value) for m in Matcher)
        if self.matcher not in list(Matcher):
            raise LocalizationError(f"matcher must be one of {known}, got {self.matcher!r}")
        object.__setattr__(self, "matcher", Matcher(self.matcher))

    @classmethod
    def of(cls, sensors: SensorConfiguration) -> LocalizerConfig:
        """Return the settings that suit a robot's sensors."""
        config = cls(sensors=sensors, ekf=EkfConfig.of(sensors))
        if sensors.displaced:
            kiss = replace(config.kiss, sigma_floor=_KISS_POSITION, sigma_floor_angle=_KISS_ANGLE)
            config = replace(config, kiss=kiss)
        return config

    def require_suited(self) -> None:
        """Check that the filter is not set for other sensors, as by ``LocalizerConfig(sensors=...)``.

        Raises:
            LocalizationError: If its settings are those that suit other sensors.
        """
        if self.ekf != EkfConfig.of(self.sensors) and self.ekf in _usual():
            given = f"{self.sensors.motion}{' on a flat floor' if self.sensors.flat else ''}"
            raise LocalizationError(
                f"the filter is set for other sensors than {given}: begin with LocalizerConfig.of(sensors), and"
                " replace what differs"
            )


@functools.cache
def _usual() -> tuple[EkfConfig, ...]:
    """Return the filter's settings for all kinds of sensors."""
    kinds = (SensorConfiguration(motion, flat) for motion in Motion for flat in (False, True))
    return tuple(map(EkfConfig.of, kinds))


_T = TypeVar("_T")


def to_json(config: Any) -> dict[str, Any]:
    """Return a configuration dataclass as plain values."""
    return dataclasses.asdict(config)


def from_json(kind: type[_T], values: dict[str, Any]) -> _T:
    """Build a configuration dataclass from plain values.

    Raises:
        LocalizationError: if there is no setting of a name, or the values are not a mapping.
    """
    if not isinstance(values, dict):
        raise LocalizationError(f"settings of {kind.__name__} must be a mapping, got {values!r}")
    hints = get_type_hints(kind)
    unknown = sorted(set(values) - set(hints))
    if unknown:
        raise LocalizationError(f"unknown setting {unknown[0]!r} of {kind.__name__}")
    given = {
        name: from_json(cast("type[Any]", hints[name]), value)
        if dataclasses.is_dataclass(hints[name])
        else _tuples(value)
        for name, value in values.items()
    }
    return kind(**given)


def _tuples(value: Any) -> Any:
    """Return a value with tuples for JSON's lists."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def known_settings(kind: type[Any], values: dict[str, Any]) -> dict[str, Any]:
    """Return the values of settings that a configuration dataclass has, at any depth."""
    hints = get_type_hints(kind)
    return {
        name: known_settings(hints[name], value)
        if dataclasses.is_dataclass(hints[name]) and isinstance(value, dict)
        else value
        for name, value in values.items()
        if name in hints
    }


def unknown_settings(kind: type[Any], values: dict[str, Any]) -> Iterator[str]:
    """Yield the names of settings that a configuration dataclass lacks, at any depth, such as ``ekf.track``."""
    hints = get_type_hints(kind)
    for name, value in values.items():
        if name not in hints:
            yield name
        elif dataclasses.is_dataclass(hints[name]) and isinstance(value, dict):
            inside = unknown_settings(cast("type", hints[name]), value)
            yield from (f"{name}.{inner}" for inner in inside)
