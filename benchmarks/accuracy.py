"""Whole tours of the office with five seeds, and with the wheels slipping: the promised figures."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from localization.maps.prepared_map import default_cache
from robot_sim import load_world
from teleop.scenario.mission import Mission
from teleop.scenario.mission_run import run_in_process
from teleop.scenario.run_summary import RunSummary
from teleop.scene_clouds import load_scene_cloud

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
    world, cloud = load_world("office"), load_scene_cloud("office")
    lines = [
        "  seed             driven    position rmse, max  heading rmse    NEES  in 95 %"
        "   robot    wall  factor"
    ]
    missions = [(f"{seed}", Mission(seed=seed)) for seed in SEEDS]
    missions += [(f"{seed}, {len(SLIPS)} slips", Mission(seed=seed, slip=SLIPS)) for seed in (1, 2)]
    nees = []
    with tempfile.TemporaryDirectory() as folder:
        for name, mission in missions:
            summary, _ = run_in_process(
                mission, world, cloud, Path(folder) / name, cache=default_cache()
            )
            sys.stdout.write("\n".join([*lines, row(name, summary)]) + "\n")
            sys.stdout.flush()
            lines = []
            if not mission.slip:
                nees.append(summary.nees or 0.0)
    sys.stdout.write(f"  mean NEES over {len(nees)} seeds: {np.mean(nees):.2f}; 6 is honest\n")


if __name__ == "__main__":
    main()
