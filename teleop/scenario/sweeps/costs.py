"""What a sweep costs: robot time for processor time, and where the time goes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from teleop.scenario.sweeps.running import STAGES, RunResult


@dataclass(frozen=True, slots=True)
class Costs:
    """The costs of some runs."""

    runs: int
    """Number of runs."""
    robot: float
    """Time of the robot [s]."""
    processor: float
    """Time of the processor, of all workers [s]."""
    shares: dict[str, float]
    """Share of the time of each stage, 0 to 1."""

    def lines(self) -> list[str]:
        """Return them for people."""
        if not self.runs or not self.processor:
            return []
        stages = ", ".join(f"{name} {share:.0%}" for name, share in self.shares.items())
        return [
            f"{self.robot / 3600:.3g} robot-hours in {self.processor / 3600:.3g} core-hours:"
            f" {self.robot / self.processor:.1f} robot-hours a core-hour,"
            f" {self.runs / self.processor * 3600:.0f} runs a core-hour",
            f"time went to: {stages}",
        ]


def costs_of(results: Iterable[RunResult]) -> Costs:
    """Return the costs of runs."""
    times = [result.times for result in results]
    totals = {name: sum(each.get(name, 0.0) for each in times) for name in STAGES}
    every = sum(totals.values()) or 1.0
    return Costs(
        len(times),
        sum(each["robot"] for each in times),
        sum(each["processor"] for each in times),
        {name: total / every for name, total in totals.items()},
    )
