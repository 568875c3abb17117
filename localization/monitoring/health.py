"""Health of the estimate: which state it is in, and why, in words for an operator."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, field, replace

import numpy as np

from localization.matching.scan_consistency import explanation
from localization.monitoring.belief import (
    Belief,
    BeliefConfig,
    break_in_view,
    evidence_of,
    evidence_unmoved,
    independence,
    probably_carried,
)
from localization.monitoring.jump_detection import Change
from localization.types import SECOND, Health, Match, Pose, ScanConsistency

_AXES = ("forward", "sideways", "up", "roll", "pitch", "yaw")
_PLANAR = {"forward", "sideways", "yaw"}
"""Axes that a wheeled robot needs; its height, roll and pitch are those of the floor."""
_CONSISTENT = ScanConsistency(0.0, 0.0, 0.0, 0.0)
_MOST_OF_ONE = 0.4
"""Weight of one sweep in the averages over about a second, at most, however rare sweeps are."""
_NOTHING = ScanConsistency(1.0, 0.0, 1.0, 0.0)
"""Agreement with the map of a sweep without a return: all beams pass through what is mapped."""
_SUSPECT = -1.0
"""Odds, as a logarithm, of a pose that is suspect, but not lost."""
_CHANGED = "what is seen changed at once: was the robot carried?"


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a match is rejected."""

    reason: str
    """In words."""
    excess: float = 0.0
    """By how much its NIS is beyond the gate, if the sweep fits the map where the robot cannot be; 0 if it fits nowhere."""

    @property
    def elsewhere(self) -> bool:
        """Whether the sweep fits the map, but where the robot cannot be."""
        return self.excess > 0.0


@dataclass(frozen=True, slots=True)
class HealthConfig:
    """When doubt begins and when it ends."""

    notable_unexplained: float = 0.25
    """A larger share of the sweeps that stays unexplained for about a second is reported, whatever it says of the
    pose."""
    check_after: float = 1.2
    """A doubt that lasts for so long has the whole map searched for other places that fit [s]."""
    lost_sigma: float = 1.0
    """A horizontal position known no better than this is lost, one sigma [m]."""
    agreement_distance: float = 3.0
    """After a placement, a jump and a request to search, the robot's own motion rules out no place until sweeps have
    agreed with the pose over this distance [m]."""
    silence: int = SECOND // 2
    """A scanner or encoder without readings for this long is reported as silent [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class HealthMonitor:
    """Evidence for and against the estimate, counted over sweeps; a value."""

    config: HealthConfig = field(default_factory=HealthConfig)
    """The thresholds."""
    belief_config: BeliefConfig = field(default_factory=BeliefConfig)
    """What changes the belief."""
    belief: Belief = field(default_factory=lambda: Belief.of_found(BeliefConfig()))
    """How probable it is that the pose is right."""
    doubted_for: float = 0.0
    """Time for which the pose has not been believed [s]."""
    uncertain: bool = False
    """Whether the position is known too poorly."""
    off_map: bool = False
    """Whether the robot has left the map."""
    why: str = "nothing confirms the pose"
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
    ruled_out: float = 0.0
    """Distance of a place that explains more of the sweeps, but to which the robot cannot have moved [m]."""

    @property
    def doubtful(self) -> bool:
        """Whether the pose is not believed."""
        return not self.belief.sure(self.belief_config)

    @property
    def lost(self) -> bool:
        """Whether the pose must not be relied on."""
        return self.uncertain or self.belief.lost(self.belief_config)

    @property
    def needs_check(self) -> bool:
        """Whether it is time to search for another place that explains what is seen."""
        if self.off_map or self.lost:
            return False
        return self.doubted_for >= self.config.check_after or (self.carried and not self.doubtful)

    def unwitnessed(self) -> HealthMonitor:
        """Return the monitor of a robot whose own motion rules out no place, until metres agree."""
        return replace(self, unconfirmed=self.config.agreement_distance)

    def after_check(self) -> HealthMonitor:
        """Return the monitor after a search found that the robot is where it is believed to be."""
        return replace(self, unconfirmed=0.0, ruled_out=0.0, carried=False)

    def after_distance(self, distance: float) -> HealthMonitor:
        """Return the monitor after the robot moved on by a distance [m], over which the sweeps agreed or not."""
        if self.unconfirmed <= 0.0 or self.doubtful:
            return self
        left = max(0.0, self.unconfirmed - distance)
        return replace(self, unconfirmed=left, carried=self.carried and left > 0.0)

    @classmethod
    def placed(cls, config: HealthConfig, belief: BeliefConfig) -> HealthMonitor:
        """Return the monitor of a pose at which the robot was found."""
        return cls(config, belief, Belief.of_found(belief), unconfirmed=config.agreement_distance)

    def after_sweep(
        self,
        match: Match,
        pose: Pose,
        refusal: Refusal | None,
        elapsed: float,
        moved: float,
        consistency: ScanConsistency | None = None,
        change: Change | None = None,
        blind: bool = False,
        slipping: bool = False,
    ) -> HealthMonitor:
        """Return the monitor after a registration.

        Args:
            match: its result.
            pose: ``map_from_base``.
            refusal: why it was rejected, if it was.
            elapsed: time since the sweep before [s].
            moved: way driven since then by odometry [m].
            consistency: agreement of the sweep with the map, if it was examined.
            change: how much of the sweep does not follow from the one before, if that is known.
            blind: whether the robot drove without a sweep before, and may be anywhere.
            slipping: whether the wheels slip.
        """
        b, usual, unmoved = self.belief_config, self.consistency, math.inf
        new = min(elapsed, _MOST_OF_ONE)
        if change is not None:
            unmoved = evidence_unmoved(break_in_view(change.unexpected, consistency, usual), b)
        moved_off = probably_carried(elapsed, unmoved, b)
        # Of wheels that slip, and a sweep that is of no use, nothing says that the robot was not moved.
        unwitnessed = slipping and refusal is not None
        unmoved = min(unmoved, 0.0) if unwitnessed else unmoved
        since = self.belief.after_time(elapsed, unmoved, b)
        # Nor does it of wheels that slipped in the dark.
        since = Belief(min(since.odds, 0.0)) if slipping and blind else since
        excess = 0.0 if refusal is None else refusal.excess
        evidence, off_map, mostly = 0.0, False, False
        if consistency is not None or refusal is not None:
            consistency = consistency or _NOTHING
            # Of one that fits elsewhere, as a normal distribution falls off beyond the gate, or as of one that fits nowhere.
            elsewhere = max(-0.5 * excess, evidence_of(_NOTHING, b))
            evidence = elsewhere if excess else evidence_of(consistency, b)
            # What is refused may speak against the pose, but not for it.
            evidence = evidence if refusal is None else min(evidence, 0.0)
            off_map = consistency.unmapped > b.mostly
            mostly = off_map or (not excess and consistency.unexplained < b.mostly)
        # One sweep makes no pose lost: a reading that came too late may have caused it.
        least = _SUSPECT if mostly or not self.doubtful else -math.inf
        unexpected = 0.0 if change is None else change.unexpected
        belief = since.after_sweep(evidence, independence(elapsed, moved, unexpected, b))
        belief = belief.at_least(min(self.belief.odds, least))
        doubted = not belief.sure(b)
        begins = doubted and not self.doubtful
        at_once = begins and not since.sure(b)
        carried = (at_once and moved_off) or (begins and blind)
        why = self.why
        if at_once and not unwitnessed:
            why = _CHANGED
        elif evidence < 0.0 or (begins and unwitnessed):
            why = refusal.reason if refusal else explanation(match.inlier_ratio, consistency)
            why += " while the wheels slip" if unwitnessed else ""
            why += ": the robot has left the map and goes by its own motion" if off_map else ""
        return replace(
            self,
            belief=belief,
            doubted_for=self.doubted_for + elapsed if doubted and self.doubtful else 0.0,
            off_map=off_map,
            why=why,
            unobservable=unobservable_axes(match, pose),
            consistency=_smoothed(usual, consistency, new),
            unconfirmed=self.config.agreement_distance if carried or blind else self.unconfirmed,
            carried=carried or self.carried,
        )

    def after_prediction(self, sigma: float) -> HealthMonitor:
        """Return the monitor after the pose has become as uncertain as this, horizontally [m]."""
        uncertain = sigma > self.config.lost_sigma
        if not uncertain:
            return replace(self, uncertain=False) if self.uncertain else self
        return replace(self, uncertain=True, why=f"position is known to {sigma:.1f} m only")

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
        if self.doubtful:
            return Health.SUSPECT, (self.why, *self._ruled_out(), *missing)
        if blind:
            # Wheels that slip now mislead it by any distance, unobserved.
            return Health.SUSPECT, (f"{blind}: only the robot's own motion is known", *missing)
        if slipping:
            return Health.SLIPPING, ("the wheels contradict gyro or scanners", *missing)
        unseen = (f"unobservable: {', '.join(self.unobservable)}",) if self.unobservable else ()
        degraded = _PLANAR & set(self.unobservable) or missing
        state = Health.DEGRADED if degraded else Health.TRACKING
        return state, (*unseen, *missing, *mounts, *self._remarks())

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
        if seen.unexplained <= self.config.notable_unexplained:
            return ()
        return (explanation(1.0 - seen.unexplained, seen),)


def _smoothed(before: ScanConsistency, seen: ScanConsistency | None, new: float) -> ScanConsistency:
    """Average; the newest sweep makes up a share."""
    if seen is None:
        return before
    return ScanConsistency(
        *(b + new * (s - b) for b, s in zip(astuple(before), astuple(seen), strict=True))
    )


def unobservable_axes(match: Match, pose: Pose) -> tuple[str, ...]:
    """Return which of the robot's axes a match does not constrain."""
    axes = np.zeros((6, 6))
    axes[:3, :3] = pose.rotation.T
    axes[3:, 3:] = np.eye(3)
    held = np.square(axes @ match.observable_directions.T).sum(axis=1)
    return tuple(name for name, share in zip(_AXES, held, strict=True) if share < 0.5)
