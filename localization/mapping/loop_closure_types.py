"""Loop closures, their settings, and the counts of rejected candidates."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.submap import SubmapConfig


class Rejection(StrEnum):
    """Reason for rejecting a candidate by itself."""

    UNEXPLAINED = "unexplained"
    AMBIGUOUS = "ambiguous"
    IMPOSSIBLE = "impossible"
    CONTRADICTED = "contradicted"


@dataclass(frozen=True, slots=True)
class ClosureConfig:
    """Settings of the search for loop closures and of their acceptance."""

    submap: SubmapConfig = field(default_factory=SubmapConfig)
    """Settings of submaps."""
    submap_distance: float = 1.5
    """Length of the drive before and after a key frame whose sweeps make its submap [m]."""
    min_distance: float = 5.0
    """Least distance driven between two visits [m]."""
    reach: float = 2.0
    """Greatest distance between two visits [m]; farther apart they see too little in common."""
    drift: float = 0.01
    """Drift of the odometry, one sigma, as a fraction of the distance driven: twice KISS-ICP's best."""
    drift_yaw: float = np.deg2rad(0.1)
    """Drift of the heading, one sigma [rad/m]."""
    walk: float = 0.0
    """Drift that grows with the root of the distance driven, one sigma [m/sqrt(m)]."""
    walk_yaw: float = 0.0
    """The same of the heading, one sigma [rad/sqrt(m)]; it moves what lies far from where the drive has been since."""
    floor: tuple[float, float] = (0.02, np.deg2rad(0.5))
    """Difference of two submaps of the same place, added to drift, one sigma [m, rad]."""
    search_beyond: float = 0.10
    """Drift beyond which a window is searched [m]; below it, aligning alone finds the pose."""
    search_every: int = 3
    """Every so many key frames that need a search one is searched for, in its nearest visit only: a search costs
    hundreds of alignments, and a closed loop spares its neighbours the search."""
    max_window: float = 4.0
    """Half width of a search window at most [m]; where drift may be larger, no loop is closed."""
    wide: float = 0.7
    """Drift beyond which all that was seen around the later visit is searched for, not one sweep [m]: over metres,
    one corridor looks like the next."""
    wide_distance: float = 3.0
    """Length of the drive before and after the later key frame that is then searched for [m]."""
    wide_submap: float = 5.0
    """Length of the drive before and after the earlier one whose sweeps make its submap then [m]."""
    min_wide_inlier_ratio: float = 0.5
    """Least fraction of all that which must lie on that submap: the two visits never saw quite the same."""
    max_contradicted: float = 0.08
    """Share of either visit's points that may lie where the other one saw free space."""
    candidates_per_key: int = 4
    """Number of earlier visits that each key frame is compared with."""
    min_inlier_ratio: float = 0.65
    """Least fraction of a sweep that must lie on the submap's walls."""
    gate: float = 16.3
    """Squared, normalised difference that drift may cause (chi-square with 3 degrees of freedom, 99.9 %)."""
    min_supporters: int = 2
    """Number of nearby closures that must be consistent with one before it is accepted."""
    support_distance: float = 4.0
    """Distance along the drive, on either visit, within which closures support each other [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """Relative pose of two key frames that saw the same place."""

    later: int
    """Number of the later key frame."""
    earlier: int
    """Number of the earlier key frame."""
    motion: FloatArray
    """Planar pose (3,) of the later key frame in the earlier one."""
    covariance: FloatArray
    """Covariance (3, 3) of x, y (axes of the later key frame) and yaw."""
    inlier_ratio: float
    """Fraction of the later sweep that lies on the earlier submap, in [0, 1]."""
    searched: bool
    """Whether the pose was found by searching a window."""


@dataclass(frozen=True, slots=True)
class RejectedClosures:
    """Numbers of rejected candidates by reason."""

    unexplained: int = 0
    """Number of sweeps that lie on the submap at no pose."""
    ambiguous: int = 0
    """Number of sweeps that several poses explain about equally well."""
    impossible: int = 0
    """Number of poses farther away than drift allows."""
    contradicted: int = 0
    """Number of poses at which one visit's walls stand in the other's free space."""
    unsupported: int = 0
    """Number of closures without enough consistent ones nearby."""
