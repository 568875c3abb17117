"""Silent sources: sensors whose readings are overdue, given how often they usually arrive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

_MEMORY = 0.1
"""Weight of the newest interval in the usual one."""
_PATIENCE = 3
"""A source is overdue after this many usual intervals."""


class SourceTimes(NamedTuple):
    """Newest reading of a source and its usual interval; a value."""

    newest: int
    """Stamp of its newest reading [ns]."""
    interval: float = 0.0
    """Usual time between its readings [ns]."""


def with_reading(
    times: Mapping[str, SourceTimes], source: str, stamp: int
) -> Mapping[str, SourceTimes]:
    """Return the times after a reading of a source, stamped in ns."""
    before = times.get(source)
    if before is None:
        return {**times, source: SourceTimes(stamp)}
    if stamp <= before.newest:
        return times
    interval = before.interval + _MEMORY * (stamp - before.newest - before.interval)
    return {**times, source: SourceTimes(stamp, interval)}


def silent_sources(
    times: Mapping[str, SourceTimes], expected: Iterable[str], now: int, silence: int
) -> tuple[str, ...]:
    """Return the sources whose readings are overdue.

    Args:
        times: of all sources so far.
        expected: sources that should have readings.
        now: present time [ns].
        silence: no source is overdue sooner than this [ns]; one whose readings are sparse gets longer.
    """
    return tuple(source for source in expected if _overdue(times.get(source), now, silence))


def _overdue(times: SourceTimes | None, now: int, silence: int) -> bool:
    if times is None:
        return now > silence
    return now - times.newest > max(silence, _PATIENCE * times.interval)
