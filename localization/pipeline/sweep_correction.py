"""Correction: what a sweep tells of where the robot is, and what of it is believed.

KISS-ICP says how the robot moved since the last sweep, and the wheels are held to it. The sweep is
registered against the cloud with the prediction as prior. What fits the map but contradicts the prediction
blames the wheels; what does not fit is refused; the rest goes into the filter. Now and then KISS-ICP is
asked where the robot is, as a second opinion.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from localization.config import LocalizerConfig
from localization.filter.ekf import SkidSteerEkf
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher, MatchSweep, matcher_of
from localization.matching.scan_consistency import MapBeams, explanation
from localization.monitoring.health import HealthMonitor, opinion_offset
from localization.motion.kiss_odometry import KissOdometry, KissOpinion, KissSnapshot
from localization.motion.slip_detection import WheelWatch
from localization.pipeline.registration_cache import SweepRecord
from localization.pipeline.undo import Former
from localization.types import SECOND, Match, Pose, ScanConsistency

Stage = Callable[[str], AbstractContextManager[object]]
"""Called with a stage's name around its work; whoever owns a clock can time it."""

Seen = tuple[Pose, FloatArray]
"""How KISS-ICP saw the robot move since the last sweep, and the (3, 3) covariance of x, y and yaw."""

_GATE = tuple(float(chi2.ppf(0.9999, k)) for k in range(1, 7))
"""Largest squared normalised innovation of a match by its number of kept directions (99.99 %)."""
_UNLIKE = "the map does not explain the sweep"
"""Why a sweep is refused that fits nowhere near; in what way is looked at before it is told."""
_UNUSED = np.zeros((0, 6))
"""No direction of a match was used."""


@dataclass(frozen=True, slots=True, eq=False)
class CorrectionSnapshot:
    """What the next sweep will be compared with."""

    odom_then: Pose
    """``odom_from_base`` at the last sweep."""
    pose_then: Pose
    """``map_from_base`` then."""
    stamp: int
    """Of the last sweep [ns]."""
    opinion_due: int
    odometry: KissSnapshot
    former: Former | None


class Correction:
    """Owns what watches the robot from outside: KISS-ICP, the matcher, and their last word."""

    def __init__(
        self,
        world: PreparedMap,
        config: LocalizerConfig,
        ekf: SkidSteerEkf,
        wheels: WheelWatch,
        health: HealthMonitor,
        *,
        stage: Stage,
        matcher: MatchSweep | None = None,
    ) -> None:
        """Build.

        Args:
            world: the prepared cloud.
            config: all settings.
            ekf: the filter to correct.
            wheels: the watch that learns of slip.
            health: the monitor that learns how the sweeps fit.
            stage: see ``Stage``.
            matcher: registers sweeps instead of what ``config.matcher`` names.
        """
        self._config, self._stage = config, stage
        self._same = config.late_readings.same
        self._ekf, self._wheels, self._health = ekf, wheels, health
        self._matcher = matcher
        if matcher is None and config.matcher is not Matcher.NONE:
            self._matcher = matcher_of(
                config.matcher, world, config.registration, config.kiss, config.fixed_covariance
            )
        self._beams = MapBeams(world, inlier=config.registration.inlier_distance)
        self._odometry = KissOdometry(config.kiss)
        self._opinion = KissOpinion(world.cloud, config.kiss) if config.second_opinion else None
        self._odom_then, self._pose_then = Pose.identity(), Pose.identity()
        self._stamp, self._opinion_due = 0, 0
        self.former: Former | None = None
        """What the last placement replaced, at the last sweep; None if it cannot be taken back any more."""

    @property
    def matches(self) -> bool:
        """Whether sweeps are registered at all."""
        return self._matcher is not None

    def begin(self, former: Former | None) -> None:
        """Start from where the filter was just placed.

        Args:
            former: what it believed before; None if that is not to be taken back.
        """
        self._pose_then = self._ekf.pose
        self._opinion_due = 0
        self.former = former

    def take(
        self, record: SweepRecord, odom: Pose, *, placed: bool
    ) -> tuple[Match | None, float | None, ScanConsistency | None]:
        """Correct the filter by a sweep, and put on record what it said.

        Args:
            record: of the sweep, deskewed to now; what it holds already is not found out again.
            odom: ``odom_from_base`` now.
            placed: whether the filter's pose is one in the map.

        Returns:
            The sweep's registration, the squared normalised innovation of it, and what the map does not
            explain; all None if it was not registered.
        """
        sweep = record.sweep
        elapsed = (sweep.stamp - self._stamp) / SECOND
        self._stamp = sweep.stamp
        match, nis, consistency = None, None, None
        moved, self._odom_then = self._odom_then.inverse() @ odom, odom
        if self._config.kiss_odometry:
            seen = self._seen_motion(record, moved, elapsed)
        else:
            seen = None
            self._wheels.rest()
        with self._stage("ekf"):
            if self._config.sensors.flat:
                self._ekf.update_level()
            else:
                self._ekf.update_tilt(elapsed)
        if placed and self._matcher is not None:
            match, nis, consistency = self._match(record, seen, self._matcher, elapsed)
        elif placed and seen is not None:
            self._ekf.update_relative(self._pose_then, *seen, _UNUSED)
        self._carry_former(odom, seen)
        self._ekf.mark()
        self._pose_then = self._ekf.pose
        return match, nis, consistency

    def _carry_former(self, odom: Pose, seen: Seen | None) -> None:
        former = self.former
        if former is None:
            return
        # The first sweep after a placement saw more than the way since then.
        seen = seen if former.steps is not None else None
        recent = self._stamp - former.stamp <= self._config.undo_memory
        attitude = self._pose_then.rotation
        self.former = former.went(odom, self._ekf, attitude, seen) if recent else None

    def former_now(self, odom: Pose) -> Former | None:
        """Return the estimate that the last placement replaced, as of ``odom_from_base`` now, if any is kept."""
        if self.former is None:
            return None
        return self.former.went(odom, self._ekf, self._pose_then.rotation, None)

    def _seen_motion(self, record: SweepRecord, moved: Pose, elapsed: float) -> Seen | None:
        """Let KISS-ICP say how the robot moved, and hold its wheels to it."""
        with self._stage("kiss odometry"):
            if record.view is not None and self._odometry.knows(record.view):
                seen = self._odometry.repeat(record.view)
            else:
                seen = self._odometry.add(record.sweep, moved)
                record.view = self._odometry.view
        if seen is None:
            self._wheels.rest()
            return None
        motion, covariance = seen
        if not self._wheels.look(motion, elapsed):
            return seen
        plausible = self._wheels.plausible()
        if plausible:
            self._wheels.believe()
            if self._wheels.contradicted(covariance, self._ekf):
                self._blame_wheels()
        else:
            # Its next guess would start from there, and be worse: people who walk past the scanner
            # can talk it into running away with them.
            self._odometry.restart()
        self._wheels.rest()
        return seen if plausible else None

    def _match(
        self, record: SweepRecord, seen: Seen | None, matcher: MatchSweep, elapsed: float
    ) -> tuple[Match, float, ScanConsistency | None]:
        """Register a sweep, judge what came of it, and take it over."""
        share = min(1.0, elapsed / self._config.sweep_period)
        match, nis = self._register(record, matcher, share)
        refusal = self._refusal(match, nis)
        if refusal is not None and self._wheels_to_blame(match, seen is None):
            self._blame_wheels()
            match, nis = self._register(replace(record, match=None), matcher, share)
            refusal = self._refusal(match, nis)
        with self._stage("ekf"):
            if seen is not None:
                used = match.observable_directions if refusal is None else _UNUSED
                self._ekf.update_relative(self._pose_then, *seen, used)
            if refusal is None:
                self._ekf.update_match(match)
        with self._stage("scan consistency"):
            if record.consistency is None:
                record.consistency = self._beams.classify(
                    record.sweep, self._ekf.pose, match.distances
                )
        if refusal is _UNLIKE:
            refusal = explanation(match.inlier_ratio, record.consistency)
        self._health.sweep(match, self._ekf.pose, refusal, record.consistency)
        if self._opinion and (self._health.doubtful or self._stamp >= self._opinion_due):
            self._ask_kiss(self._opinion, record, match)
        return match, nis, record.consistency

    def _register(
        self, record: SweepRecord, matcher: MatchSweep, share: float
    ) -> tuple[Match, float]:
        """Return a match that informs by a share of what it would by itself, and its NIS."""
        prior, match = self._ekf.pose, record.match
        if match is None or record.prior is None or not self._same(record.prior, prior):
            with self._stage("registration"):
                match = matcher(record.sweep, prior, self._ekf.covariance)
            record.prior, record.match, record.consistency = prior, match, None
        if share != 1.0:
            match = replace(match, information=share * match.information)
        return match, self._ekf.match_nis(match) if len(match.observable_directions) else 0.0

    def _refusal(self, match: Match, nis: float) -> str | None:
        k = len(match.observable_directions)
        if k == 0 or match.inlier_ratio < self._config.min_inlier_ratio:
            return _UNLIKE
        if nis > _GATE[k - 1]:
            return f"the sweep fits the map where the robot cannot be (NIS {nis:.0f} of {_GATE[k - 1]:.0f})"
        return None

    def _blame_wheels(self) -> None:
        """Admit that the wheels misled the prediction since the last sweep, and may go on to."""
        self._wheels.distrust(self._stamp)
        self._ekf.widen(*self._config.slip_sigma)

    def _wheels_to_blame(self, match: Match, unwitnessed: bool) -> bool:
        """A sweep that fits the map but contradicts the prediction blames the wheels.

        If KISS-ICP saw the motion and agrees with the wheels, the map or the earlier pose is at fault.
        """
        fits = (
            len(match.observable_directions) > 0
            and match.inlier_ratio >= self._config.slip_min_inlier_ratio
        )
        return fits and (self._wheels.slipping(self._stamp) or unwitnessed)

    def _ask_kiss(self, opinion: KissOpinion, record: SweepRecord, match: Match) -> None:
        """Get a second opinion; at most five a second, however deep the doubt."""
        if self._stamp < self._opinion_due - self._config.opinion_period * 4 // 5:
            return
        self._opinion_due = self._stamp + self._config.opinion_period
        pose = self._ekf.pose
        if record.asked is None or not self._same(record.asked, pose):
            with self._stage("kiss opinion"):
                record.asked, record.opinion = pose, opinion.locate(record.sweep, pose)
        if record.opinion is not None:
            self._health.opinion(*opinion_offset(pose, record.opinion, match))

    def snapshot(self) -> CorrectionSnapshot:
        """Return what the next sweep will be compared with, for ``restore``."""
        return CorrectionSnapshot(
            self._odom_then,
            self._pose_then,
            self._stamp,
            self._opinion_due,
            self._odometry.snapshot(),
            self.former,
        )

    def restore(self, snapshot: CorrectionSnapshot) -> None:
        """Compare the next sweep with what it would have been compared with at a snapshot."""
        self._odom_then, self._pose_then = snapshot.odom_then, snapshot.pose_then
        self._stamp, self._opinion_due = snapshot.stamp, snapshot.opinion_due
        self._odometry.restore(snapshot.odometry)
        self.former = snapshot.former
