"""Speed of ``farsteer sim``: robot time by wall time, and the CPU time of its processes, from first to last tick."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from localization.types import SECOND
from teleop.robot.tick_record import TickRecord
from teleop.scenario.session.run import run_scenario
from teleop.scenario.tour.measures import Meter, TickMeasures
from teleop.scenario.tour.options import TourOptions, tour_scenario

ROUNDS = 5
"""Number of tours, each in a process of its own; the median counts."""


@dataclass(frozen=True)
class Taken:
    """What a tour took from its first tick to its last, all in seconds."""

    robot_time: float
    wall: float
    robot_cpu: float
    """CPU time of the process with the robot."""
    station_cpu: float
    """CPU time of the process with the operator, its display included."""

    @property
    def factor(self) -> float:
        """Robot time by wall time."""
        return self.robot_time / self.wall


class _Span:
    """Notes wall and CPU time at the first tick and at each one that may be the last."""

    def __init__(self, end: int) -> None:
        """Measure up to the tick at ``end`` [ns], or to the last before it that ends a second."""
        self._first: Taken | None = None
        self.taken: Taken | None = None
        self._end = end

    def take(self, tick: TickRecord) -> None:
        """Take a tick."""
        if self._first is None:
            self._first = _now(tick.stamp)
        elif tick.stamp % SECOND == 0 or tick.stamp >= self._end:
            first, now = asdict(self._first), asdict(_now(tick.stamp))
            self.taken = Taken(**{name: now[name] - first[name] for name in now})


def _now(stamp: int) -> Taken:
    others = sum(map(_cpu_of, _descendants(os.getpid())), 0.0)
    return Taken(stamp / SECOND, time.perf_counter(), time.process_time(), others)


def _descendants(process: int) -> Iterator[int]:
    for children in Path(f"/proc/{process}/task").glob("*/children"):
        for child in map(int, children.read_text().split()):
            yield child
            yield from _descendants(child)


def _cpu_of(process: int) -> float:
    """Return the CPU time of a process [s], as ``proc_pid_stat(5)`` has it."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def drive(folder: str) -> None:
    """Drive the tour once, as ``farsteer sim`` does, and print what it took as JSON."""
    scenario, _ = tour_scenario(TourOptions())
    span = _Span(round(scenario.mission.time_limit * SECOND))
    observers = (TickMeasures().take, span.take)
    run_scenario(scenario, Path(folder), observers=observers, wire_observers=(Meter(),))
    assert span.taken is not None
    print(json.dumps(asdict(span.taken)))


def tour() -> Taken:
    """Return what a tour took in a process of its own."""
    program = "import sys; from benchmarks.sim.tour import drive; drive(sys.argv[1])"
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-c", program, folder]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return Taken(**json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    """Print a line for each tour, and the medians."""
    print("   robot time  wall time  real time  CPU, robot  CPU, operator")
    runs = []
    for _ in range(ROUNDS):
        runs.append(tour())
        print(_line(runs[-1]), flush=True)
    middle = {name: median(asdict(run)[name] for run in runs) for name in asdict(runs[0])}
    print(_line(Taken(**middle)), " median of each")


def _line(taken: Taken) -> str:
    return (
        f"  {taken.robot_time:9.1f} s {taken.wall:8.1f} s {taken.factor:9.2f}x"
        f" {taken.robot_cpu:9.1f} s {taken.station_cpu:12.1f} s"
    )


if __name__ == "__main__":
    main()
