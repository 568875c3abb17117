"""Localizer: readings in, estimates out; the whole story in one file.

Wheels and gyro predict, or whatever stands in for them. When a sweep is complete it is deskewed, KISS-ICP says how the robot moved since
the last one, the sweep is registered against the cloud with the prediction as prior, and the filter takes
over what the registration truly saw. Hints and loss open a search that runs beside, a little each tick.
Time is the readings' time; the same readings give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import chi2

from localization.deskew import OdometryTrack, deskew
from localization.ekf import EkfConfig, SkidSteerEkf
from localization.geometry import FloatArray
from localization.ground import FLAT
from localization.health import (
    HealthConfig,
    HealthMonitor,
    horizontal_sigma,
    opinion_offset,
)
from localization.hints import Found, HintDesk
from localization.hypotheses import Hypotheses, HypothesesConfig
from localization.intake import Intake
from localization.kiss import KissConfig, KissOdometry, KissOpinion
from localization.matching import FixedCovariance, Matcher, MatchSweep, matcher_of
from localization.prepared import PreparedMap
from localization.registration import RegistrationConfig
from localization.relocalization import FloorPlan, SearchConfig, Window, same_place
from localization.suites import Increment, Motion, MotionSource, Suite
from localization.types import (
    SECOND,
    Candidate,
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
    Sweep,
    Verdict,
    WheelSpeeds,
)
from localization.whole_map import MapSearchConfig

Stage = Callable[[str], AbstractContextManager[object]]
"""Called with a stage's name around its work; whoever owns a clock can time it."""

_GATE = tuple(float(chi2.ppf(0.9999, k)) for k in range(1, 7))
"""Largest squared normalised innovation of a match by its number of kept directions (99.99 %)."""
_SLIP_GATE = float(chi2.ppf(0.999, 1))
"""Beyond it KISS-ICP's forward motion contradicts the wheels' (99.9 %)."""


_SURE = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)
"""States of an estimate that is believed."""
_PLACED_FLAT = (0.05, 0.05, 0.002, 0.001, 0.001, 0.02)
"""``LocalizerConfig.placed`` on a floor whose height and level are known."""


@dataclass(frozen=True, slots=True)
class LocalizerConfig:
    """All settings of the localiser; what is written here is what runs."""

    suite: Suite = field(default_factory=Suite)
    ekf: EkfConfig = field(default_factory=EkfConfig)
    registration: RegistrationConfig = field(default_factory=RegistrationConfig)
    kiss: KissConfig = field(default_factory=KissConfig)
    health: HealthConfig = field(default_factory=HealthConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    map_search: MapSearchConfig = field(default_factory=MapSearchConfig)
    hypotheses: HypothesesConfig = field(default_factory=HypothesesConfig)
    matcher: Matcher = Matcher.PLANE
    """What registers sweeps against the cloud."""
    fixed: FixedCovariance = field(default_factory=FixedCovariance)
    """What the poses of a matcher are worth that does not say so."""
    kiss_odometry: bool = True
    """Whether KISS-ICP follows the horizontal scanner; without it nobody watches the wheels for it."""
    second_opinion: bool = True
    """Whether KISS-ICP is asked now and then where the robot is."""
    least_fit: float = 0.3
    """A sweep that the map explains less is refused even if it agrees with the prediction."""
    blame_fit: float = 0.6
    """A sweep that contradicts the prediction must be explained this well for the wheels to be blamed;
    with more than 1 they never are."""
    blame: tuple[float, float, float, float] = (0.12, 0.06, 0.02, np.deg2rad(1.0))
    """How wrong slipping wheels may be over one sweep: forward, sideways, up [m], yaw [rad]."""
    slip_memory: int = SECOND // 2
    """How long after the last sign of slip the wheels are distrusted [ns]."""
    traction: float = 9.0
    """No tyre gives a robot more acceleration than this, about a friction coefficient of 0.9 [m/s^2]."""
    shove: float = 0.3
    """A robot moves no faster than its wheels roll, but for so much: people push, floors slope [m/s]."""
    traction_floor: float = 0.05
    """Change of wheel speed between two readings that noise may cause [m/s]."""
    placed: tuple[float, ...] = (0.05, 0.05, 0.02, 0.01, 0.01, 0.02)
    """How well a pose found by searching is known: x, y, z [m], roll, pitch, yaw [rad], one sigma."""
    opinion_period: int = SECOND
    """Between second opinions [ns]."""
    sweep_period: float = 0.1
    """Sweeps that come faster share their errors, those of the map and of the mounts, and inform together
    like one in this time [s]. What a sweep is worth was set at 10 Hz."""
    scanner_patience: int = 60_000_000
    """How long a scan waits for the other scanners' [ns]."""
    lost_search_period: int = 2 * SECOND
    """Between searches around a lost estimate [ns]."""

    def __post_init__(self) -> None:
        known = ", ".join(repr(m.value) for m in Matcher)
        if self.matcher not in list(Matcher):
            raise ValueError(f"matcher must be one of {known}, got {self.matcher!r}")
        object.__setattr__(self, "matcher", Matcher(self.matcher))

    @classmethod
    def of(cls, suite: Suite) -> LocalizerConfig:
        """Return the settings that suit a suite of sensors."""
        config = cls(suite=suite, ekf=suite.ekf())
        return replace(config, placed=_PLACED_FLAT) if suite.flat else config


class Localizer:
    """Where is the robot? Feed it every reading in the order of arrival."""

    def __init__(
        self,
        world: PreparedMap,
        mounts: Mounts,
        config: LocalizerConfig = LocalizerConfig(),
        *,
        stage: Stage = lambda _: nullcontext(),
        matcher: MatchSweep | None = None,
    ) -> None:
        """Build.

        Args:
            world: the prepared cloud.
            mounts: ``base_from_scanner`` by the scanner's frame.
            config: all settings.
            stage: see ``Stage``.
            matcher: registers sweeps instead of what ``config.matcher`` names.
        """
        self.config = config
        self._mounts, self._stage = dict(mounts), stage
        suite = config.suite
        if suite.flat:
            # Its height is that of its floor by definition: a log seldom says how high a scanner is.
            world = replace(world, ground=FLAT)
        self._intake = Intake(self._mounts, suite.leader)
        self._motion = MotionSource(
            suite, track=config.ekf.effective_track, silence=config.health.silence
        )
        self._ekf = SkidSteerEkf(config.ekf)
        self._track = OdometryTrack()
        self._odometry = KissOdometry(config.kiss)
        self._opinion = KissOpinion(world.cloud, config.kiss) if config.second_opinion else None
        self._matcher = matcher
        if matcher is None and config.matcher is not Matcher.NONE:
            self._matcher = matcher_of(
                config.matcher, world, config.registration, config.kiss, config.fixed
            )
        self._health = HealthMonitor(config.health)
        search = config.search
        heights = [p.position[2] for p in mounts.values() if p.rotation[2, 2] > 0.9] or [0.3]
        plan = FloorPlan(world, float(heights[0]), cell=search.cell, sigma=search.field_sigma)
        self._desk = HintDesk(world, plan, search, config.map_search)
        self._hypotheses = Hypotheses(world, search, config.hypotheses)
        self._search_everywhere = self._asked = False

        self._stamp = 0
        self._odom = Pose.identity()
        self._placed = False
        self._pending: dict[str, Scan | PointScan] = {}
        self._heard: dict[str, int] = {}
        self._slip_until = -1
        self._rolled = 0.0
        self._seen_speed: float | None = None
        self._seen_turn = 0.0
        self._speed_before = 0.0
        self._pose_then, self._odom_then, self._sweep_stamp = Pose.identity(), Pose.identity(), 0
        self._opinion_due, self._search_due, self._everywhere_due = 0, 0, 0
        self._doing: tuple[str, ...] = ()
        self._refused: tuple[str, ...] = ()
        self._sweep: Sweep | None = None
        self._matched: Match | None = None
        self._nis: float | None = None
        self._last = self._estimate()

    @property
    def refused(self) -> int:
        """How many readings were turned away as impossible."""
        return self._intake.refused

    def relocalize(self) -> None:
        """Begin a search of the whole map with the next sweep, as for a robot that was carried away.

        What it finds is told apart by driving on; until that is settled, the estimate stays as it is.
        """
        self._search_everywhere = self._asked = True
        self._hypotheses.drop()

    def add(self, reading: Reading) -> Estimate:
        """Take one reading and return the estimate as it now stands.

        A reading that cannot be true changes nothing; the estimate's reasons then say what was refused.
        Time moves on with the inertial readings, or with what stands in for them; the others take effect
        with the one that covers them.
        """
        refusal = self._intake.refusal(reading, self._stamp)
        if refusal is not None:
            self._refused = (*self._refused, refusal)
            return replace(self._unchanged(), reasons=(refusal, *self._last.reasons))
        match reading:
            case Hint():
                self._desk.receive(reading, self._stamp, self._odom_at(reading.stamp))
            case Scan() | PointScan():
                self._pending[reading.scanner] = reading
                self._heard[reading.scanner] = reading.stamp
            case WheelSpeeds():
                self._heard["wheels"] = reading.stamp
            case Inertial() | Odometry():
                pass
        increment = self._motion.take(reading, (self._seen_speed or 0.0, self._seen_turn))
        if increment is None:
            return self._unchanged()
        self._sweep, self._matched, self._nis = None, None, None
        # Without any motion sensor, scanners that end together move time on but once.
        if increment.stamp > self._stamp or not self._stamp:
            self._predict(increment)
        if self._sweep_due():
            self._correct()
        self._search()
        self._last = self._estimate()
        return self._last

    def _unchanged(self) -> Estimate:
        """The last estimate without its news, which are told once."""
        last = self._last
        if last.sweep is not None or last.verdict is not None:
            self._last = replace(last, sweep=None, match=None, nis=None, verdict=None)
        return self._last

    # Prediction

    def _predict(self, increment: Increment) -> None:
        with self._stage("predict"):
            dt = (increment.stamp - self._stamp) / SECOND
            first, self._stamp = self._stamp == 0, increment.stamp
            if not first:
                rate, left, right = increment.rate, increment.left, increment.right
                if increment.witnessed:
                    witness = increment.witness
                    self._watch_traction(self._ekf.rolling_speed(left, right), increment.covered)
                    if not self._ekf.update_wheel_yaw(witness, left, right):
                        self._slip_until = increment.stamp + self.config.slip_memory
                    self._ekf.update_standstill(witness, left, right)
                self._rolled += self._ekf.rolling_speed(left, right) * dt
                distrusted = self._slipping or not increment.rolling
                motion = self._ekf.predict(
                    dt,
                    rate,
                    increment.force,
                    left,
                    right,
                    slipping=distrusted,
                    speed=self._seen_speed if distrusted else None,
                )
                self._odom = self._odom @ motion
            self._track.add(increment.stamp, self._odom)

    def _watch_traction(self, speed: float, dt: float) -> None:
        """Wheels that gain speed faster than any tyre can pass on are spinning."""
        before, self._speed_before = self._speed_before, speed
        if abs(speed - before) > self.config.traction * dt + self.config.traction_floor:
            if not self._slipping:
                self._seen_speed = before
            self._slip_until = self._stamp + self.config.slip_memory

    def _odom_at(self, stamp: int) -> Pose:
        """``odom_from_base`` at a stamp, or as near to it as is remembered."""
        span = self._track.span
        if span is None:
            return self._odom
        at = np.array([min(max(stamp, span[0]), span[1])], dtype=np.int64)
        position, rotation = self._track.at(at)
        return Pose.from_rotation(position[0], rotation[0])

    @property
    def _slipping(self) -> bool:
        return self._stamp < self._slip_until

    # Correction

    def _sweep_due(self) -> bool:
        span = self._track.span
        if not self._pending or span is None:
            return False
        latest = max(s.end_stamp for s in self._pending.values())
        earliest = min(s.stamp for s in self._pending.values())
        if earliest < span[0]:
            self._drop_stale(span[0])
            return False
        waited = span[1] - min(s.end_stamp for s in self._pending.values())
        complete = len(self._pending) == len(self._mounts)
        return latest <= span[1] and (complete or waited > self.config.scanner_patience)

    def _drop_stale(self, oldest: int) -> None:
        """Give up scans from before the remembered motion: nothing can bring them to now."""
        for name in [n for n, scan in self._pending.items() if scan.stamp < oldest]:
            late = (self._stamp - self._pending.pop(name).stamp) / SECOND
            # At the very start scans begin before the first inertial reading; nobody is to blame.
            if late > 1.0:
                self._refused = (*self._refused, f"refused a scan of {name}: {late:.1f} s late")

    def _correct(self) -> None:
        with self._stage("deskew"):
            scans = [self._pending[name] for name in sorted(self._pending)]
            self._pending = {}
            sweep = deskew(scans, self._track, self._mounts, self._stamp)
            self._sweep = sweep
        elapsed = (self._stamp - self._sweep_stamp) / SECOND
        self._sweep_stamp = self._stamp
        motion = None
        if self.config.kiss_odometry:
            with self._stage("kiss odometry"):
                motion = self._odometry.add(sweep, self._odom_then.inverse() @ self._odom)
        self._odom_then = self._odom
        if motion is not None and not self._plausible(motion[0], elapsed):
            # Its next guess would start from there, and be worse: people who walk past the scanner
            # can talk it into running away with them.
            self._odometry.restart()
            motion = None
        if motion is not None:
            self._watch_wheels(*motion, elapsed)
        self._rolled = 0.0
        with self._stage("ekf"):
            if self.config.suite.flat:
                self._ekf.update_level()
            else:
                self._ekf.update_tilt(elapsed)
        if self._placed and self._matcher is not None:
            self._match(sweep, motion, self._matcher, elapsed)
        elif self._placed and motion is not None:
            self._ekf.update_relative(self._pose_then, *motion, np.zeros((0, 6)))
        self._ekf.mark()
        self._pose_then = self._ekf.pose
        self._tell_apart(sweep)
        self._open_search(sweep)

    def _match(
        self,
        sweep: Sweep,
        motion: tuple[Pose, FloatArray] | None,
        matcher: MatchSweep,
        elapsed: float,
    ) -> None:
        share = min(1.0, elapsed / self.config.sweep_period)
        with self._stage("registration"):
            match = _worth(matcher(sweep, self._ekf.pose, self._ekf.covariance), share)
        nis = self._ekf.match_nis(match) if len(match.directions) else 0.0
        refusal = self._refusal(match, nis)
        if refusal is not None and self._wheels_to_blame(match, motion is None):
            self._blame_wheels()
            with self._stage("registration"):
                match = _worth(matcher(sweep, self._ekf.pose, self._ekf.covariance), share)
            nis = self._ekf.match_nis(match) if len(match.directions) else 0.0
            refusal = self._refusal(match, nis)
        with self._stage("ekf"):
            if motion is not None:
                used = match.directions if refusal is None else np.zeros((0, 6))
                self._ekf.update_relative(self._pose_then, *motion, used)
            if refusal is None:
                self._ekf.update_match(match)
        self._matched, self._nis = match, nis
        self._health.sweep(match, self._ekf.pose, refusal)
        if self._opinion and (self._health.doubtful or self._stamp >= self._opinion_due):
            self._ask_kiss(self._opinion, sweep, match)

    def _refusal(self, match: Match, nis: float) -> str | None:
        k = len(match.directions)
        if k == 0 or match.fit < self.config.least_fit:
            return f"the map explains only {match.fit:.0%} of the sweep"
        if nis > _GATE[k - 1]:
            return f"the sweep fits the map where the robot cannot be (NIS {nis:.0f} of {_GATE[k - 1]:.0f})"
        return None

    def _plausible(self, motion: Pose, elapsed: float) -> bool:
        """Return whether the robot can have moved as KISS-ICP says it did.

        Wheels that spin or lock move a robot between not at all and as they roll, but for a shove.
        Without wheels, only a tyre's grip is known.
        """
        speed = float(motion.position[0]) / elapsed
        if self.config.suite.wheels or self.config.suite.motion is Motion.ODOMETRY:
            rolled = self._rolled / elapsed
            shove = self.config.shove
            return min(0.0, rolled) - shove <= speed <= max(0.0, rolled) + shove
        gain = speed - (self._seen_speed or 0.0)
        return abs(gain) <= self.config.traction * elapsed + self.config.shove

    def _watch_wheels(self, motion: Pose, covariance: FloatArray, elapsed: float) -> None:
        """Compare how far the wheels rolled with how far KISS-ICP saw the robot go."""
        forward = float(motion.position[0])
        self._seen_speed, self._seen_turn = forward / elapsed, motion.yaw / elapsed
        if not self.config.suite.wheels and self.config.suite.motion is not Motion.ODOMETRY:
            return
        noise = self._ekf.rolling_noise(self._rolled / elapsed, motion.yaw / elapsed)
        variance = covariance[0, 0] + noise**2 * elapsed
        if (forward - self._rolled) ** 2 > _SLIP_GATE * variance:
            self._blame_wheels()

    def _blame_wheels(self) -> None:
        """Admit that the wheels misled the prediction since the last sweep, and may go on to."""
        self._slip_until = self._stamp + self.config.slip_memory
        self._ekf.widen(*self.config.blame)

    def _wheels_to_blame(self, match: Match, unwitnessed: bool) -> bool:
        """A sweep that fits the map but contradicts the prediction blames the wheels.

        If KISS-ICP saw the motion and agrees with the wheels, the map or the earlier pose is at fault.
        """
        fits = len(match.directions) > 0 and match.fit >= self.config.blame_fit
        return fits and (self._slipping or unwitnessed)

    def _ask_kiss(self, opinion: KissOpinion, sweep: Sweep, match: Match) -> None:
        """Get a second opinion; at most five a second, however deep the doubt."""
        if self._stamp < self._opinion_due - self.config.opinion_period * 4 // 5:
            return
        self._opinion_due = self._stamp + self.config.opinion_period
        with self._stage("kiss opinion"):
            other = opinion.locate(sweep, self._ekf.pose)
        if other is not None:
            self._health.opinion(*opinion_offset(self._ekf.pose, other, match))

    # Search

    def _open_search(self, sweep: Sweep) -> None:
        level = self._ekf.pose
        self._desk.begin(sweep, self._odom, level)
        everywhere = self._search_everywhere and self._stamp >= self._everywhere_due
        if everywhere and not self._desk.busy and not self._hypotheses.open:
            self._search_everywhere = False
            self._desk.search_everywhere(sweep, self._odom, level)
        if self._hypotheses.open or self._matcher is None:
            return
        if self._placed and self._health.lost and self._stamp >= self._search_due:
            self._search_due = self._stamp + self.config.lost_search_period
            p, covariance = self._ekf.pose, self._ekf.covariance
            half = float(np.clip(3.0 * horizontal_sigma(covariance), 1.0, 3.0))
            half_yaw = float(np.clip(3.0 * np.sqrt(covariance[5, 5]), np.deg2rad(20.0), np.pi))
            window = Window(float(p.position[0]), float(p.position[1]), p.yaw, half, half_yaw)
            self._desk.search_around(window, sweep, self._odom, level)

    def _search(self) -> None:
        with self._stage("search"):
            trusted = self._placed and not self._health.lost and not self._health.doubtful
            found = self._desk.advance(self._odom, self._ekf.pose if trusted else None)
        if found is not None:
            self._settle(found)

    def _settle(self, found: Found) -> None:
        unsure = not self._placed or self._health.lost
        if found.verdict is Verdict.ACCEPTED and not found.everywhere:
            self._place(found.candidates[0], found.reason)
            # What explains the sweep near where the robot was lost may not be the only place that does.
            self._search_everywhere = self._asked = found.hint is None
        elif found.everywhere or (found.verdict is Verdict.AMBIGUOUS and unsure):
            self._hypotheses.begin(found.candidates, self._odom)
            if found.everywhere and not found.candidates:
                # Nothing to lay over the map, as in the open or behind a crowd: look again from farther on.
                self._search_everywhere = True
                self._everywhere_due = self._stamp + self.config.lost_search_period
        elif found.hint is None:
            # Not around here: it must be somewhere.
            self._search_everywhere = True
        if found.hint is not None:
            self._desk.answer(
                found.hint, self._stamp, found.verdict, found.reason, found.candidates
            )

    def _tell_apart(self, sweep: Sweep) -> None:
        """Judge the places that might be by the newest sweep."""
        if not self._hypotheses.open:
            return
        if self._placed and not self._health.lost and not self._asked:
            self._hypotheses.drop()
            return
        with self._stage("hypotheses"):
            place = self._hypotheses.look(sweep, self._odom)
        if place is not None and self._placed and same_place(place.map_from_base, self._ekf.pose):
            self._hypotheses.drop()
            self._asked = False
        elif place is not None:
            self._place(place, f"explains {place.score:.0%} of the sweeps on the way here")
        elif self._hypotheses.exhausted:
            self._hypotheses.drop()
            self._search_everywhere = True

    def _place(self, place: Candidate, reason: str) -> None:
        sigma = np.array(self.config.placed)
        self._ekf.reset_pose(place.map_from_base, np.diag(sigma**2))
        self._pose_then, self._placed = self._ekf.pose, True
        self._health.reset()
        self._hypotheses.drop()
        self._search_everywhere = self._asked = False
        self._opinion_due = 0
        self._doing = (f"placed anew: {reason}",)

    # The answer

    def _estimate(self) -> Estimate:
        covariance = self._ekf.covariance
        health = Health.WAITING
        reasons: tuple[str, ...] = ("no pose yet: give a hint",)
        if self._placed:
            silent = [
                name
                for name in (*sorted(self._mounts), *self.config.suite.expected)
                if self._stamp - self._heard.get(name, 0) > self.config.health.silence
            ]
            sigma = horizontal_sigma(covariance)
            health, reasons = self._health.state(
                sigma=sigma, slipping=self._slipping, silent=tuple(silent)
            )
        if self._desk.busy and (not self._placed or health is Health.LOST):
            health, reasons = Health.RELOCALISING, ("searching", *reasons)
        if self._asked and self._placed and health in _SURE:
            health = Health.SUSPECT
            reasons = ("other places may explain what is seen: drive on to make sure", *reasons)
        hypotheses = self._hypotheses.candidates(self._odom)
        if hypotheses and (not self._placed or health is Health.LOST):
            places = (
                f"{len(hypotheses)} places explain what is seen"
                if len(hypotheses) > 1
                else ("one place explains what is seen")
            )
            health = Health.RELOCALISING
            reasons = (f"{places}: drive on to make sure", *reasons)
        estimate = Estimate(
            stamp=self._stamp,
            map_from_base=self._ekf.pose if self._placed else None,
            odom_from_base=self._odom,
            covariance=covariance,
            twist=self._ekf.twist,
            health=health,
            reasons=(*self._refused, *self._doing, *reasons),
            match=self._matched,
            sweep=self._sweep,
            verdict=self._desk.next_answer(),
            nis=self._nis,
            hypotheses=hypotheses,
        )
        self._doing, self._refused = (), ()
        return estimate


def _worth(match: Match, share: float) -> Match:
    """Let a match inform by a share of what it would by itself."""
    return match if share == 1.0 else replace(match, information=share * match.information)
