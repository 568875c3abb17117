"""Health of the estimate: which state it is in, and why, in words for an operator."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, field, replace

import numpy as np

from localization.geometry import FloatArray
from localization.matching.scan_consistency import explanation
from localization.monitoring.jump_detection import Change
from localization.types import SECOND, Health, Match, Pose, ScanConsistency

_AXES = ("forward", "sideways", "up", "roll", "pitch", "yaw")
_PLANAR = {"forward", "sideways", "yaw"}
"""Axes that a wheeled robot needs; its height, roll and pitch are those of the floor."""
_CONSISTENT = ScanConsistency(0.0, 0.0, 0.0, 0.0)
_MOST_OF_ONE = 0.4
"""One sweep counts for at most this time [s], however rare sweeps are: what is decided over a second rests on three."""


@dataclass(frozen=True, slots=True)
class HealthConfig:
    """When doubt begins and when it ends."""

    low_inlier_ratio: float = 0.5
    """A sweep of which the map explains a smaller share is doubtful."""
    notable_unexplained: float = 0.25
    """A larger share of the sweeps that stays unexplained for about a second is reported, though it does
    not make the pose doubtful."""
    max_free_space_violation: float = 0.10
    """A larger share of the sweeps that passes through mapped surfaces for about a second makes the pose
    suspect. Measured in the worlds, with people and with furniture moved: at most 0.06 where the pose is
    right; mostly 0.10 to 0.30 where it is wrong and the sweep fits all the same."""
    off_map: float = 0.5
    """If a larger share of a sweep ends where nothing is mapped, the robot has left the map: it goes by its
    own motion, and a search of the map would only find wrong places."""
    recheck_period: int = 100
    """Number of sweeps between searches of the whole map while that lasts; 10 s at 10 Hz."""
    jump_inconsistency: float = 0.08
    """After a jump the pose is suspect if a larger share of the sweep passes through mapped surfaces or ends
    where nothing is mapped."""
    jump_growth: float = 0.13
    """That share must also have grown by this at the same time: people who step up to a robot whose wheels slip
    change what is seen, and little more of it passes through the map or leaves it. Below 0, and after a time
    without sweeps, it need not."""
    jump_violation: float = 0.018
    """If only a part of what is seen changed at once, the pose is suspect if the share of the sweep that passes
    through mapped surfaces grew by this at the same time. Of 15,800 sweeps among people none did both, and 96 of
    100 robots that were carried off."""
    jump_occlusion: float = 0.05
    """Such a share is larger by this part of what a sweep has more of beams that end before mapped surfaces:
    people who cause the one cause a little of the other."""
    settling: int = 12 * SECOND // 10
    """Time for which sweeps must fit after a jump before the whole map is searched for other places that fit [ns]:
    until then a robot that is lost is searched for nearby."""
    suspect_after: int = 3
    """Number of rejected or doubtful sweeps in a row that makes the pose suspect, at the least."""
    occluded_suspect_after: int = SECOND
    """Doubtful sweeps that agree with the prediction and pass through no mapped surfaces make the pose suspect
    once they have lasted this long [ns]: people who step up to the robot hide the map for a moment."""
    clear_inlier_ratio: float = 0.55
    """A pose that sweeps have made suspect is so until the map explains this share of a sweep, or until several
    sweeps in a row were good: a share about ``low_inlier_ratio`` is one doubt, not many."""
    lost_after: int = 12
    """Number of such sweeps in a row that makes the pose lost, if they contradict it: they fit the map where
    the robot cannot be, or pass through mapped surfaces; 1.2 s at 10 Hz."""
    occluded_lost_after: int = 50
    """Number of rejected sweeps in a row that makes the pose lost if occlusion could explain them; 5 s at
    10 Hz."""
    trusted_after: int = 3
    """Number of good sweeps in a row after which the pose is trusted again."""
    lost_sigma: float = 1.0
    """A horizontal position known no better than this is lost, one sigma [m]."""
    agreement_distance: float = 3.0
    """After a search has replaced a pose that was not lost, the new one is suspect until sweeps have agreed
    with it over this distance [m]."""
    silence: int = SECOND // 2
    """A scanner or encoder without readings for this long is reported as silent [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class HealthMonitor:
    """Evidence for and against the estimate, counted over sweeps; a value."""

    config: HealthConfig = field(default_factory=HealthConfig)
    """The thresholds."""
    bad: int = 0
    """Number of rejected or doubtful sweeps in a row."""
    bad_for: float = 0.0
    """Time that they have lasted [s]."""
    suspect: bool = False
    """Whether such sweeps have made the pose suspect."""
    good: int = 0
    """Number of good sweeps in a row."""
    violations: int = 0
    """Number of sweeps in a row since too many beams have passed through mapped surfaces."""
    settling: int = 0
    """Time for which sweeps still must fit after a jump [ns]."""
    settled: bool = False
    """Whether the last of those has just fitted."""
    lost: bool = False
    """Whether the pose must not be relied on."""
    off_map: bool = False
    """Whether the robot has left the map."""
    why: str = ""
    """Reason of the last doubt."""
    unobservable: tuple[str, ...] = ()
    """Axes of the robot that the last match does not constrain."""
    consistency: ScanConsistency = _CONSISTENT
    """Agreement of the sweeps with the map, averaged over about a second."""
    unconfirmed: float = 0.0
    """Distance over which sweeps still must agree with the pose before nothing but its own motion can have
    moved the robot [m]; set by a placement, a jump, and a request to search."""
    carried: bool = False
    """Whether what is seen changed at once, as if the robot had been carried."""
    jumped: float = 0.0
    """Distance by which a search has just moved a pose that was not lost [m]."""
    to_agree: float = 0.0
    """Distance over which sweeps still must agree with that [m]."""
    explained: float = 1.0
    """Share of what is seen for which the pose was accepted, until other places are ruled out; else 1."""
    ruled_out: float = 0.0
    """Distance of a place that explains more of the sweeps, but to which the robot cannot have moved [m]."""

    @property
    def doubtful(self) -> bool:
        """Whether the last sweep left doubt."""
        return self.bad > 0 or self.violations > 0

    @property
    def needs_check(self) -> bool:
        """Whether it is time to search for another place that explains what is seen."""
        c = self.config
        return self.settled or self.violations % c.recheck_period == c.suspect_after

    def after_jump(self, consistency: ScanConsistency | None, change: Change) -> HealthMonitor:
        """Return the monitor after a jump in what is seen (see ``jump_detection``).

        People who step before a scanner, or away from it, cause one as well. But they occlude the map, and
        no beam passes through a mapped surface or ends outside of the map.

        Args:
            consistency: agreement of the sweep with the map; None if it was not registered.
            change: how much of what is seen changed.
        """
        c = self.config
        if change is Change.NONE or (consistency is None and change is Change.PART):
            return self
        if consistency is not None:
            before = self.consistency
            grown = consistency.free_space_violation - before.free_space_violation
            hidden = max(0.0, consistency.occluded - before.occluded)
            odd = consistency.free_space_violation + consistency.unmapped
            more = odd - before.free_space_violation - before.unmapped
            at_once = change is Change.MOST and c.jump_growth >= 0.0
            most = change >= Change.MOST and odd > c.jump_inconsistency
            most = most and (not at_once or more > c.jump_growth)
            if not most and grown <= c.jump_violation + c.jump_occlusion * hidden:
                return self
        return replace(self, settling=c.settling, unconfirmed=c.agreement_distance, carried=True)

    def unwitnessed(self) -> HealthMonitor:
        """Return the monitor of a robot whose own motion rules out no place, until metres agree."""
        return replace(self, unconfirmed=self.config.agreement_distance)

    def after_check(self) -> HealthMonitor:
        """Return the monitor after a search found that the robot is where it is believed to be."""
        given = self.explained < 1.0
        to_agree = 0.0 if given else self.to_agree
        return replace(
            self, unconfirmed=0.0, ruled_out=0.0, carried=False, to_agree=to_agree, explained=1.0
        )

    def after_distance(self, distance: float) -> HealthMonitor:
        """Return the monitor after the robot moved on by a distance [m], over which the sweeps agreed or not."""
        if max(self.to_agree, self.unconfirmed) <= 0.0 or self.doubtful or self.settling:
            return self
        left = max(0.0, self.unconfirmed - distance)
        return replace(
            self,
            to_agree=max(0.0, self.to_agree - distance),
            unconfirmed=left,
            carried=self.carried and left > 0.0,
        )

    @classmethod
    def placed(cls, config: HealthConfig, explained: float = 1.0) -> HealthMonitor:
        """Return the monitor of a pose at which the robot was found.

        Args:
            config: the thresholds.
            explained: share of what is seen that the pose explains, if a place that was not searched may clearly
                explain more; else 1. After a robot was carried off, a wrong place may explain most of what it sees: a search of the
                map or driving must show whether it is right.
        """
        far = config.agreement_distance
        to_agree = far if explained < 1.0 else 0.0
        return cls(config, unconfirmed=far, to_agree=to_agree, explained=explained)

    @classmethod
    def after_replacement(
        cls, before: HealthMonitor, jumped: float, *, full: bool = True
    ) -> HealthMonitor:
        """Return the monitor of a pose that a search put in the place of one that was not lost.

        What is seen changes at once in a fast turn and before a crowd as well, so that a robot that may have been
        carried off is trusted at its new pose only if that leaves nothing for another place to explain.

        Args:
            before: evidence about the pose that was replaced.
            jumped: distance between the two [m].
            full: whether the new pose explains nearly all that is seen.
        """
        far = before.config.agreement_distance
        to_agree = 0.0 if before.carried and full else far
        return cls(before.config, jumped=jumped, to_agree=to_agree, unconfirmed=far)

    def after_sweep(
        self,
        match: Match,
        pose: Pose,
        refusal: str | None,
        elapsed: float,
        consistency: ScanConsistency | None = None,
    ) -> HealthMonitor:
        """Return the monitor after a registration.

        Args:
            match: its result.
            pose: ``map_from_base``.
            refusal: why it was rejected, if it was.
            elapsed: time since the sweep before [s].
            consistency: agreement of the sweep with the map, if it was examined.
        """
        c = self.config
        average = _smoothed(self.consistency, consistency)
        doubt = refusal
        if doubt is None and match.inlier_ratio < c.low_inlier_ratio:
            doubt = explanation(match.inlier_ratio, consistency)
        # A sweep that does not fit at all counts as bad, and the robot is searched for nearby first.
        violated = doubt is None and average.free_space_violation > c.max_free_space_violation
        off_map = consistency is not None and consistency.unmapped > c.off_map
        bad, good, why = self.bad, self.good, self.why
        if doubt is None:
            bad, good = 0, good + 1
        elif off_map:
            bad, good = max(bad, c.suspect_after), 0
            why = f"{doubt}: the robot has left the map and goes by its own motion"
        else:
            bad, good, why = bad + 1, 0, doubt
        bad_for = self.bad_for + elapsed if bad else 0.0
        occluded = refusal is None and not off_map and consistency is not None
        occluded = occluded and average.free_space_violation <= c.max_free_space_violation
        fitted = round(min(elapsed, _MOST_OF_ONE) * SECOND) if doubt is None else 0
        settling = max(0, self.settling - fitted)
        begins = bad >= c.suspect_after and (
            not occluded or bad_for * SECOND >= c.occluded_suspect_after
        )
        cleared = match.inlier_ratio >= c.clear_inlier_ratio or good >= c.trusted_after
        monitor = replace(
            self,
            bad=bad,
            good=good,
            bad_for=bad_for,
            suspect=begins or (self.suspect and not (good and cleared)),
            violations=self.violations + 1 if violated else 0,
            settling=settling,
            settled=settling == 0 < self.settling,
            off_map=off_map,
            why=why,
            unobservable=unobservable_axes(match, pose),
            consistency=average,
        )
        if monitor._hopeless(match, refusal, consistency):
            return replace(monitor, lost=True)
        if good >= c.trusted_after:
            return replace(monitor, lost=False)
        return monitor

    def _hopeless(
        self, match: Match, refusal: str | None, consistency: ScanConsistency | None
    ) -> bool:
        """Return whether doubt has lasted long enough.

        A crowd around the robot occludes the map and contradicts no pose; its sweeps may explain little and
        agree with the prediction all the same.
        """
        c = self.config
        crowded = match.inlier_ratio < c.low_inlier_ratio and consistency is not None
        if crowded and self.consistency.free_space_violation <= c.max_free_space_violation:
            return refusal is not None and self.bad >= c.occluded_lost_after
        return self.bad >= c.lost_after

    def after_prediction(self, sigma: float) -> HealthMonitor:
        """Return the monitor after the pose has become as uncertain as this, horizontally [m]."""
        if sigma <= self.config.lost_sigma:
            return self
        return replace(self, lost=True, why=f"position is known to {sigma:.1f} m only")

    def status(
        self,
        *,
        slipping: bool,
        silent: tuple[str, ...],
        blind: str = "",
        mounts: tuple[str, ...] = (),
    ) -> tuple[Health, tuple[str, ...]]:
        """Return the state and its reasons; of several states that apply, the worst.

        Args:
            slipping: whether the wheels slip.
            silent: sensors whose readings are overdue.
            blind: why no sweep is seen, in words; empty if sweeps are.
            mounts: doubts about how the scanners are mounted: notes, which change no state.
        """
        missing = tuple(f"nothing from {name}" for name in silent)
        if self.lost:
            return Health.LOST, (self.why, *missing)
        if self.suspect:
            return Health.SUSPECT, (self.why, *missing)
        if self.violations:
            return Health.SUSPECT, (*self._remarks(), *self._ruled_out(), *missing)
        if self.to_agree > 0.0:
            return Health.SUSPECT, (self._awaited(), *missing)
        if self.settling:
            return Health.SUSPECT, (
                "what is seen changed at once: was the robot carried?",
                *missing,
            )
        if blind:
            # Wheels that slip now mislead it by any distance, unobserved.
            return Health.SUSPECT, (f"{blind}: only the robot's own motion is known", *missing)
        if slipping:
            return Health.SLIPPING, ("the wheels contradict gyro or scanners", *missing)
        unseen = (f"unobservable: {', '.join(self.unobservable)}",) if self.unobservable else ()
        degraded = _PLANAR & set(self.unobservable) or missing
        state = Health.DEGRADED if degraded else Health.TRACKING
        return state, (*unseen, *missing, *mounts, *self._remarks())

    def _awaited(self) -> str:
        """Return what must be confirmed by driving."""
        what = f"a search moved the pose by {self.jumped:.1f} m"
        if self.explained < 1.0:
            what = f"the new pose explains only {self.explained:.0%} of what is seen"
        return f"{what}: undo it if that is wrong; trusted after {self.to_agree:.1f} m of agreement"

    def _ruled_out(self) -> tuple[str, ...]:
        if self.ruled_out <= 0.0:
            return ()
        return (
            f"a place {self.ruled_out:.1f} m away explains more, but the robot's own motion rules it out:"
            " give a hint if it is right",
        )

    def _remarks(self) -> tuple[str, ...]:
        """What an operator may want to know about the place, though it contradicts no pose."""
        seen = self.consistency
        if seen.unexplained <= self.config.notable_unexplained and not self.violations:
            return ()
        return (explanation(1.0 - seen.unexplained, seen),)


def _smoothed(before: ScanConsistency, seen: ScanConsistency | None) -> ScanConsistency:
    """Average with a memory of about a second at ten sweeps a second."""
    if seen is None:
        return before
    return ScanConsistency(
        *(b + 0.1 * (s - b) for b, s in zip(astuple(before), astuple(seen), strict=True))
    )


def horizontal_sigma(covariance: FloatArray) -> float:
    """Return one sigma [m] of the horizontal position along its least certain direction.

    The larger eigenvalue of a symmetric 2 x 2 matrix in closed form; ``numpy.linalg`` has ten times the
    overhead.
    """
    xx, yy, xy = float(covariance[0, 0]), float(covariance[1, 1]), float(covariance[0, 1])
    return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))


def unobservable_axes(match: Match, pose: Pose) -> tuple[str, ...]:
    """Return which of the robot's axes a match does not constrain."""
    axes = np.zeros((6, 6))
    axes[:3, :3] = pose.rotation.T
    axes[3:, 3:] = np.eye(3)
    held = np.square(axes @ match.observable_directions.T).sum(axis=1)
    return tuple(name for name, share in zip(_AXES, held, strict=True) if share < 0.5)
