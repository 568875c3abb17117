"""Schedules: bodies that come and go at given times, and are parked out of reach in between."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from localization.types import IntArray
from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError

Poses: TypeAlias = Callable[[IntArray], tuple[FloatArray, FloatArray]]
"""Positions (N, 3) [m] and yaws (N,) [rad] at times (N,) [ns], as ``Mover.pose_at``."""

PARKED: Final = -300.0
"""Height at which bodies are parked [m]: no scanner reaches as far."""
CELLAR: Final = -10.0
"""Height at which they are compiled [m], below any floor. Farther down they would enlarge the model's extent, from
which pictures of it are scaled."""


@dataclass(frozen=True, slots=True)
class Standing:
    """A pose that does not change."""

    x: float
    """x in ``map`` [m]."""
    y: float
    """y in ``map`` [m]."""
    z: float
    """Height of the ground it stands on [m]."""
    yaw: float
    """Yaw [rad]."""

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """See ``Mover.pose_at``."""
        place = np.array([self.x, self.y, self.z])
        return np.tile(place, (len(times), 1)), np.full(len(times), self.yaw)


class Scheduled:
    """A mover that follows one motion after another; its pose jumps where one takes over."""

    def __init__(self, name: str, entries: Sequence[tuple[int, Poses | None]] = ()) -> None:
        """Take the schedule.

        Args:
            name: Name of the mocap body.
            entries: The first time of each motion [ns], ascending, and the motion; None parks the body, as it is
                before the first entry.
        """
        self.name = name
        self._starts: list[int] = [start for start, _ in entries]
        self._motions: list[Poses | None] = [motion for _, motion in entries]

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """See ``Mover.pose_at``."""
        entries = np.searchsorted(self._starts, times, "right") - 1
        first = int(entries.min(initial=len(self._starts)))
        last = int(entries.max(initial=-1))
        if first >= last:
            return self._poses(last, times)
        positions, yaws = np.empty((len(times), 3)), np.empty(len(times))
        for entry in range(first, last + 1):
            rows = entries == entry
            positions[rows], yaws[rows] = self._poses(entry, times[rows])
        return positions, yaws

    def jumps(self, first: int, last: int) -> bool:
        """Return whether one motion takes over from another after ``first``, until ``last`` [ns]."""
        return bisect_right(self._starts, first) < bisect_right(self._starts, last)

    def parked(self, first: int, last: int) -> bool:
        """Return whether the body is parked all the time from ``first`` to ``last`` [ns]."""
        entry = bisect_right(self._starts, last)
        nowhere = entry == 0 or self._motions[entry - 1] is None
        return nowhere and bisect_right(self._starts, first) == entry

    def _poses(self, entry: int, times: IntArray) -> tuple[FloatArray, FloatArray]:
        motion = self._motions[entry] if entry >= 0 else None
        return _NOWHERE.pose_at(times) if motion is None else motion(times)


class Arrival(Scheduled):
    """A hard body that comes at its time and may go again; something in its way can hold it back."""

    def __init__(self, name: str, pose: Standing, start: int, end: int | None) -> None:
        """Let it stand at a pose from ``start``, to ``end`` unless that is None [ns]."""
        entries: list[tuple[int, Poses | None]] = [(start, pose.pose_at)]
        super().__init__(name, entries if end is None else [*entries, (end, None)])
        self._pose, self._end = pose, end

    def own(self) -> Arrival:
        """Return a copy, which one simulation may hold back."""
        return Arrival(self.name, self._pose, self._starts[0], self._end)

    def comes(self, first: int, last: int) -> bool:
        """Return whether it comes after ``first``, until ``last`` [ns]."""
        return first < self._starts[0] <= last

    def hold_back(self, until: int) -> None:
        """Let it come right after a time [ns] instead; not at all, if it would be gone by then."""
        self._starts[0] = until + 1
        if self._end is not None and self._end <= until + 1:
            self._starts, self._motions = [self._end], [None]


class OpenSchedule(Scheduled):
    """A schedule to which a running simulation adds; what has been stays as it was."""

    def add(self, after: int, motion: Poses | None) -> None:
        """Let a motion, or parking, begin right after a time [ns].

        Raises:
            WorldError: The schedule reaches farther already.
        """
        if self._starts and after + 1 < self._starts[-1]:
            raise WorldError(f"the past of {self.name!r} cannot be changed")
        if self._starts and after + 1 == self._starts[-1]:
            self._motions[-1] = motion
            return
        self._starts.append(after + 1)
        self._motions.append(motion)


_NOWHERE: Final = Standing(0.0, 0.0, PARKED, 0.0)
