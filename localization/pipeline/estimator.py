"""The course of a robot: readings in their order, predicted and corrected; the whole story in one file.

Wheels and gyro predict, or whatever stands in for them. When a sweep is complete it is deskewed, KISS-ICP
says how the robot moved since the last one, the sweep is registered against the cloud with the prediction
as prior, and the filter takes over what the registration truly saw. Hints and loss open a search that runs
beside, a little each tick.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np

from localization.config import LocalizerConfig
from localization.filter.ekf import EkfSnapshot, SkidSteerEkf
from localization.maps.ground_height import FLAT
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import MatchSweep
from localization.monitoring.extrinsics_monitor import ExtrinsicsMonitor
from localization.monitoring.health import HealthMonitor
from localization.monitoring.jump_detection import Continuity
from localization.monitoring.status import SweepNews, state_of
from localization.motion.deskew import OdometryTrack, TrackSnapshot, deskew
from localization.motion.motion_model import Increment, MotionModel
from localization.motion.slip_detection import WheelWatch
from localization.pipeline.registration_cache import Recall, SweepRecord
from localization.pipeline.scan_synchronizer import Gathering
from localization.pipeline.sweep_correction import Correction, CorrectionSnapshot, Stage
from localization.pipeline.undo import Former
from localization.relocalization.relocalizer import Belief, Placement, Seeker, SeekerSnapshot
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    Inertial,
    Match,
    Mounts,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)

_LONGEST_MEAN = 0.1
"""Rim speeds are means over no more than this [s]; after a pause of the encoders the gyro's are."""


class Order(Enum):
    """What an operator may ask for."""

    LOOK_EVERYWHERE = auto()
    UNDO = auto()


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """All that the localiser is at one moment, but for what was told."""

    own: tuple[int, Pose, bool, Mapping[str, int]]
    ekf: EkfSnapshot
    track: TrackSnapshot
    correction: CorrectionSnapshot
    seeker: SeekerSnapshot
    parts: tuple[Mapping[str, object], ...]
    """Of those that replace what they hold and never change it."""


class Course:
    """Owns what is known of the robot, and takes what comes next."""

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
        self.config = config
        self._mounts, self._stage = dict(mounts), stage
        suite = config.sensors
        if suite.flat:
            # Its height is that of its floor by definition: a log seldom says how high a scanner is.
            world = replace(world, ground=FLAT)
        self._motion = MotionModel(
            suite, track=config.ekf.effective_track, silence=config.health.silence
        )
        self._ekf = SkidSteerEkf(config.ekf)
        self._track = OdometryTrack(memory=max(2 * SECOND, config.late_readings.horizon))
        self._gathering = Gathering(len(self._mounts), config.scanner_patience)
        self._wheels = WheelWatch(config)
        self._health = HealthMonitor(config.health)
        self._correction = Correction(
            world, config, self._ekf, self._wheels, self._health, stage=stage, matcher=matcher
        )
        self._seeker = Seeker(world, self._mounts, config, keen=self._correction.matches)
        self._mount_watch = ExtrinsicsMonitor(world, self._mounts, config.extrinsics_monitor)
        self._watched = 0

        self._continuity = Continuity(config.jump_detection)
        self._parts = (
            self._motion,
            self._gathering,
            self._wheels,
            self._health,
            self._continuity,
        )
        self._stamp, self._odom, self._placed = 0, Pose.identity(), False
        self._heard: Mapping[str, int] = {}
        self._news: tuple[str, ...] = ()
        self._refused: tuple[str, ...] = ()
        self._told = (0, "")
        self._untold: SweepNews | None = None
        self._recall = Recall(config.late_readings)
        self._judged = self._judge()

    @property
    def stamp(self) -> int:
        """To which time has moved on [ns]; 0 before the first reading that moves it."""
        return self._stamp

    @property
    def undoable(self) -> bool:
        """Whether the last placement can still be taken back."""
        return self._correction.former is not None

    def expect(self, hint: Hint) -> None:
        """Make ready to answer a hint that just came, though it may have been given before."""
        self._seeker.expect(hint)

    def refuse(self, why: str) -> None:
        """Let the next estimate tell that something was refused."""
        self._refused = (*self._refused, why)

    def take(self, what: Reading | Order) -> bool:
        """Take what comes next; return whether time moved on."""
        match what:
            case Order.LOOK_EVERYWHERE:
                self._seeker.look_everywhere()
                return False
            case Order.UNDO:
                self._bring_back(self._correction.former_now(self._odom))
                return False
            case Hint():
                self._seeker.receive(what, self._stamp, self._odom_at(what.stamp))
            case Scan() | PointScan():
                self._gathering.take(what)
                self._hear(what.scanner, what.stamp)
            case WheelSpeeds():
                self._hear("wheels", what.stamp)
            case Inertial() | Odometry():
                pass
        increment = self._motion.take(what, self._wheels.seen)
        if increment is None:
            return False
        # Without any motion sensor, scanners that end together move time on but once.
        if increment.stamp > self._stamp or not self._stamp:
            self._predict(increment)
        if self._gathering.due(self._track.span):
            self._correct()
        else:
            self._refused += self._gathering.drop_stale(self._track.span, self._stamp)
        with self._stage("search"):
            place = self._seeker.advance(self._stamp, self._odom, self._belief())
        self._place(place)
        self._judged = self._judge()
        return True

    def _hear(self, source: str, stamp: int) -> None:
        self._heard = {**self._heard, source: max(stamp, self._heard.get(source, 0))}

    def _predict(self, increment: Increment) -> None:
        """Move on as wheels and gyro say."""
        with self._stage("predict"):
            dt = (increment.stamp - self._stamp) / SECOND
            first, self._stamp = self._stamp == 0, increment.stamp
            if not first:
                left, right = increment.left, increment.right
                if increment.witnessed:
                    rolling = self._ekf.rolling_speed(left, right)
                    self._wheels.grip(rolling, increment.covered, self._stamp)
                    witness, span = increment.witness, min(increment.covered, _LONGEST_MEAN)
                    if not self._ekf.update_wheel_yaw(witness, left, right, seconds=span):
                        self._wheels.distrust(self._stamp)
                    self._ekf.update_standstill(witness, left, right, seconds=span)
                self._wheels.roll(self._ekf.rolling_speed(left, right) * dt)
                distrusted = self._wheels.slipping(self._stamp) or not increment.rolling
                motion = self._ekf.predict(
                    dt,
                    increment.rate,
                    increment.force,
                    left,
                    right,
                    slipping=distrusted,
                    speed=self._wheels.speed if distrusted else None,
                )
                self._odom = self._odom @ motion
            self._track.add(self._stamp, self._odom)

    def _odom_at(self, stamp: int) -> Pose:
        """``odom_from_base`` at a stamp, or as near to it as is remembered."""
        span = self._track.span
        if span is None:
            return self._odom
        at = np.array([min(max(stamp, span[0]), span[1])], dtype=np.int64)
        position, rotation = self._track.at(at)
        return Pose.from_rotation(position[0], rotation[0])

    def _since(self, stamp: int) -> Pose:
        """``base_then_from_base_now`` since a stamp, or the last reading before it."""
        position, rotation = self._track.near(stamp)
        back = rotation.T
        return Pose.from_rotation(
            back @ (self._odom.position - position), back @ self._odom.rotation
        )

    def _correct(self) -> None:
        """Deskew the sweep, ask KISS-ICP how the robot moved, register, and look where else it might be."""
        scans = self._gathering.release()
        path = self._since(min(scan.stamp for scan in scans))
        record = self._recall.find(scans, self._stamp, path)
        if fresh := record is None:
            with self._stage("deskew"):
                sweep = deskew(scans, self._track, self._mounts, self._stamp)
            record = SweepRecord(scans, path, sweep)
            self._recall.keep(record)
        sweep = record.sweep
        found = self._correction.take(record, self._odom, placed=self._placed)
        if self._continuity.broken(sweep, self._odom):
            self._health.broken(found[2])
        if self._placed and self._health.needs_check:
            self._seeker.look_everywhere()
        if fresh:
            self._watch_mounts(scans, found[0])
            self._untold = SweepNews(sweep, *found, self._odom)
        if self._seeker.undecided:
            with self._stage("hypotheses"):
                place = self._seeker.tell_apart(sweep, self._odom, self._belief())
            self._place(place)
        self._seeker.open(sweep, self._odom, self._belief())

    def _watch_mounts(self, scans: Sequence[Scan | PointScan], match: Match | None) -> None:
        """Let a sweep that is beyond doubt say what it has to say of the scanners' mounts.

        It goes by the order of sweeps; one that was put together late says nothing.
        """
        if self._stamp <= self._watched:
            return
        self._watched = self._stamp
        if (
            match is None
            or match.inlier_ratio < self.config.slip_min_inlier_ratio
            or self._health.doubtful
        ):
            self._mount_watch.interrupt()
            return
        with self._stage("mounts"):
            self._mount_watch.take(scans, self._track, self._stamp, self._ekf.pose, self._odom)

    def _place(self, place: Placement | None) -> None:
        """Begin anew where the robot was found, if it was."""
        if place is None:
            return
        held, placed = self._ekf.snapshot(), self._placed
        former = Former(
            self._stamp, place.reason, placed, held, dict(vars(self._health)), self._odom
        )
        self._ekf.reset_pose(
            place.map_from_base, np.diag(np.array(self.config.placement_sigma) ** 2)
        )
        self._placed = True
        self._correction.begin(former)
        self._health.reset()
        if (self._stamp, place.reason) != self._told:
            self._told = (self._stamp, place.reason)
            self._news = (f"placed anew: {place.reason}",)

    def _bring_back(self, former: Former | None) -> None:
        """Believe again what a placement replaced, if that is still known."""
        if former is None:
            return
        former.bring_back(self._ekf)
        self._placed = former.placed
        self._correction.begin(None)
        vars(self._health).update(former.health)
        self._seeker.rest()
        self._judged = self._judge()
        ago = (self._stamp - former.stamp) / SECOND
        self._news = (f"took back the placement of {ago:.1f} s ago: {former.what}",)

    def _belief(self) -> Belief:
        health = self._health
        return Belief(
            self._ekf.pose, self._ekf.covariance, self._placed, health.lost, health.doubtful
        )

    def _judge(self) -> tuple[Health, tuple[str, ...]]:
        """Return what state the estimate is in, and why."""
        sources = (*sorted(self._mounts), *self.config.sensors.expected)
        silence = self.config.health.silence
        silent = tuple(n for n in sources if self._stamp - self._heard.get(n, 0) > silence)
        return state_of(
            self._belief(),
            self._health,
            slipping=self._wheels.slipping(self._stamp),
            silent=silent,
            unseeing=set(self._mounts) <= set(silent),
            mounts=self._mount_watch.doubts,
            searching=self._seeker.busy,
            asked=self._seeker.asked,
            places=self._seeker.candidates(self._odom),
        )

    def estimate(self, *, late: bool = False) -> Estimate:
        """Put the answer together; what is news waits for the next one if a reading came late."""
        health, reasons = self._judged
        news = None if late else self._untold
        estimate = Estimate(
            stamp=self._stamp,
            map_from_base=self._ekf.pose if self._placed else None,
            odom_from_base=self._odom,
            covariance=self._ekf.covariance,
            twist=self._ekf.twist,
            health=health,
            reasons=(*self._refused, *self._news, *reasons),
            match=news.match if news else None,
            sweep=news.seen_from(self._odom, self._stamp) if news else None,
            verdict=None if late else self._seeker.next_answer(),
            nis=news.nis if news else None,
            hypotheses=self._seeker.candidates(self._odom),
            consistency=news.consistency if news else None,
        )
        if not late:
            self._news, self._refused, self._untold = (), (), None
        return estimate

    def snapshot(self) -> Snapshot:
        """Return all that is known, for ``restore``."""
        return Snapshot(
            (self._stamp, self._odom, self._placed, self._heard),
            self._ekf.snapshot(),
            self._track.snapshot(),
            self._correction.snapshot(),
            self._seeker.snapshot(),
            tuple(dict(vars(part)) for part in self._parts),
        )

    def restore(self, state: Snapshot) -> None:
        """Be as at a snapshot again: the same readings from there on give the same bits."""
        self._stamp, self._odom, self._placed, self._heard = state.own
        self._ekf.restore(state.ekf)
        self._track.restore(state.track)
        self._correction.restore(state.correction)
        self._seeker.restore(state.seeker)
        for part, held in zip(self._parts, state.parts, strict=True):
            vars(part).update(held)
