"""The near past: readings in their order, and what the localiser was before them.

A reading that comes late belongs before others that were taken already. The past says from which state to
begin again, and with which readings, so that the estimate becomes what it would have been in order.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from localization.errors import LocalizationError
from localization.geometry import so3_log
from localization.motion.motion_model import SensorConfiguration
from localization.types import (
    SECOND,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)

State = TypeVar("State")
Order = TypeVar("Order")
Key = tuple[int, int]
"""Stamp [ns] at which a reading is complete, and its rank among those of the same stamp."""

_SPACING = SECOND // 50
"""States are kept at least this far apart [ns]: a reading that is late by less than a sweep then never
has a sweep registered again."""


@dataclass(frozen=True, slots=True)
class LateReadingsConfig:
    """How readings are taken in that come late."""

    horizon: int = 2 * SECOND
    """A reading later than this is refused [ns]; with 0, whatever is not in order."""
    reuse_distance: float = 0.005
    """A sweep that was registered already keeps its match unless the prediction moved farther [m]. Its
    match is the sweep's own word, free of the prediction, and known to some 3 mm. With 0 every sweep is
    registered again, and the result is that of readings in order, bit for bit."""
    reuse_angle: float = np.deg2rad(0.2)
    """... or turned farther [rad]."""

    def __post_init__(self) -> None:
        if self.horizon < 0 or self.reuse_distance < 0.0 or self.reuse_angle < 0.0:
            raise LocalizationError("rewind settings must be >= 0")

    @property
    def exact(self) -> bool:
        """Whether everything is done again."""
        return self.reuse_distance == 0.0

    def same(self, a: Pose, b: Pose) -> bool:
        """Return whether two predictions are as good as one."""
        if np.array_equal(a.position, b.position) and np.array_equal(a.rotation, b.rotation):
            return True
        if float(np.abs(a.position - b.position).max()) > self.reuse_distance:
            return False
        return float(np.abs(so3_log(a.rotation.T @ b.rotation)).max()) <= self.reuse_angle


@dataclass(frozen=True, slots=True, eq=False)
class Event(Generic[State, Order]):
    """One thing that was taken, and what the localiser was before it, where that is remembered."""

    what: Reading | Order
    key: Key | None
    """Where it belongs; None if it counts when it comes, as hints and orders do."""
    moves: bool
    """Whether it tells how the robot moved."""
    leads: bool
    """Whether it moved time on."""
    before: State | None


class Past(Generic[State, Order]):
    """Owns the events within the horizon, oldest first; the first one's state is always there."""

    def __init__(self, config: LateReadingsConfig, suite: SensorConfiguration) -> None:
        self._horizon = config.horizon
        self._leader = suite.leader
        self._heeded = (*suite.leader, *((WheelSpeeds,) if suite.wheels else ()))
        self._events: deque[Event[State, Order]] = deque()
        self._moved, self._led = (-1, 0), (-1, 0)
        self._kept = -_SPACING

    def __len__(self) -> int:
        return len(self._events)

    def late(self, what: Reading | Order) -> bool:
        """Return whether a reading belongs before what was taken already."""
        if not self._horizon:
            return False
        key = self._key(what)
        if key is None:
            return False
        if isinstance(what, self._heeded):
            return key < self._moved
        return isinstance(what, Scan | PointScan) and key < self._led

    def note(self, what: Reading | Order, state: Callable[[], State]) -> None:
        """Append what is about to be taken.

        Args:
            what: a reading, or an order of the operator's.
            state: gives what the localiser is now; asked only if that is to be remembered.
        """
        if not self._horizon:
            return
        key = self._key(what)
        moves, leads = isinstance(what, self._heeded), isinstance(what, self._leader)
        due = leads and key is not None and key[0] >= self._kept + _SPACING
        before = state() if due or not self._events else None
        self._events.append(Event(what, key, moves, leads, before))
        if key is not None and moves:
            self._moved = max(self._moved, key)
        if key is not None and leads:
            self._led = max(self._led, key)
            if before is not None:
                self._kept = key[0]
                self._forget(key[0] - self._horizon)

    def rewind(self, reading: Reading) -> tuple[State, list[Reading | Order]]:
        """Return the state from which to begin again, and what to take from there, in order.

        All that is returned is forgotten here, and must be noted again.
        """
        key, moves = self._key(reading), isinstance(reading, self._heeded)
        assert key is not None
        events = list(self._events)
        at = next(
            i
            for i, e in enumerate(events)
            if e.key is not None and e.key > key and (e.leads or (moves and e.moves))
        )
        begin = max(i for i in range(at + 1) if events[i].before is not None)
        state = events[begin].before
        assert state is not None
        self._events = deque(events[:begin])
        kept = self._events
        self._moved = max((e.key for e in kept if e.moves and e.key is not None), default=(-1, 0))
        self._led = max((e.key for e in kept if e.leads and e.key is not None), default=(-1, 0))
        states = [e.key[0] for e in kept if e.leads and e.before is not None and e.key is not None]
        self._kept = states[-1] if states else -_SPACING
        # Scans wait until time has moved on to their end: one that came after the reading that does it
        # now goes first.
        since = events[at:]
        first = [e for e in since if not e.moves and e.key is not None and e.key < key]
        rest = [e for e in since if e not in first]
        before, after = (*events[begin:at], *first), rest
        return state, [*(e.what for e in before), reading, *(e.what for e in after)]

    def _forget(self, before: int) -> None:
        """Drop what no reading can come before any more, but for the state to begin from."""
        while True:
            following = (
                i for i, e in enumerate(self._events) if i and e.leads and e.before is not None
            )
            i = next(following, None)
            if i is None:
                return
            key = self._events[i].key
            if key is None or key[0] > before:
                return
            for _ in range(i):
                self._events.popleft()

    def _key(self, what: Reading | Order) -> Key | None:
        match what:
            case Scan() | PointScan():
                return what.end_stamp, 2 if isinstance(what, self._leader) else 0
            case WheelSpeeds() | Inertial() | Odometry():
                return what.stamp, 2 if isinstance(what, self._leader) else 1
        return None
