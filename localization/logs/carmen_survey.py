"""A first look over a whole CARMEN text: who wrote its lines and at what times, without reading the ranges.

Each line ends with ``ipc_time host logger_time``. One robot may have two computers, one for the laser and one for the
base; but two hosts that take turns in writing lines of one kind are two robots in one file.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

SCANS: Final = frozenset({"FLASER", "ROBOTLASER1"})
"""Kinds of lines that hold a scan."""
ODOM: Final = "ODOM"
"""Kind of the lines that hold a pose of the odometry alone."""

_ENOUGH: Final = 10
"""Number of lines from which equal times cannot be chance."""
_EVEN: Final = 20
"""Times of which each is shared by this many lines in the mean were printed with too few digits."""


@dataclass
class HostLines:
    """Lines of one kind by one host."""

    count: int = 0
    """Number of lines."""
    first: int = 0
    """Number of the first line."""
    last: int = 0
    """Number of the last line."""


@dataclass
class CarmenSurvey:
    """What the ends of all lines of a text say."""

    hosts: dict[str, dict[str, HostLines]] = field(default_factory=dict)
    """Lines by kind, scans and odometry, and by host."""
    times: set[str] = field(default_factory=set)
    """Distinct times of the lines, as printed."""
    logger_times: set[str] = field(default_factory=set)
    """Distinct times at which the lines were logged, as printed."""
    scans: int = 0
    """Number of lines with a scan."""
    odometry: int = 0
    """Number of lines with a pose alone."""
    cut: bool = False
    """Whether the first line is the end of a line."""

    @property
    def lines(self) -> int:
        """Number of lines with a reading."""
        return self.scans + self.odometry

    @property
    def equal_times(self) -> str:
        """Return what is wrong with the times if hardly any two differ; empty if nothing is."""
        if self.lines < _ENOUGH:
            return ""
        if len(self.times) == 1:
            return f"all {self.lines} stamps are equal ({next(iter(self.times))} s)"
        if self.lines > _EVEN * len(self.times):
            return f"its {self.lines} stamps have only {len(self.times)} different values"
        return ""

    @property
    def logger_times_differ(self) -> bool:
        """Whether the times at which lines were logged can stand in for theirs."""
        return 2 * len(self.logger_times) > self.lines

    def readable_hosts(self) -> dict[str, str]:
        """Return the host whose lines are read, by kind of reading; a kind with a single robot is left out.

        Of two robots the first that wrote a scan is read.
        """
        chosen: dict[str, str] = {}
        robot = ""
        for kind, hosts in self.hosts.items():
            begun = min(hosts.items(), key=lambda item: item[1].first)[0]
            read = robot if robot in hosts else begun
            if len(hosts) > 1 and _take_turns(hosts.values()):
                chosen[kind] = read
            robot = robot or read
        return chosen

    def successions(self) -> list[str]:
        """Return a line for each kind of reading whose host changes once and for all."""
        found = []
        for kind, hosts in self.hosts.items():
            if len(hosts) > 1 and not _take_turns(hosts.values()):
                (old, _), (new, lines) = sorted(hosts.items(), key=lambda item: item[1].first)[:2]
                found.append(
                    f"the host that writes its {kind} changes from {old} to {new} at line {lines.first}:"
                    " two drives or two robots in one file?"
                )
        return found


def survey(lines: Iterable[str]) -> CarmenSurvey:
    """Look over all lines of a text."""
    found = CarmenSurvey()
    for number, line in enumerate(lines, 1):
        kind = line[: line.find(" ")]
        if kind in SCANS:
            group = "scans"
            found.scans += 1
        elif kind == ODOM:
            group = "odometry"
            found.odometry += 1
        else:
            found.cut |= number == 1 and bool(line.strip()) and _numeric(line.split()[0])
            continue
        words = line.rsplit(None, 3)
        if len(words) < 4 or _numeric(words[2]):
            continue
        _, time, host, logged = words
        found.times.add(time)
        found.logger_times.add(logged)
        by_host = found.hosts.setdefault(group, {}).setdefault(host, HostLines(first=number))
        by_host.count += 1
        by_host.last = number
    # Scans first: their robot is the one whose odometry is read.
    found.hosts = dict(sorted(found.hosts.items(), key=lambda item: item[0] != "scans"))
    return found


def _take_turns(hosts: Iterable[HostLines]) -> bool:
    """Return whether the lines of some hosts overlap, and each has more than a stray one."""
    spans = sorted((h.first, h.last) for h in hosts if h.count > 1)
    return any(later[0] < earlier[1] for earlier, later in pairwise(spans))


def _numeric(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
