"""A mission: where, how wrong the first pose is, what goes wrong on the way, and what must come out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from localization.types import SECOND, Hint, Pose
from robot_sim import SlipFault
from teleop.robot.robot_options import RobotOptions

HINT_STAMP = SECOND
"""When the hint is given [ns]."""
_TIME_LIMIT = 600.0


@dataclass(frozen=True, slots=True)
class MissionLimits:
    """What a run must keep to."""

    position_rmse: float = 0.02
    """[m]."""
    position_max: float = 0.10
    """[m]."""
    heading_rmse: float = float(np.deg2rad(0.3))
    """[rad]."""
    nees: float = 10.0
    """Mean of the squared position and rotation error over its covariance; 6 is honest."""
    distance: float = 80.0
    """To be driven at least [m], if the whole tour is driven."""

    def for_tour(self, length: float) -> MissionLimits:
        """Return the limits for a tour of that length [m]: of one too short for them four fifths are enough.

        Way-points at the ends of blind alleys are passed at some distance, which shortens the drive.
        """
        # Corners are cut by a look-ahead: a tour must be a twentieth longer than what is to be driven.
        long_enough = length >= 1.05 * self.distance
        return self if long_enough else replace(self, distance=0.8 * length)


@dataclass(frozen=True, slots=True)
class Mission:
    """One drive: everything that decides its outcome, so that the same mission gives the same bits."""

    scene: str = "office"
    seed: int = 0
    """Of sensor noise, biases and of the way in which the first pose is wrong."""
    pose_error: float = 1.0
    """How far the hinted pose is from the true one [m]."""
    heading_error: float = 20.0
    """How far it is turned from it [degrees]."""
    hint_sigma: float = 0.5
    """How sure the operator claims to be, one sigma of x and y [m]."""
    hint_sigma_heading: float = 10.0
    """The same for heading [degrees]."""
    slip: tuple[float, ...] = ()
    """Times at which all wheels spin at twice their speed for a second [s]."""
    duration: float | None = None
    """Stop after so much robot time [s]; None drives the whole tour."""
    options: RobotOptions = field(default_factory=RobotOptions)
    """Of the robot, and the state of its world."""
    limits: MissionLimits = field(default_factory=MissionLimits)

    def __post_init__(self) -> None:
        for name in ("pose_error", "heading_error", "hint_sigma", "hint_sigma_heading"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be finite and >= 0, got {value}")
        if self.duration is not None and not self.duration > 0.0:
            raise ValueError(f"duration must be > 0 s, got {self.duration}")
        if self.seed < 0:
            raise ValueError(f"seed must be >= 0, got {self.seed}")

    @property
    def time_limit(self) -> int:
        """When the run ends at the latest [ns]."""
        return round((self.duration or _TIME_LIMIT) * SECOND)

    @property
    def slips(self) -> tuple[SlipFault, ...]:
        """The slip bursts as the simulator wants them."""
        return tuple(SlipFault(round(t * SECOND), SECOND, 2.0) for t in self.slip)

    def hint(self, spawn: Pose) -> Hint:
        """Return the hint: the true first pose, moved and turned by the errors, which way by the seed."""
        rng = np.random.default_rng(np.random.SeedSequence([self.seed, 1]))
        bearing = rng.uniform(-np.pi, np.pi)
        turn = np.deg2rad(self.heading_error) * rng.choice([-1.0, 1.0])
        x = float(spawn.position[0] + self.pose_error * np.cos(bearing))
        y = float(spawn.position[1] + self.pose_error * np.sin(bearing))
        variances = np.zeros(6)
        variances[:2] = self.hint_sigma**2
        variances[5] = np.deg2rad(self.hint_sigma_heading) ** 2
        return Hint(HINT_STAMP, Pose.planar(x, y, spawn.yaw + turn), np.diag(variances))
