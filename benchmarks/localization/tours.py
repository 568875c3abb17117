"""Whole tours of the office with five seeds, and with the wheels slipping: the promised figures."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from teleop.scenario.tour.drive import drive_tour
from teleop.scenario.tour.options import TourOptions, tour_scenario
from teleop.scenario.tour.summary import RunSummary

SEEDS = range(1, 6)
SLIPS = (20.0, 31.03, 47.05, 62.5, 90.0, 120.02)
"""Times at which all wheels report twice their speed for a second [s]."""


def row(name: str, summary: RunSummary) -> str:
    """Return one line of the table."""
    assert summary.ate is not None
    position, heading = summary.ate.position, np.rad2deg(summary.ate.heading.rmse)
    f = summary.facts
    return (
        f"  {name:16s} {summary.distance:6.1f} m {position.rmse * 1e3:6.1f} {position.max * 1e3:7.1f} mm"
        f" {heading:8.3f} deg {summary.nees or 0.0:7.2f} {summary.nees_inside or 0.0:7.0%}"
        f" {f.robot_seconds:7.1f} s {f.wall_seconds:6.1f} s {f.robot_seconds / f.wall_seconds:6.1f}x"
    )


def main() -> None:
    """Print the table."""
    lines = [
        "  seed             driven    position rmse, max  heading rmse    NEES  in 95 %"
        "   robot    wall  factor"
    ]
    tours = [(f"{seed}", TourOptions(seed=seed)) for seed in SEEDS]
    tours += [
        (f"{seed}, {len(SLIPS)} slips", TourOptions(seed=seed, slip=SLIPS)) for seed in (1, 2)
    ]
    nees = []
    with tempfile.TemporaryDirectory() as folder:
        for name, options in tours:
            scenario, _ = tour_scenario(options)
            summary = drive_tour(scenario, Path(folder) / name, picture=False).summary
            sys.stdout.write("\n".join([*lines, row(name, summary)]) + "\n")
            sys.stdout.flush()
            lines = []
            if not options.slip:
                nees.append(summary.nees or 0.0)
    sys.stdout.write(f"  mean NEES over {len(nees)} seeds: {np.mean(nees):.2f}; 6 is honest\n")


if __name__ == "__main__":
    main()
