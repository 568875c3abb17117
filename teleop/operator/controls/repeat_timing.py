"""How long a key counts as held in a terminal that reports no release, measured on the terminal's own repeats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

UNMEASURED_DELAY: Final = 700_000_000
"""Repeat delay that is assumed until it is measured [ns]: above the 660 ms of the X.Org server, the longest default
of the common desktops (GNOME and Windows have 500, KDE 600, macOS 500)."""
DELAY_MARGIN: Final = 60_000_000
"""Time that a repeat may come later than measured [ns]: chosen for a busy machine."""
UNMEASURED_INTERVAL: Final = 100_000_000
"""Time between two repeats that is assumed until it is measured [ns]; desktops have 25 to 50 ms."""
SHORTEST_HOLD: Final = 120_000_000
"""Least time that a repeating key counts as held after a repeat [ns]: three repeats of 40 ms."""
LONGEST_HOLD: Final = 500_000_000
"""Greatest such time [ns]; over connections that jitter more, a held key stutters."""
_FASTEST: Final = 150_000_000
"""Two events of a key that are closer are repeats, not two strokes of a finger [ns]."""
_REMEMBERED: Final = 8
"""Number of intervals and delays that are remembered."""


@dataclass(frozen=True, slots=True)
class RepeatTiming:
    """Delay before the first repeat and intervals between repeats, as measured in this session; a value."""

    delays: tuple[int, ...] = ()
    """The last measured delays [ns]."""
    intervals: tuple[int, ...] = ()
    """The last measured intervals [ns]."""

    @property
    def measured(self) -> bool:
        """Whether the delay of this terminal is known."""
        return bool(self.delays)

    @property
    def first_hold(self) -> int:
        """Time that a key counts as held after it was pressed [ns]."""
        return max(self.delays, default=UNMEASURED_DELAY) + DELAY_MARGIN

    @property
    def repeat_hold(self) -> int:
        """Time that a key counts as held after a repeat [ns]."""
        longest = max(self.intervals, default=UNMEASURED_INTERVAL)
        return min(max(3 * longest, SHORTEST_HOLD), LONGEST_HOLD)

    def is_repeat(self, interval: int) -> bool:
        """Return whether two events of one key are so close [ns] that no finger did it."""
        return interval <= _FASTEST

    def with_delay(self, delay: int) -> RepeatTiming:
        """Return the timing after a delay was measured [ns]; one that no terminal has changes nothing."""
        if not _FASTEST <= delay <= UNMEASURED_DELAY + DELAY_MARGIN:
            return self
        return RepeatTiming((*self.delays, delay)[-_REMEMBERED:], self.intervals)

    def with_interval(self, interval: int) -> RepeatTiming:
        """Return the timing after an interval between two repeats was measured [ns]."""
        return RepeatTiming(self.delays, (*self.intervals, interval)[-_REMEMBERED:])
