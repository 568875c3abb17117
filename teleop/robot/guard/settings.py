"""Numbers that decide how near, and how fast."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from localization.types import SECOND
from teleop.errors import SettingError

CREEP: Final = 0.15
"""Speed at which the robot may go where it does not see [m/s]: half of what ISO 3691-4 is said to allow where detection
is muted, 0.3 m/s, for the robot's bumpers give way by millimetres."""


@dataclass(frozen=True, slots=True)
class GuardConfig:
    """Settings of the guard; each term is explained in docs/safety.md."""

    margin: float = 0.036
    """Distance that is kept at rest [m]: three sigma of the scanners' ranges, 12 mm (SICK LMS1xx)."""
    skew: float = 0.05
    """Time that is multiplied with the speed of the robot's fastest point, and added to the margin [s]: stands for the
    turn of a skid-steer, a tenth off (docs/robot.md), and for odometry; chosen."""
    worn: float = 0.7
    """Share of the drive's braking that is counted on: Z_B of scanner makers' manuals, brakes that are worn; chosen."""
    lag: float = 0.05
    """Time until a command reaches the wheels [s]: a tick, and the lag of the servos, 0.03 s."""
    approach: float = 1.6
    """Speed at which what moves is taken to come on [m/s]: K of ISO 13855, a walking person."""
    arm_zone: float = 1.4
    """Distance from the arm within which a person who comes nearer stops it [m]: C of ISO 13855, at least 0.85 m, and 1.6 m/s
    for a scan, a tick and the arm's braking, 0.35 s in all."""
    slow_scan: int = 3 * SECOND // 10
    """Silence of the horizontal scanner from which on the robot creeps [ns]."""
    late_scan: int = SECOND
    """Silence of it from which on the robot stops [ns]; backing out as it came, and turning, stay possible."""
    half_blind: float = 0.3
    """Speed without the vertical scanner [m/s]: reduced speed where detection is muted, ISO 3691-4 as quoted."""
    lost: float = 0.3
    """Speed while the pose is suspect or lost [m/s]: the same."""
    steep: float = 0.44
    """Tilt above which the robot creeps [rad]: 25 degrees. It tips at about 40 lengthways, and no drivable slope of the
    worlds is steeper than 19."""
    stalled: int = 3 * SECOND
    """Time for which stalled motors push until the robot is disarmed [ns]."""

    def __post_init__(self) -> None:
        for name in (
            *("margin", "skew", "worn", "lag", "approach"),
            *("arm_zone", "half_blind", "lost", "steep"),
        ):
            if not 0.0 < getattr(self, name) < 10.0:
                raise SettingError(
                    f"guard {name} must be > 0 and < 10, got {getattr(self, name):g}; "
                    f"{GuardConfig.__dataclass_fields__[name].default} is the default"
                )
        if not 0 < self.slow_scan < self.late_scan:
            raise SettingError(
                f"guard slow_scan must be > 0 ns and less than late_scan, {self.late_scan}, got {self.slow_scan}"
            )
