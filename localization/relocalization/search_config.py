"""Settings of the search for a robot's pose in the map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class SearchConfig:
    """How the map is searched, and what counts as one place."""

    step: float = 0.10
    """Distance between candidate positions [m]; the floor plan's cells are half as large."""
    step_yaw: float = np.deg2rad(2.0)
    """Angle between candidate headings [rad]."""
    field_sigma: float = 0.12
    """A point at this distance from the nearest wall scores exp(-1/2) [m]."""
    compared: int = 2
    """Number of the distinct places that are compared with their neighbours along the weakest direction,
    up to ``default_sigma`` away."""
    default_sigma: float = 0.5
    """Error of a hint with all-zero covariance, in x and y, one sigma [m]."""
    default_sigma_yaw: float = np.deg2rad(15.0)
    """Error of a hint with all-zero covariance, in heading, one sigma [rad]."""
    max_tilt: float = np.deg2rad(2.0)
    """Places that need more tilt from level than this are rejected [rad]: pitched far enough, the points of
    a wall that is not there lie on the floor."""
    max_tilt_uneven: float = np.deg2rad(4.5)
    """Largest tilt from the slope of uneven ground [rad]: 3 cm, the roughness of such ground, under one of
    two wheels 0.39 m apart."""

    @property
    def same_place(self) -> float:
        """Poses nearer to each other than this are one place [m]: three steps."""
        return 3.0 * self.step

    @property
    def same_yaw(self) -> float:
        """Headings of one place differ by less than this [rad]: five steps."""
        return 5.0 * self.step_yaw

    @property
    def cell(self) -> float:
        """Edge of the floor plan's cells [m]."""
        return 0.5 * self.step
