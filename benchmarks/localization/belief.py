"""Weights of the belief that the pose is right: fitted to half of the drives, judged on the other half, both ways.

Robots are carried off again and again among people, moved furniture and hidden beams, and on real logs if
``--real`` names their folder. Each sweep says whether the pose that it was compared with was right.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from benchmarks.common.figures import OURS, Figure, say, share
from benchmarks.common.sheet import measure
from benchmarks.localization.lost import Stream, near, put
from benchmarks.real.kidnaps import pairs
from benchmarks.real.logs import Excerpt, real_drive
from benchmarks.real.trials import Scans, place_at
from benchmarks.replay.recordings import STANDS, Recording, map_of, record, world_of
from localization.config import LocalizerConfig
from localization.evaluation.fault_injection import Clutter, kidnapped, occluded
from localization.geometry import FloatArray, wrap_angle
from localization.monitoring.belief import BeliefConfig, agreement, break_in_view
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, BoolArray, Estimate, Hint, Pose, Reading, Scan

BEFORE, AFTER = 4 * SECOND, 5 * SECOND
"""A robot drives so long before it is carried off, and after [ns]."""
BEFORE_REAL, AFTER_REAL = 10.0, 12.0
"""The same on real logs, whose scans are up to two seconds apart [s]."""
EACH = 40
"""Robots carried off in each of the drives, and on each of the logs."""
RIDGE = 1e-5
"""Weight of the squared weights, which keeps those finite that nothing limits."""
LOGS = ("aces", "csail", "fr079", "fr101", "seattle")
RIGHT, WRONG = (0.25, float(np.deg2rad(10.0))), (0.5, float(np.deg2rad(20.0)))
"""A pose is right within the first, and wrong beyond the second [m, rad]; between them it is neither."""
HINT = np.diag(np.square([0.1, 0.1, 0.01, 0.01, 0.01, 0.05]))
"""Covariance of the hint at the beginning of a stretch of a log [m^2, rad^2]."""


@dataclass(frozen=True, slots=True)
class Drives:
    """Robots that are carried off in one place."""

    scene: str
    seed: int
    alive: bool = False
    rearranged: bool = False
    hidden: float = 0.0
    """Share of the beams that something near hides."""

    def recording(self) -> Recording:
        """Drive there."""
        moved = self.seed if self.rearranged else None
        world = world_of(self.scene, alive=self.alive, timing=self.seed, rearranged=moved)
        drive = record(world, name=self.scene, seed=self.seed, seconds=120.0)
        if not self.hidden:
            return drive
        readings = occluded(drive.readings, Clutter(self.hidden), seed=self.seed)
        return drive.with_fault("hidden", tuple(readings))


SIMULATED = (
    Drives("office", 2101, alive=True),
    Drives("warehouse", 2102, alive=True),
    Drives("building-701-400", 2103),
    Drives("courtyard", 2105, alive=True),
    Drives("office", 5, rearranged=True),
    Drives("building-702-400", 6, rearranged=True),
    Drives("office", 2301, hidden=0.3),
    Drives("warehouse", 2302, hidden=0.55),
)


@dataclass(frozen=True, slots=True)
class Sample:
    """What one sweep says."""

    right: bool
    """Whether the pose was right; else it was wrong."""
    agreement: tuple[float, float]
    """As ``agreement`` has it."""
    change: tuple[float] | None
    """As ``break_in_view`` has it, of a robot that was just carried off, or surely was not."""
    run: int
    """Number of the robot."""


def _samples(
    localizer: Localizer, estimates: Iterable[tuple[Estimate, Pose]], *, carried: bool, run: int
) -> Iterator[Sample]:
    """Yield what the sweeps say; with each estimate comes the true pose.

    Args:
        localizer: that makes the estimates.
        estimates: with the true poses.
        carried: whether the robot was carried off before the first of them.
        run: number of the robot.
    """
    displaced, fresh = localizer.config.sensors.displaced, carried
    before = localizer._state  # what a sweep is compared with is no output
    for estimate, truth in estimates:
        jump, health = before.jump, before.health
        before = localizer._state
        pose = estimate.map_from_base
        if estimate.sweep is None or estimate.consistency is None or pose is None:
            continue
        off = float(np.hypot(*(pose.position - truth.position)[:2]))
        turned = abs(wrap_angle(pose.yaw - truth.yaw))
        right = off <= RIGHT[0] and turned <= RIGHT[1]
        if right == carried or not (right or off > WRONG[0] or turned > WRONG[1]):
            continue
        at = pose if displaced else estimate.odom_from_base
        match, within = estimate.match, localizer.config.registration.inlier_distance
        mapped = None if match is None else match.mapped(within)
        _, change = jump.compared(estimate.sweep, at, mapped)
        known = change is not None and fresh == carried
        broken = (
            (break_in_view(change.unexpected, estimate.consistency, health.consistency),)
            if change is not None and known
            else None
        )
        fresh = False
        yield Sample(right, agreement(estimate.consistency), broken, run)


def simulated(drives: Drives) -> Iterator[Sample]:
    """Carry robots off in a simulated place and yield what their sweeps say."""
    recording, world = drives.recording(), map_of(drives.scene)
    rng = np.random.default_rng(drives.seed)
    last = max(recording.truth) - BEFORE - AFTER
    for run in range(EACH):
        stream, localizer = Stream(recording), Localizer(world, recording.mounts)
        stream.jump(int(rng.integers(STANDS, last)))
        for _ in stream.feed(localizer, SECOND // 5):
            pass
        put(localizer, stream.truth)
        yield from _samples(localizer, stream.feed(localizer, BEFORE), carried=False, run=run)
        here = stream.truth
        while near(here, stream.truth):
            stream.jump(int(rng.integers(STANDS, last)))
        yield from _samples(localizer, stream.feed(localizer, AFTER), carried=True, run=run)


def real_log(folder: Path, name: str, seed: int) -> Iterator[Sample]:
    """Carry robots off on a real log and yield what their scans say."""
    drive = real_drive(folder, Excerpt(name))
    config, scans = LocalizerConfig.of(drive.log.sensors), Scans.of(drive)
    for run, (start, goal) in enumerate(pairs(drive, count=EACH, seed=seed)):
        lifted = scans.until(start, BEFORE_REAL)
        end = scans.until(goal, AFTER_REAL)
        numbers = [*range(start, lifted), *range(goal, end)]
        readings = list(kidnapped(scans.between(start, lifted), scans.between(goal, end)))
        localizer = Localizer(drive.world, drive.log.mounts, config)
        localizer.add(Hint(readings[0].stamp, place_at(drive, start), HINT))
        places = [i for i, r in enumerate(readings) if isinstance(r, Scan)]
        parts = (slice(0, places[lifted - start])), slice(places[lifted - start], None)
        truth = {
            readings[i].stamp: place_at(drive, n) for i, n in zip(places, numbers, strict=False)
        }
        for part, carried in zip(parts, (False, True), strict=True):
            estimates = _corrected(localizer, readings[part], truth)
            yield from _samples(localizer, estimates, carried=carried, run=run)


def _corrected(
    localizer: Localizer, readings: Sequence[Reading], truth: Mapping[int, Pose]
) -> Iterator[tuple[Estimate, Pose]]:
    """Feed readings and yield the estimates that a scan corrected, with the true pose at its stamp."""
    newest: Pose | None = None
    for reading in readings:
        newest = truth.get(reading.stamp, newest) if isinstance(reading, Scan) else newest
        estimate = localizer.add(reading)
        if estimate.sweep is not None and newest is not None:
            yield estimate, newest


def weights(values: FloatArray, right: BoolArray, counts: FloatArray) -> FloatArray:
    """Return the weights (1 + F,) of a logistic regression, of a constant and of features.

    Args:
        values: (N, F) features.
        right: (N,) whether the pose was right.
        counts: (N,) how much each sample counts.
    """
    features = np.column_stack([np.ones(len(values)), values])
    sign = np.where(right, 1.0, -1.0)

    def loss(w: FloatArray) -> tuple[float, FloatArray]:
        z = sign * (features @ w)
        pull = counts * sign / (1.0 + np.exp(np.minimum(z, 500.0)))
        value = float(counts @ np.logaddexp(0.0, -z) + RIDGE * w @ w)
        return value, -(features.T @ pull) + 2.0 * RIDGE * w

    return np.asarray(minimize(loss, np.zeros(features.shape[1]), jac=True).x)


def _counts(right: BoolArray, robots: Sequence[int]) -> FloatArray:
    """Return how much each sample counts: each robot alike, and right and wrong alike."""
    counts = np.zeros(len(right))
    for kind in (right, ~right):
        _, of, many = np.unique(np.array(robots)[kind], return_inverse=True, return_counts=True)
        counts[kind] = 1.0 / many[of] / max(1, len(many))
    return counts


@dataclass(frozen=True, slots=True, eq=False)
class Data:
    """Samples of one kind."""

    values: FloatArray
    """(N, F) features."""
    right: BoolArray
    """(N,) whether the pose was right, or the robot was not carried."""
    counts: FloatArray
    """(N,) how much each counts."""

    @classmethod
    def of(cls, samples: Sequence[tuple[str, Sample]], kind: str) -> Data:
        """Return the samples of sweeps, or of changes."""
        kept = [(f"{place}{s.run}", s) for place, s in samples if getattr(s, kind) is not None]
        right = np.array([s.right for _, s in kept])
        robots = np.unique([name for name, _ in kept], return_inverse=True)[1]
        values = np.array([getattr(s, kind) for _, s in kept])
        return cls(values, right, _counts(right, robots.tolist()))


KINDS = {"agreement": "sweeps", "change": "changes between sweeps"}
SIGNS = {"agreement": (-1.0, -1.0, -1.0), "change": (1.0, -1.0)}
"""Signs of the settings' weights in the sums."""
NAMES = {
    "agreement": ("at all", "log of the share unexplained", "log of the share passing through"),
    "change": ("at all", "share unexpected"),
}


def fitted(samples: Mapping[str, Sequence[Sample]]) -> Iterator[Figure]:
    """Yield the weights of each half of the places, how often they are wrong on the other half, and those that ship."""
    places = sorted(samples)
    halves = (places[::2], places[1::2])
    shipped = {"agreement": BeliefConfig().sweep, "change": BeliefConfig().change}
    for kind, what in KINDS.items():
        of = [Data.of([(p, s) for p in half for s in samples[p]], kind) for half in halves]
        sign = np.array(SIGNS[kind])
        for i, name in enumerate(("one half", "the other half")):
            mine, others = of[i], of[1 - i]
            found = weights(mine.values, mine.right, mine.counts)
            yield from _judged(f"{what}, weights of {name}", kind, found, others)
            yield from _judged(f"{what}, shipped, on {name}", kind, sign * shipped[kind], mine)


def _judged(case: str, kind: str, found: FloatArray, on: Data) -> Iterator[Figure]:
    for name, weight in zip(NAMES[kind], found * SIGNS[kind], strict=True):
        yield Figure(case, OURS, name, float(weight), "nats")
    evidence = found[0] + on.values @ found[1:]
    for name, of, wrongly in (
        ("for a right pose", on.right, evidence < 0.0),
        ("for a wrong pose", ~on.right, evidence > 0.0),
    ):
        yield share(
            case, OURS, f"evidence the wrong way, {name}", int(wrongly[of].sum()), int(of.sum())
        )


def _place(drives: Drives) -> str:
    marks = ("people",) * drives.alive + ("moved",) * drives.rearranged
    marks += (f"{drives.hidden:.0%} hidden",) * (drives.hidden > 0.0)
    return " ".join((drives.scene, f"{drives.seed}", *marks))


def main(parts: Sequence[str] = (), *, out: Path | None = None, real: Path | None = None) -> None:
    """Fit the weights and print them.

    Args:
        parts: only ``weights``.
        out: a sheet of figures.
        real: folder of real logs, to which half of the drives belong too.
    """
    measure({"weights": partial(_measured, real)}, out, whole=True)


def _measured(folder: Path | None) -> Iterator[Figure]:
    samples: dict[str, list[Sample]] = {}
    for drives in SIMULATED:
        samples[_place(drives)] = list(simulated(drives))
        say(f"    {_place(drives)}: {len(samples[_place(drives)])} sweeps")
    for seed, name in enumerate(LOGS if folder is not None else ()):
        assert folder is not None
        samples[f"log {name}"] = list(real_log(folder, name, seed))
        say(f"    log {name}: {len(samples[f'log {name}'])} scans")
    yield from fitted(samples)


PARTS = ("weights",)
