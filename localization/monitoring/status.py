"""Status of the whole localiser: the state of the estimate, all things considered, and why."""

from __future__ import annotations

from localization.monitoring.health import HealthMonitor
from localization.types import Candidate, Health

_BELIEVED = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)
"""States of an estimate that is believed."""


def status_of(
    monitor: HealthMonitor,
    *,
    placed: bool,
    slipping: bool,
    silent: tuple[str, ...],
    no_scanner: bool,
    left_out: int,
    mounts: tuple[str, ...],
    searching: str,
    outlook: str,
    checking: bool,
    candidates: tuple[Candidate, ...],
) -> tuple[Health, tuple[str, ...]]:
    """Return the state and its reasons.

    Args:
        monitor: the evidence of the sweeps.
        placed: whether there is a pose in the map.
        slipping: whether the wheels slip.
        silent: sensors whose readings are overdue.
        no_scanner: whether all scanners are silent.
        left_out: number of scans left out since the last sweep, if that was long ago.
        mounts: doubts about how the scanners are mounted.
        searching: what is being searched for, in words; empty if nothing is.
        outlook: what becomes of a robot without a pose, in words.
        checking: whether other places may explain what is seen.
        candidates: places between which the search has not decided yet.
    """
    health = Health.WAITING
    reasons: tuple[str, ...] = (outlook,)
    blind = "all scanners are silent" if no_scanner else ""
    blind = f"cannot keep up: {left_out} scans left out" if left_out else blind
    if placed:
        health, reasons = monitor.status(
            slipping=slipping, silent=silent, blind=blind, mounts=mounts
        )
    if searching and (not placed or health is Health.LOST):
        health, reasons = Health.RELOCALISING, (searching, *(reasons if placed else ()))
    if checking and placed and health in _BELIEVED:
        health = Health.SUSPECT
        reasons = ("other places may explain what is seen: drive on to make sure", *reasons)
    if candidates and (not placed or health is Health.LOST):
        many = len(candidates) > 1
        explain = f"{len(candidates)} places explain" if many else "one place explains"
        health = Health.RELOCALISING
        reasons = (f"{explain} what is seen: drive on to make sure", *(reasons if placed else ()))
    return health, reasons
