"""Settings of the calibration of scanner mounts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
"""Axes of a correction: displacement along and small rotation about ``base_link``'s axes through the scanner."""


@dataclass(frozen=True, slots=True)
class CalibrationConfig:
    """Prior knowledge of mounts and noise of the measurements; all uncertainties are one sigma."""

    prior_sigma: tuple[float, float] = (0.05, np.deg2rad(3.0))
    """Uncertainty of a mount as it was given [m, rad]."""
    sigma: float = 0.02
    """Distance of a point from its plane [m]; as in ``RegistrationConfig``."""
    effective_points: float = 60.0
    """A scan informs like this many independent points at most: neighbouring beams have common errors."""
    kernels: tuple[float, ...] = (0.15, 0.15, 0.10, 0.07, 0.05, 0.04, 0.04)
    """Geman-McClure scale of each iteration [m]."""
    gate: float = 3.0
    """Points farther from their plane than this many kernels are left out."""
    lateral_slip: float = 0.006
    """Sideways motion while driving [m/sqrt(s)]; as in ``EkfConfig``."""
    forward_error: float = 0.03
    """Error of the distance driven, as a fraction of it."""
    pivot_sigma: float = 0.10
    """Distance of the point that the robot turns about from its nominal place [m]; constant over the drive."""
    ground_sigma: tuple[float, float] = (0.005, np.deg2rad(0.2))
    """Error of the ground's height [m] and level [rad] that is common to the whole drive."""
    uneven_ground_sigma: tuple[float, float] = (0.02, np.deg2rad(1.5))
    """Departure of the robot from ground that is not level, independent from sweep to sweep [m, rad]."""
    min_sigma: tuple[float, float] = (0.001, np.deg2rad(0.03))
    """Lower bound of an estimated mount's uncertainty [m, rad], added in squares."""
    segment_samples: int = 12
    """Number of sweeps in a segment of the drive; errors within a segment count as correlated."""
    max_samples: int = 300
    """Number of sweeps used at most, evenly chosen: more cost time and add little information."""
    observable_share: float = 0.4
    """An axis is observable if its sigma falls below this fraction of the prior's."""
