"""Recovery of a carried robot, beside a search begun at the same place: time, way, and the cost of a reading."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from benchmarks.common.figures import OURS, Figure
from benchmarks.replay.recordings import Recording, map_of, record, world_of
from localization.evaluation.fault_injection import end_of, kidnapped
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health, Hint, Inertial, Pose, Reading

SCENES = ("office", "warehouse")
PLACES = 24
"""Number of places in each scene where the robot is set down."""
SECONDS = 150.0
"""Length of the drive from which they are drawn [s]."""
BEFORE, AFTER = 6 * SECOND, 40 * SECOND
"""Time that is driven before the robot is lifted, and at most after it was set down [ns]."""
FARTHER = 4.0
"""Distance over which it is carried at least [m]."""
WITHIN = 0.1
"""The pose is right within this distance [m] ..."""
HELD = 2 * SECOND
"""... and has to be, and to be trusted, for this time [ns]."""
MOST_RATIO = 1.5
"""Recovery takes at most this many times what a fresh search takes."""
MOST_MS = 100.0
"""Processor time of a reading at most [ms]."""
_TRUSTED = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)


@dataclass(slots=True)
class Cost:
    """Processor time of readings and of their shares of a search [ms]."""

    readings: list[float] = field(default_factory=list)
    searches: list[float] = field(default_factory=list)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        begun = time.thread_time()
        yield
        if name == "search":
            self.searches.append(1e3 * (time.thread_time() - begun))


def recovery() -> Iterator[Figure]:
    """Carry a robot to several places, and switch it on there without a pose."""
    for seed, scene in enumerate(SCENES, start=11):
        drive = record(world_of(scene), name=scene, seed=seed, seconds=SECONDS)
        # Neither drive nor map is garbage of a localiser: to search them for it takes 0.1 s.
        map_of(scene)
        gc.collect()
        gc.freeze()
        cost = Cost()
        fresh, carried = zip(*_trials(drive, cost, seed), strict=True)
        case = f"recovery, {scene}"
        medians = [np.median(np.array(found), axis=0) for found in (fresh, carried)]
        for name, median in zip(("search", "carried"), medians, strict=True):
            yield Figure(case, OURS, f"{name}, median time", float(median[0]), "s", PLACES)
            yield Figure(case, OURS, f"{name}, median way", float(median[1]), "m", PLACES)
        ratio = float((medians[1] / medians[0]).max())
        yield Figure(case, OURS, "carried to search", ratio, "", PLACES, most=MOST_RATIO)
        never = int(np.isinf([time for time, _ in carried]).sum())
        yield Figure(case, OURS, "never recovered", float(never), "", PLACES, most=0.0)
        shares = np.array(cost.searches)
        for q in (50, 99, 100):
            of = float(np.percentile(shares, q))
            yield Figure(case, OURS, f"share of a search, p{q}", of, "ms", len(shares))
        longest = max(cost.readings)
        n = len(cost.readings)
        yield Figure(case, OURS, "longest reading", longest, "ms", n, most=MOST_MS)


def _trials(
    drive: Recording, cost: Cost, seed: int
) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Yield time [s] and way [m] of a fresh search and of a recovery at each place."""
    rng = np.random.default_rng(seed)
    readings = [r for r in drive.readings if not isinstance(r, Hint)]
    last = end_of(readings[-1])
    done = 0
    while done < PLACES:
        lifted = int(rng.integers(BEFORE + 3 * SECOND, last)) // 20_000_000 * 20_000_000
        down = int(rng.integers(3 * SECOND, last - AFTER)) // 20_000_000 * 20_000_000
        if np.hypot(*(drive.truth[lifted].position - drive.truth[down].position)[:2]) < FARTHER:
            continue
        done += 1
        before = [r for r in readings if lifted - BEFORE < end_of(r) <= lifted]
        after = [r for r in readings if down < end_of(r) < down + AFTER]
        hinted = lifted - BEFORE + SECOND
        hint = Hint(hinted, drive.truth[hinted], np.zeros((6, 6)))
        at = next(i for i, r in enumerate(before) if end_of(r) > hinted)
        spliced = tuple(kidnapped([*before[:at], hint, *before[at:]], after))
        moved = max(map(end_of, before))
        shift = moved + SECOND // 50 - end_of(after[0])
        yield (
            _settled(drive, after, down, 0, cost, search=True),
            _settled(drive, spliced, moved, shift, cost, search=False),
        )


def _settled(
    drive: Recording,
    readings: Sequence[Reading],
    begin: int,
    shift: int,
    cost: Cost,
    *,
    search: bool,
) -> tuple[float, float]:
    """Return the time [s] and way [m] after which the pose is right and trusted; inf if it never is.

    Args:
        drive: with the truth.
        readings: to be localised.
        begin: from this stamp on the robot has to find itself [ns].
        shift: of the stamps against those of the truth from then on [ns].
        cost: takes the processor times.
        search: whether to request a search at the beginning.
    """
    localizer = Localizer(map_of(drive.name), drive.mounts, stage=cost.stage)
    if search:
        localizer.relocalize()
    way, since, doubted = 0.0, None, False
    last: Pose | None = None
    for reading in readings:
        begun = time.thread_time()
        estimate = localizer.add(reading)
        cost.readings.append(1e3 * (time.thread_time() - begun))
        truth = drive.truth.get(estimate.stamp - shift)
        if not isinstance(reading, Inertial) or estimate.stamp <= begin or truth is None:
            continue
        way += 0.0 if last is None else float(np.hypot(*(truth.position - last.position)[:2]))
        last, trusted = truth, estimate.health in _TRUSTED
        doubted |= not trusted
        found = estimate.map_from_base
        off = np.inf if found is None else np.hypot(*(truth.position - found.position)[:2])
        if not (doubted and trusted and off < WITHIN):
            since = None
            continue
        since = since or (estimate.stamp, (estimate.stamp - begin) / SECOND, way)
        if estimate.stamp - since[0] >= HELD:
            return since[1:]
    return np.inf, np.inf
