"""A prepared map of two million points: bytes in memory and on disk, seconds to prepare and to load."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.figures import OURS, Figure, say
from benchmarks.replay.recordings import world_of
from localization.maps.cloud import Cloud
from localization.maps.map_cache import default_cache
from localization.maps.map_files import load_cloud, save_cloud
from localization.maps.prepared_map import PreparedMap, prepare
from teleop.world_building.station_survey import survey_from_stations

BUILDINGS = ("building-901-2000", "building-902-2000")
"""Generated, and put side by side; [m^2] is the last number. They have a point every 5 cm of surface."""
POINTS = 2_000_000
"""Of both, those with the smallest x."""
APART = 60.0
"""From one building's origin to the next one's [m]: more than either is long."""
GOAL_BYTES, GOAL_SECONDS = 200e6, 1.0


def main() -> None:
    """Prepare in one fresh process, load in the next, and print what both took."""
    with tempfile.TemporaryDirectory() as folder:
        cache = str(Path(folder) / "cache")
        cloud = side_by_side(BUILDINGS, Path(folder) / "buildings.ply")
        first = _in_a_process(cloud, cache)
        again = _in_a_process(cloud, cache)
        (file,) = Path(cache).glob("*.npz")
        on_disk = file.stat().st_size
    case, n = " and ".join(BUILDINGS), int(again["points"])
    cpu = "CPU of one thread"
    say(f"  {case}: {n} points, {again['cells'] / 1e6:.0f} M cells within reach")
    for figure in (
        Figure(case, OURS, "all arrays, cloud and grid", again["arrays"] / 1e6, "MB", most=GOAL_BYTES / 1e6),
        Figure(case, OURS, "grid on disk", on_disk / 1e6, "MB", most=GOAL_BYTES / 1e6),
        Figure(case, OURS, "memory taken by loading", again["loaded"] / 1e6, "MB", most=GOAL_BYTES / 1e6),
        Figure(case, OURS, "the same, all of it looked at", again["touched"] / 1e6, "MB"),
        Figure(case, OURS, f"prepared from the cloud, {cpu}", first["prepare"], "s"),
        Figure(case, OURS, f"loaded from cache, {cpu}", again["prepare"], "s", most=GOAL_SECONDS),
        Figure(case, OURS, f"and the cloud read besides, {cpu}", again["cloud"] + again["prepare"], "s", most=GOAL_SECONDS),
    ):  # fmt: skip
        goal = f"goal {figure.goal}: {figure.verdict}" if figure.verdict else ""
        say(f"    {figure.quantity:48s} {figure.text:12s} {goal}".rstrip())


def surveyed(scene: str) -> Path:
    """Return the file of a building's cloud; it is surveyed once, which takes minutes."""
    file = default_cache() / "benchmarks" / f"{scene}.ply"
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        save_cloud(survey_from_stations(world_of(scene)), file)
    return file


def side_by_side(scenes: Sequence[str], file: Path) -> Path:
    """Write one cloud of several buildings that stand along x; return its file."""
    clouds = [load_cloud(surveyed(scene)) for scene in scenes]
    shifts = [np.array([i * APART, 0.0, 0.0]) for i in range(len(clouds))]
    points = np.concatenate([c.points + d for c, d in zip(clouds, shifts, strict=True)])
    normals = np.concatenate([c.normals for c in clouds])
    kept = np.argsort(points[:, 0], kind="stable")[:POINTS]
    save_cloud(Cloud(points[kept], normals[kept], name="side by side"), file)
    return file


def _in_a_process(cloud: Path, cache: str) -> dict[str, float]:
    words = [sys.executable, "-m", "benchmarks.localization.prepared_map", str(cloud), cache]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    told: dict[str, float] = json.loads(done.stdout)
    return told


def _measure(cloud_file: Path, cache: Path) -> dict[str, float]:
    """Load a cloud, prepare it, look at every cell, and measure time and memory."""
    before = _resident()
    cloud, reading = _timed(lambda: load_cloud(cloud_file))
    world, preparing = _timed(lambda: prepare(cloud, cache=cache))
    loaded = _resident()
    grid = world.grid
    cells = int((grid.blocks > 0).sum())
    return {
        "points": len(cloud.points),
        "cells": cells,
        "arrays": _bytes(world),
        "loaded": loaded - before,
        "touched": _resident() - before,
        "cloud": reading,
        "prepare": preparing,
    }


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    begun = time.process_time()
    done = work()
    return done, time.process_time() - begun


def _bytes(world: PreparedMap) -> int:
    cloud = world.cloud
    return (
        cloud.points.nbytes + cloud.normals.nbytes + world.grid.nbytes + world.ground.height.nbytes
    )


def _resident() -> int:
    """Memory of this process [bytes], pages of files that it looks at included."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024
    raise RuntimeError("/proc/self/status has no VmRSS: this benchmark needs Linux")


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_measure(Path(sys.argv[1]), Path(sys.argv[2]))))
