"""How a sweep is placed in the cloud: our own registration, KISS-ICP for comparison, or not at all."""

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
    """What registers sweeps against the cloud."""

    PLANE = "plane"
    """Point to plane, with the filter's prior inside: see ``registration``."""
    KISS = "kiss"
    """KISS-ICP's point to point, at whose pose a fixed covariance is taken for granted."""
    NONE = "none"
    """Nothing: once placed, the robot goes by its own motion."""


@dataclass(frozen=True, slots=True)
class FixedCovariance:
    """What a matcher is taken to know that does not say what it knows; one sigma."""

    position: float = 0.02
    """Of x, y and z [m]: on such sweeps KISS-ICP errs by 0.5 to 1.2 cm at the median, and by 4 to 12 cm
    once in twenty."""
    angle: float = np.deg2rad(0.5)
    """Of roll, pitch and yaw [rad]."""

    @property
    def information(self) -> FloatArray:
        """(6, 6)."""
        return np.diag(np.repeat([self.position**-2, self.angle**-2], 3))


def matcher_of(
    kind: Matcher,
    world: PreparedMap,
    registration: RegistrationConfig,
    kiss: KissConfig,
    fixed: FixedCovariance,
) -> MatchSweep:
    """Return what registers sweeps against a cloud.

    Args:
        kind: which; ``NONE`` never matches and is nobody's to call.
        world: the prepared cloud.
        registration: how planes are matched; its ``inlier`` says for all kinds what is explained.
        kiss: how KISS-ICP is set.
        fixed: what its poses are worth.

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
            raise LocalizationError("matcher 'none' matches nothing; ask for 'plane' or 'kiss'")


def match_at(
    sweep: Sweep,
    world: PreparedMap,
    pose: Pose,
    information: FloatArray,
    directions: FloatArray,
    inlier_distance: float = RegistrationConfig().inlier_distance,
) -> Match:
    """Return the match that some other matcher came to, with the share of the sweep explained there.

    Args:
        sweep: what was matched.
        world: against which cloud.
        pose: ``map_from_base`` found.
        information: (6, 6) of the pose, as in ``Match``.
        directions: (k, 6) kept, as in ``Match``.
        inlier_distance: a point this near to its plane counts as explained [m].
    """
    distances = residuals(sweep, world, pose).distance
    distances.flags.writeable = False
    explained = np.abs(np.nan_to_num(distances, nan=np.inf)) < inlier_distance
    return Match(
        stamp=sweep.stamp,
        map_from_base=pose,
        information=information,
        observable_directions=directions,
        distances=distances,
        inlier_ratio=float(explained.mean()) if len(explained) else 0.0,
    )
