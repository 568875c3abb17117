"""Schedule of the searches of the whole map: what causes one, and how far apart they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from localization.types import SECOND, Pose


class SearchCause(StrEnum):
    """Why the whole map is searched; the value is for the operator."""

    REQUESTED = "requested"
    """An operator or a program requested it: no condition applies."""
    NO_POSE = "no pose and no hint"
    """The robot has had scans and no pose for a while."""
    REJECTED_HINT = "the hint was rejected"
    """A hint to a robot that does not know where it is was rejected."""
    LOST = "lost"
    """The robot is lost."""
    DOUBT = "other places may explain what is seen"
    """The pose stands, and the search is a check of it."""


@dataclass(frozen=True, slots=True)
class SearchScheduleConfig:
    """When the robot searches the whole map by itself."""

    distance: float = 1.5
    """A robot that does not know where it is searches again after this distance [m], or after ``period``."""
    period: int = 5 * SECOND
    """A robot that has had scans, but neither pose nor hint, searches after this time [ns]; one that does not know where
    it is searches again after it, or after ``distance``."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchSchedule:
    """The search of the whole map that is due, and the last one that began; a value."""

    cause: SearchCause | None = None
    """Why a search is due; None if none is."""
    waiting_since: int | None = None
    """Time since which the robot has had scans, but neither pose nor hint [ns]."""
    odom_from_base: Pose | None = None
    """Pose at the last sweep."""
    distance: float = 0.0
    """Distance driven since the last search began [m]."""
    begun: int | None = None
    """Time at which the last search began [ns]; None before the first."""

    def with_cause(self, cause: SearchCause) -> SearchSchedule:
        """Return the schedule with a search due; a request is not replaced by a weaker cause."""
        kept = self.cause is SearchCause.REQUESTED
        return self if kept else replace(self, cause=cause)

    def without_cause(self) -> SearchSchedule:
        """Return the schedule with no search due."""
        return replace(self, cause=None, waiting_since=None)

    def moved(self, odom_from_base: Pose) -> SearchSchedule:
        """Return the schedule after the robot moved to a pose in ``odom``."""
        step = 0.0
        if self.odom_from_base is not None:
            x, y, _ = odom_from_base.position - self.odom_from_base.position
            step = float(np.hypot(x, y))
        return replace(self, odom_from_base=odom_from_base, distance=self.distance + step)

    def waited(self, now: int, config: SearchScheduleConfig) -> SearchSchedule:
        """Return the schedule after a sweep of a robot that has neither pose nor hint [ns]."""
        if self.waiting_since is None:
            return replace(self, waiting_since=now)
        if self.cause is None and now - self.waiting_since >= config.period:
            return self.with_cause(SearchCause.NO_POSE)
        return self

    def ready(self, now: int, config: SearchScheduleConfig) -> bool:
        """Return whether the search that is due may begin.

        A search with the same walls in view finds the same places again, and a scanner that reports once
        in a metre would have the whole map searched with each of its scans.
        """
        if self.cause is None or self.cause is SearchCause.REQUESTED or self.begun is None:
            return self.cause is not None
        return self.distance >= config.distance or now - self.begun >= config.period

    def started(self, now: int) -> SearchSchedule:
        """Return the schedule after the search that was due has begun [ns]."""
        return replace(self, cause=None, distance=0.0, begun=now)

    def at_once(self, cause: SearchCause) -> SearchSchedule:
        """Return the schedule with a search due that does not wait for distance or time."""
        return replace(self.with_cause(cause), begun=None)
