"""What a sweep costs the localiser, part by part, beside KISS-ICP's scan-to-map on the same sweeps."""

from __future__ import annotations

import dataclasses
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from localization.kiss import KissConfig, KissOpinion
from localization.localizer import Localizer
from localization.log import read_log
from localization.prepared import PreparedMap, default_cache, prepare
from localization.registration import register
from localization.types import Inertial, Pose, Sweep
from robot_sim import load_world
from teleop.pacing import Stopwatch
from teleop.scenario.mission import Mission
from teleop.scenario.run import cloud_of, run_here

SECONDS = 60.0
PEER = KissConfig(keypoint_spacing=0.01)
"""KISS-ICP with voxels of 0.2 m, 20 points in each, one thread, every point of the sweep."""


def replay(log: Path, world: PreparedMap) -> tuple[Stopwatch, list[float], list[float]]:
    """Localise a log; on each sweep also time our registration and the peer's from one prediction."""
    watch = Stopwatch()
    readings = read_log(log)
    localizer = Localizer(world, readings.mounts, stage=watch.stage)
    peer = KissOpinion(world.cloud, PEER)
    ours, theirs = [], []
    before, odom_before = None, None
    for reading in readings:
        estimate = localizer.add(reading)
        if not isinstance(reading, Inertial):
            continue
        if estimate.sweep is not None and estimate.map_from_base is not None:
            if before is not None and odom_before is not None:
                # Both start where the wheels led since the last sweep.
                guess = before @ (odom_before.inverse() @ estimate.odom_from_base)
                covariance = np.diag([0.005, 0.005, 0.005, 0.002, 0.002, 0.002]) ** 2
                begun = time.perf_counter()
                register(estimate.sweep, world, guess, covariance)
                ours.append(time.perf_counter() - begun)
                theirs.append(timed_peer(peer, estimate.sweep, guess))
            before, odom_before = estimate.map_from_base, estimate.odom_from_base
    return watch, ours, theirs


def timed_peer(peer: KissOpinion, sweep: Sweep, guess: Pose) -> float:
    """Return how long the peer takes for one sweep [s]."""
    begun = time.perf_counter()
    peer.locate(sweep, guess)
    return time.perf_counter() - begun


def main() -> None:
    """Print the tables."""
    cloud = cloud_of("office")
    world = prepare(cloud, cache=default_cache())
    with tempfile.TemporaryDirectory() as folder:
        mission = dataclasses.replace(Mission(seed=1), duration=SECONDS)
        run_here(mission, load_world("office"), cloud, Path(folder), cache=default_cache())
        watch, ours, theirs = replay(Path(folder) / "readings.mcap", world)
    lines = [f"office, {SECONDS:.0f} s, two scanners of 541 beams at 10 Hz, one thread"]
    lines.append("  stage               calls   p50 ms   p99 ms")
    for name, laps in watch.laps.items():
        p50, p99 = np.percentile(np.array(laps) * 1e3, [50, 99])
        lines.append(f"  {name:18s} {len(laps):6d} {p50:8.3f} {p99:8.3f}")
    ours50, ours99 = np.percentile(np.array(ours) * 1e3, [50, 99])
    theirs50, theirs99 = np.percentile(np.array(theirs) * 1e3, [50, 99])
    lines += [
        "  the same sweeps from the same predictions, alternating:",
        f"  our registration   {len(ours):6d} {ours50:8.3f} {ours99:8.3f}",
        f"  KISS-ICP to map    {len(theirs):6d} {theirs50:8.3f} {theirs99:8.3f}",
        f"  ratio                     {theirs50 / ours50:8.1f} {theirs99 / ours99:8.1f}",
    ]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
