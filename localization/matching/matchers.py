"""Matchers: the methods that register sweeps against the cloud, by configuration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from localization.errors import LocalizationError
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.kiss_matcher import KissMatcher
from localization.matching.registration import RegistrationConfig, register, residuals
from localization.motion.kiss_icp import KissConfig
from localization.types import Match, Pose, Sweep

MatchSweep = Callable[[Sweep, Pose, FloatArray], Match]
"""Registers a sweep, given the predicted ``map_from_base`` and its (6, 6) covariance."""


class Matcher(StrEnum):
    """The methods that register sweeps against the cloud."""

    PLANE = "plane"
    """Point to plane with the filter's prediction as prior: see ``registration``."""
    KISS = "kiss"
    """KISS-ICP's point to point, with a fixed covariance."""
    NONE = "none"
    """None: once placed, the robot goes by its own motion."""


@dataclass(frozen=True, slots=True)
class FixedCovariance:
    """The covariance assumed for matchers that report none; one sigma."""

    position: float = 0.02
    """Error of x, y and z [m]: on such sweeps KISS-ICP's median error is 0.5 to 1.2 cm, its 95th percentile
    4 to 12 cm."""
    angle: float = np.deg2rad(0.5)
    """Error of roll, pitch and yaw [rad]."""

    @property
    def information(self) -> FloatArray:
        """(6, 6) inverse of the covariance."""
        return np.diag(np.repeat([self.position**-2, self.angle**-2], 3))


def matcher_of(
    kind: Matcher,
    world: PreparedMap,
    registration: RegistrationConfig,
    kiss: KissConfig,
    fixed: FixedCovariance,
) -> MatchSweep:
    """Return the matcher of a kind for a cloud.

    Args:
        kind: ``PLANE`` or ``KISS``.
        world: the prepared cloud.
        registration: settings of ``PLANE``; its ``inlier_distance`` holds for both kinds.
        kiss: settings of ``KISS``.
        fixed: the covariance of its poses.

    Raises:
        LocalizationError: if the kind is ``NONE``.
    """
    match kind:
        case Matcher.PLANE:
            return lambda sweep, prior, covariance: register(
                sweep, world, prior, covariance, registration
            )
        case Matcher.KISS:
            whole_map = KissMatcher(world.cloud, kiss)

            def by_kiss(sweep: Sweep, prior: Pose, covariance: FloatArray) -> Match:
                pose = whole_map.locate(sweep, prior)
                if pose is None:
                    return match_at(sweep, world, prior, np.zeros((6, 6)), np.zeros((0, 6)))
                return match_at(
                    sweep, world, pose, fixed.information, np.eye(6), registration.inlier_distance
                )

            return by_kiss
        case Matcher.NONE:
            raise LocalizationError("matcher 'none' registers nothing; use 'plane' or 'kiss'")


def match_at(
    sweep: Sweep,
    world: PreparedMap,
    pose: Pose,
    information: FloatArray,
    directions: FloatArray,
    inlier_distance: float = RegistrationConfig().inlier_distance,
) -> Match:
    """Return the match at a pose that another method found, with the share of the sweep explained there.

    Args:
        sweep: the sweep that was matched.
        world: the prepared cloud.
        pose: ``map_from_base`` that was found.
        information: (6, 6) of the pose, as in ``Match``.
        directions: (k, 6) observable directions, as in ``Match``.
        inlier_distance: a point nearer to its plane than this counts as explained [m].
    """
    seen = residuals(sweep, world, pose)
    distances = seen.distance
    distances.flags.writeable = False
    return Match(
        stamp=sweep.stamp,
        map_from_base=pose,
        information=information,
        observable_directions=directions,
        distances=distances,
        inlier_ratio=seen.share_explained(inlier_distance),
    )
