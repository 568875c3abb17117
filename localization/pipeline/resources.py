"""Resources of a step: map, settings, methods and caches; what changes here saves time only."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace

import numpy as np

from localization.compiled.scans import are_near
from localization.config import LocalizerConfig
from localization.maps.ground_height import FLAT
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher, MatchSweep, matcher_of
from localization.matching.registration import register
from localization.matching.scan_consistency import BeamClassifier
from localization.motion.alignment_covariance import alignment_covariance
from localization.motion.kiss_odometry import KissOdometry
from localization.motion.odometry_track import OdometryTrack
from localization.pipeline.registration_cache import RegistrationCache
from localization.relocalization.relocalizer import Relocalizer
from localization.types import Mounts, Pose, Sweep

Stage = Callable[[str], AbstractContextManager[object]]
"""Called with a stage's name around its work, so that it can be timed by a caller who has a clock."""


class Resources:
    """Everything that a step needs beside the state.

    Nothing here is part of the estimate. The cache of registrations is the one exception, on purpose: a
    replay of late readings may reuse a match that was computed from a prediction a few millimetres away.
    """

    def __init__(
        self,
        world: PreparedMap,
        mounts: Mounts,
        config: LocalizerConfig,
        *,
        stage: Stage,
        matcher: MatchSweep | None = None,
    ) -> None:
        """Build; the arguments are those of ``Localizer``."""
        config.require_suited()
        self.config, self.stage = config, stage
        self.mounts = dict(mounts)
        if config.sensors.flat:
            # The robot's height is that of its floor by definition: a log seldom has a scanner's height.
            world = replace(world, ground=FLAT)
        self.world = world
        self.map_noise = config.map_share * world.noise.distance
        self.match: MatchSweep | None = matcher
        if matcher is None and config.matcher is not Matcher.NONE:
            self.match = matcher_of(
                config.matcher, world, config.registration, config.kiss, config.fixed_covariance
            )
        self.beams = BeamClassifier(
            world, config.scan_consistency, inlier=config.registration.inlier_distance
        )
        self.kiss = KissOdometry(config.kiss)
        self.relocalizer = Relocalizer(
            world, self.mounts, config, self.beams, by_itself=self.match is not None
        )
        self.cache = RegistrationCache(config.late_readings)
        self._have_loops_compiled()

    def _have_loops_compiled(self) -> None:
        """Use each compiled loop once: a robot must not wait for them in its first sweep."""
        point, seen = np.array([[1.0, 0.0, 0.0]]), np.ones(1, dtype=bool)
        sweep, here = Sweep(0, point, np.zeros((1, 3)), seen), Pose.identity()
        match = register(sweep, self.world, here, np.eye(6), self.config.registration)
        self.beams.classify(sweep, here, np.full_like(match.distances, np.nan))
        are_near(point[:, :2].copy(), point[:, :2].copy(), 1.0)
        track = OdometryTrack(knots=((0, here), (1, here)))
        track.carried(point[None], np.zeros(1, dtype=np.int64), here)
        alignment_covariance(point.repeat(2, axis=0), self.config.kiss)
