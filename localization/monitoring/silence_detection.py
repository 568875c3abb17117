"""Silent sources: sensors whose readings are overdue, given how often they usually arrive.

Time is counted in which the readings came that advance the localiser's time. A logger or a bus that stalls holds
back all sources at once, and the first reading after it says nothing about the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from localization.types import SECOND

_MEMORY = 0.1
"""Weight of the newest interval in the usual one."""
_PATIENCE = 3
"""A source is overdue after this many usual intervals."""
_STEP = SECOND // 8
"""A step of time up to this is no pause [ns], and none up to ``_STEPS`` usual ones."""
_STEPS = 2
"""A step of time that is longer than so many usual ones is a pause, of which only that much counts."""


class ListeningTime(NamedTuple):
    """Time in which readings came that advance time, without the pauses of all of them; a value."""

    total: int = 0
    """That time [ns]."""
    interval: float = 0.0
    """Usual step between such readings [ns]."""

    def advanced(self, step: int) -> ListeningTime:
        """Return it after a step of time [ns], of which a pause does not count."""
        counted = min(step, max(_STEP, round(_STEPS * self.interval)))
        interval = self.interval + _MEMORY * (step - self.interval)
        return ListeningTime(self.total + counted, interval)


class SourceTimes(NamedTuple):
    """Newest reading of a source and its usual interval; a value."""

    newest: int
    """Stamp of its newest reading [ns]."""
    listened: int = 0
    """Time listened when that came [ns]."""
    interval: float = 0.0
    """Usual time between its readings [ns]."""


def with_reading(
    times: Mapping[str, SourceTimes], source: str, stamp: int, listened: int
) -> Mapping[str, SourceTimes]:
    """Return the times after a reading of a source, stamped in ns, that came at a time listened [ns]."""
    before = times.get(source)
    if before is None:
        return {**times, source: SourceTimes(stamp, listened)}
    if stamp <= before.newest:
        return times
    interval = before.interval + _MEMORY * (stamp - before.newest - before.interval)
    return {**times, source: SourceTimes(stamp, listened, interval)}


def silent_sources(
    times: Mapping[str, SourceTimes],
    expected: Iterable[str],
    now: int,
    listened: int,
    silence: int,
) -> tuple[str, ...]:
    """Return the sources whose readings are overdue.

    Args:
        times: of all sources so far.
        expected: sources that should have readings.
        now: present time [ns].
        listened: time listened so far [ns].
        silence: no source is overdue sooner than this [ns]; one whose readings are sparse gets longer.
    """
    return tuple(s for s in expected if _overdue(times.get(s), now, listened, silence))


def is_silence(gap: int, interval: float, silence: int) -> bool:
    """Return whether a time without readings [ns] is longer than usual intervals [ns] explain."""
    return gap > max(silence, _PATIENCE * interval)


def _overdue(times: SourceTimes | None, now: int, listened: int, silence: int) -> bool:
    if times is None:
        return listened > silence
    gap = min(now - times.newest, listened - times.listened)
    return is_silence(gap, times.interval, silence)
