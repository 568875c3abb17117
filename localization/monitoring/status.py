"""The answer: what state the estimate is in, all things considered, and why."""

from __future__ import annotations

from dataclasses import dataclass

from localization.monitoring.health import HealthMonitor, horizontal_sigma
from localization.relocalization.relocalizer import Belief
from localization.types import Candidate, Health, Match, Pose, ScanConsistency, Sweep

_SURE = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)
"""States of an estimate that is believed."""


@dataclass(frozen=True, slots=True, eq=False)
class SweepNews:
    """A sweep and what came of it, to be told once."""

    sweep: Sweep
    match: Match | None
    nis: float | None
    consistency: ScanConsistency | None
    odom_then: Pose
    """``odom_from_base`` at the sweep's stamp."""

    def seen_from(self, odom: Pose, stamp: int) -> Sweep:
        """Return the sweep as of another ``odom_from_base``, at another stamp [ns]."""
        if stamp == self.sweep.stamp:
            return self.sweep
        moved = odom.inverse() @ self.odom_then
        points, origins = moved.apply(self.sweep.points), moved.apply(self.sweep.origins)
        return Sweep(stamp, points, origins, self.sweep.horizontal)


def state_of(
    belief: Belief,
    monitor: HealthMonitor,
    *,
    slipping: bool,
    silent: tuple[str, ...],
    unseeing: bool,
    mounts: tuple[str, ...],
    searching: bool,
    asked: bool,
    places: tuple[Candidate, ...],
) -> tuple[Health, tuple[str, ...]]:
    """Return the state and its reasons.

    Args:
        belief: the estimate.
        monitor: what the sweeps and second opinions said of it.
        slipping: whether the wheels slip.
        silent: sensors that are overdue.
        unseeing: whether no scanner is left that speaks.
        mounts: what seems wrong with how the scanners are mounted.
        searching: whether a search is under way.
        asked: whether other places may explain what is seen.
        places: between which it is not settled yet.
    """
    health = Health.WAITING
    reasons: tuple[str, ...] = ("no pose yet: give a hint",)
    if belief.placed:
        sigma = horizontal_sigma(belief.covariance)
        health, reasons = monitor.state(
            sigma=sigma, slipping=slipping, silent=silent, unseeing=unseeing, mounts=mounts
        )
    if searching and (not belief.placed or health is Health.LOST):
        health, reasons = Health.RELOCALISING, ("searching", *reasons)
    if asked and belief.placed and health in _SURE:
        health = Health.SUSPECT
        reasons = ("other places may explain what is seen: drive on to make sure", *reasons)
    if places and (not belief.placed or health is Health.LOST):
        many = len(places) > 1
        explain = f"{len(places)} places explain" if many else "one place explains"
        health = Health.RELOCALISING
        reasons = (f"{explain} what is seen: drive on to make sure", *reasons)
    return health, reasons
