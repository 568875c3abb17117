"""The answer: what state the estimate is in, all things considered, and why."""

from __future__ import annotations

from localization.health import HealthMonitor, horizontal_sigma
from localization.seeker import Belief
from localization.types import Candidate, Health

_SURE = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)
"""States of an estimate that is believed."""


def state_of(
    belief: Belief,
    monitor: HealthMonitor,
    *,
    slipping: bool,
    silent: tuple[str, ...],
    unseeing: bool,
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
        searching: whether a search is under way.
        asked: whether other places may explain what is seen.
        places: between which it is not settled yet.
    """
    health = Health.WAITING
    reasons: tuple[str, ...] = ("no pose yet: give a hint",)
    if belief.placed:
        sigma = horizontal_sigma(belief.covariance)
        health, reasons = monitor.state(
            sigma=sigma, slipping=slipping, silent=silent, unseeing=unseeing
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
