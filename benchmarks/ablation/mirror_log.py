"""A log in which a correct pose was replaced by its mirror image about a table: does it still happen?

The log and its map are not part of this repository; their folder is an argument.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.ablation.mechanisms import Change
from localization.logs.log_interface import ReadingsLog
from localization.logs.open_log import open_log
from localization.maps.map_files import load_map
from localization.maps.prepared_map import PreparedMap, default_cache, prepare
from localization.pipeline.localizer import Localizer
from localization.pipeline.log_replay import config_of
from localization.types import SECOND, Health, Pose

SECONDS = 125.0
"""The log is replayed up to this time [s]; the mirrored pose was taken at 117.7 s."""
_JUMP = 1.0
"""An estimate that moves farther than this against its odometry, at once, has jumped [m]."""
_SETTLING = 2 * SECOND
"""Jumps count from this time after the first placement [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class MirrorDrive:
    """The log and its map."""

    log: ReadingsLog
    world: PreparedMap


@dataclass(frozen=True, slots=True)
class MirrorScore:
    """How a replay went.

    Attributes:
        n: estimates.
        jumps: number of jumps.
        first: time of the first one [s]; NaN if there is none.
        farthest: largest step against odometry [m].
        doubt: share of the estimates before the first jump that are suspect or lost.
    """

    n: int
    jumps: int
    first: float
    farthest: float
    doubt: float


def mirror_drive(folder: Path) -> MirrorDrive:
    """Open ``readings.mcap`` and ``cloud.ply`` of a folder."""
    cache = default_cache()
    world = prepare(load_map(folder / "cloud.ply", cache=cache), cache=cache)
    return MirrorDrive(open_log(folder / "readings.mcap"), world)


def run_mirror(drive: MirrorDrive, change: Change) -> MirrorScore:
    """Replay the log as it was recorded, but for a change of the settings."""
    localizer = Localizer(drive.world, drive.log.mounts, change(config_of(drive.log)))
    correction: Pose | None = None
    placed, stamp, n, doubts = 0, 0, 0, 0
    jumps: list[tuple[float, float]] = []
    farthest = 0.0
    for reading in drive.log:
        estimate = localizer.add(reading)
        if estimate.stamp > SECONDS * SECOND:
            break
        if estimate.map_from_base is None or estimate.stamp <= stamp:
            continue
        stamp = estimate.stamp
        placed = placed or stamp
        if correction is not None and stamp > placed + _SETTLING:
            there = correction @ estimate.odom_from_base
            step = float(np.hypot(*(estimate.map_from_base.position - there.position)[:2]))
            farthest = max(farthest, step)
            if step > _JUMP:
                jumps.append((stamp / SECOND, step))
            if not jumps:
                n += 1
                doubts += estimate.health in (Health.SUSPECT, Health.LOST, Health.RELOCALISING)
        correction = estimate.map_from_base @ estimate.odom_from_base.inverse()
    first = jumps[0][0] if jumps else float("nan")
    return MirrorScore(n, len(jumps), first, farthest, doubts / max(n, 1))
