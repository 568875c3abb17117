"""A simulated mission: scene, error of the first pose, injected faults, and the limits of its results.

numpy and the physics engine are imported when they are used, so that the command line can offer these settings
without loading them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated

import tyro

from teleop.errors import SettingError
from teleop.robot.serving.robot_options import RobotOptions, check_slip_times, slip_bursts

if TYPE_CHECKING:
    from localization.types import Hint, Pose
    from robot_sim import SlipFault

_SECOND = 1_000_000_000
"""A second [ns]."""

HINT_STAMP = _SECOND
"""Time at which the hint is given [ns]."""
_TIME_LIMIT = 600.0
"""Largest robot time of a mission without a given duration [s]."""


@dataclass(frozen=True, slots=True)
class MissionLimits:
    """Limits that the results of a run must keep."""

    position_rmse: float = 0.02
    """Largest root mean square of the position error [m]."""
    position_max: float = 0.10
    """Largest position error [m]."""
    heading_rmse: float = math.radians(0.3)
    """Largest root mean square of the heading error [rad]."""
    nees: float = 10.0
    """Largest mean of the normalised estimation error squared of the pose; 6 is consistent."""
    distance: float = 80.0
    """Least distance to drive [m], if the whole tour is driven."""

    def for_tour(self, length: float) -> MissionLimits:
        """Return the limits for a tour: of one too short for ``distance``, four fifths are enough.

        Way-points at the ends of blind alleys are passed at some distance, which shortens the drive.

        Args:
            length: Length of the tour [m].
        """
        # The look-ahead cuts corners: a tour must be a twentieth longer than the distance to drive.
        long_enough = length >= 1.05 * self.distance
        return self if long_enough else replace(self, distance=0.8 * length)


@dataclass(frozen=True, slots=True)
class Mission:
    """One drive: everything that decides its outcome, so that the same mission gives the same bits."""

    scene: str = "office"
    """Scene to drive in: a name, or the path of a folder, a floor plan or an MJCF file."""
    seed: int = 0
    """Seed of all noise and of the direction of the hint's error; the same seed gives the same bits."""
    pose_error: float = 1.0
    """Distance of the hinted position from the true one [m]."""
    heading_error: float = 20.0
    """Difference of the hinted heading from the true one [degrees]."""
    hint_sigma: float = 0.5
    """Standard deviation of x and y that the hint claims [m]."""
    hint_sigma_heading: float = 10.0
    """Standard deviation of the heading that the hint claims [degrees]."""
    slip: Annotated[tuple[float, ...], tyro.conf.arg(metavar="S ...")] = ()
    """Times at which the wheels spin at twice their speed for a second [s]."""
    duration: float | None = None
    """Stop after this robot time [s]; unless given, the whole tour is driven."""
    robot: tyro.conf.OmitArgPrefixes[RobotOptions] = field(default_factory=RobotOptions)
    """Sensors and drive of the robot, and the state of its world."""
    limits: Annotated[MissionLimits, tyro.conf.Suppress] = field(default_factory=MissionLimits)
    """Limits that the results must keep."""

    def __post_init__(self) -> None:
        for name in ("pose_error", "heading_error", "hint_sigma", "hint_sigma_heading"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SettingError(f"{name} must be finite and >= 0, got {value}")
        check_slip_times(self.slip)
        if self.duration is not None and not self.duration > 0.0:
            raise SettingError(f"duration must be > 0 s, got {self.duration}")
        if self.seed < 0:
            raise SettingError(f"seed must be >= 0, got {self.seed}")

    @property
    def time_limit(self) -> int:
        """Time at which the run ends at the latest [ns]."""
        return round((self.duration or _TIME_LIMIT) * _SECOND)

    @property
    def slips(self) -> tuple[SlipFault, ...]:
        """The slip bursts as settings of the simulated drive."""
        return slip_bursts(self.slip)

    def hint(self, spawn: Pose) -> Hint:
        """Return the hint: the true first pose, displaced and turned in a direction given by the seed.

        Args:
            spawn: The true first pose, ``map_from_base``.
        """
        import numpy as np

        from localization.types import Hint, Pose

        rng = np.random.default_rng(np.random.SeedSequence([self.seed, 1]))
        bearing = rng.uniform(-np.pi, np.pi)
        turn = np.deg2rad(self.heading_error) * rng.choice([-1.0, 1.0])
        x = float(spawn.position[0] + self.pose_error * np.cos(bearing))
        y = float(spawn.position[1] + self.pose_error * np.sin(bearing))
        variances = np.zeros(6)
        variances[:2] = self.hint_sigma**2
        variances[5] = np.deg2rad(self.hint_sigma_heading) ** 2
        return Hint(HINT_STAMP, Pose.planar(x, y, spawn.yaw + turn), np.diag(variances))
