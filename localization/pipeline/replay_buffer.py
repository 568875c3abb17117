"""Replay buffer: the inputs of the last seconds in their order, each with the state before it.

A reading that arrives late belongs before others that were processed already. The buffer returns the state
from which to begin again and the inputs to process from there, so that the estimate becomes what it would
have been in order (out-of-sequence measurements).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Generic, TypeVar

from localization.motion.late_readings import LateReadingsConfig
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import (
    Inertial,
    Odometry,
    PointScan,
    Reading,
    Scan,
    WheelSpeeds,
)

State = TypeVar("State")
Item = TypeVar("Item")
Key = tuple[int, int]
"""Stamp [ns] at which a reading is complete, and its rank among those of the same stamp."""

_NEVER: Key = (-1, 0)


@dataclass(frozen=True, slots=True, eq=False)
class Entry(Generic[State, Item]):
    """One input that was processed."""

    item: Item
    """The input: a reading, or a command."""
    key: Key | None
    """Its place in time; None if it takes effect on arrival, as hints and commands do."""
    moves: bool
    """Whether it measures how the robot moved."""
    leads: bool
    """Whether it advanced time."""
    before: State
    """The state before it."""


class ReplayBuffer(Generic[State, Item]):
    """Owns the inputs within the horizon, oldest first."""

    def __init__(self, config: LateReadingsConfig, sensors: SensorConfiguration) -> None:
        self._horizon = config.horizon
        self._leader = sensors.leader
        self._motion = (
            *sensors.leader,
            *((WheelSpeeds,) if sensors.wheels else ()),
            *((Inertial,) if sensors.gyro else ()),
        )
        self._entries: deque[Entry[State, Item]] = deque()
        self._moved, self._led = _NEVER, _NEVER

    def __len__(self) -> int:
        return len(self._entries)

    def is_late(self, item: Item | Reading) -> bool:
        """Return whether a reading belongs before others that were processed already."""
        key = self._key(item) if self._horizon else None
        if key is None:
            return False
        if isinstance(item, self._motion):
            return key < self._moved
        return isinstance(item, Scan | PointScan) and key < self._led

    def append(self, item: Item, state: State) -> None:
        """Append an input that is about to be processed, and the state before it."""
        if not self._horizon:
            return
        key = self._key(item)
        moves, leads = isinstance(item, self._motion), isinstance(item, self._leader)
        self._entries.append(Entry(item, key, moves, leads, state))
        if key is None:
            return
        if moves:
            self._moved = max(self._moved, key)
        if leads:
            self._led = max(self._led, key)
            self._forget(key[0] - self._horizon)

    def rewind(self, reading: Item) -> tuple[State, list[Item]]:
        """Return the state from which to begin again, and the inputs to process from there, in order.

        They are removed from the buffer, and are to be appended again.
        """
        key, moves = self._key(reading), isinstance(reading, self._motion)
        if key is None:
            raise TypeError(f"{reading} has no place in time")
        entries = list(self._entries)
        # A motion reading goes before the next motion reading, a scan before the next that advances time.
        at = next(
            i
            for i, e in enumerate(entries)
            if e.key is not None and e.key > key and (e.leads or (moves and e.moves))
        )
        self._entries = deque(entries[:at])
        self._moved = max((e.key for e in self._entries if e.moves and e.key), default=_NEVER)
        self._led = max((e.key for e in self._entries if e.leads and e.key), default=_NEVER)
        # Scans wait until time has advanced to their end: one that arrived after the reading which advances
        # it now goes first.
        earlier: list[Item] = []
        later: list[Item] = []
        for e in entries[at:]:
            waits = not e.moves and e.key is not None and e.key < key
            (earlier if waits else later).append(e.item)
        return entries[at].before, [*earlier, reading, *later]

    def _forget(self, before: int) -> None:
        """Drop entries before which no reading within the horizon belongs [ns]."""
        while True:
            first = self._entries[0]
            if first.moves and first.key is not None and first.key[0] >= before:
                return
            self._entries.popleft()

    def _key(self, item: Item | Reading) -> Key | None:
        match item:
            case Scan() | PointScan():
                return item.end_stamp, 2 if isinstance(item, self._leader) else 0
            case WheelSpeeds() | Inertial() | Odometry():
                return item.stamp, 2 if isinstance(item, self._leader) else 1
        return None
