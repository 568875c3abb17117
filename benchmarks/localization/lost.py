"""Estimates put wrong in every way there is: is it noticed, and how soon?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.common.figures import OURS, Figure, share
from benchmarks.replay.recordings import STANDS, Recording, map_of, record, world_of
from localization.evaluation.fault_injection import Span, end_of, silent, slipping, source_of
from localization.geometry import wrap_angle
from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.relocalization.relocalizer import Placement
from localization.types import SECOND, Estimate, Health, Hint, Pose, Reading, Scan

FAR, TURNED = 0.25, float(np.deg2rad(10.0))
"""A pose wrong by more [m, rad] is no pose to drive by."""
SOON = 2 * SECOND
"""It must be said within this time [ns]."""
SETTLE = 3 * SECOND // 2
"""A trial begins with so long at the true pose [ns] ..."""
WATCH = 3 * SECOND
"""... and goes on for so long after something went wrong [ns]."""
FLAGGED = (Health.WAITING, Health.SUSPECT, Health.LOST, Health.RELOCALISING)
"""States that say so."""
KINDS = ("carried off", "begun wrong", "in the dark")
"""What goes wrong: the robot is set down elsewhere, or is given a wrong pose and accepts it, or its wheels
slip while no scanner sees anything."""


SCENES = ("office", "building-701-400", "building-702-400")
EACH = 72
"""Trials in each."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What became of one estimate that was put wrong."""

    kind: str
    wrong: bool
    """Whether it ever was wrong; some right themselves before."""
    delay: float
    """Until that was said [s]; infinite if it was not, or only after the pose was right again."""
    off: float
    """Largest error [m]."""
    sure: float
    """How long it was said to be right while it was wrong, at a stretch [s]."""

    @property
    def flagged(self) -> bool:
        """Whether it was said in time, and not taken back for long while the pose was still wrong."""
        return max(self.delay, self.sure) <= SOON / SECOND


def lost() -> Iterator[Figure]:
    """Estimates put wrong: the share that was said to be wrong in time, by what went wrong."""
    trials: list[Trial] = []
    for seed, scene in enumerate(SCENES):
        recording = record(world_of(scene), name=scene, seed=71 + seed, seconds=60.0)
        trials += lost_trials(recording, map_of(scene), count=EACH, seed=5 + seed)
    wrong = [t for t in trials if t.wrong]
    for kind in KINDS:
        yield from _of_trials(f"estimate put wrong: {kind}", [t for t in wrong if t.kind == kind])
    yield from _of_trials("estimate put wrong: all", wrong, least=99.0)


def _of_trials(
    case: str, trials: Sequence[Trial], *, least: float | None = None
) -> Iterator[Figure]:
    n = len(trials)
    said = sum(t.flagged for t in trials)
    yield share(case, OURS, "said within 2 s", said, n, least=least)
    delays = [t.delay for t in trials if np.isfinite(t.delay)] or [float("nan")]
    yield Figure(case, OURS, "until said, p50", float(np.median(delays)), "s", n)
    yield Figure(case, OURS, "until said, most", float(np.max(delays)), "s", n)


def lost_trials(
    recording: Recording,
    world: PreparedMap,
    *,
    count: int,
    seed: int,
    config: LocalizerConfig = LocalizerConfig(),  # noqa: B008  (frozen)
) -> Iterator[Trial]:
    """Put the estimate wrong again and again, at places along a drive that are drawn by a seed.

    Each trial begins with a pose given to the localiser that is true.
    """
    rng = np.random.default_rng(seed)
    last = max(recording.truth) - SETTLE - WATCH
    for i in range(count):
        kind = KINDS[i % len(KINDS)]
        stream, localizer = Stream(recording), Localizer(world, recording.mounts, config)
        stream.jump(int(rng.integers(STANDS, last)))
        for _ in stream.feed(localizer, SECOND // 5):
            pass
        put(localizer, stream.truth)
        for _ in stream.feed(localizer, SETTLE):
            pass
        yield _watched(kind, _gone_wrong(kind, stream, localizer, rng, last))


def _gone_wrong(
    kind: str, stream: Stream, localizer: Localizer, rng: np.random.Generator, last: int
) -> Iterator[tuple[Estimate, Pose]]:
    if kind == "carried off":
        here = stream.truth
        while near(here, stream.truth):
            stream.jump(int(rng.integers(STANDS, last)))
        return stream.feed(localizer, WATCH)
    if kind == "begun wrong":
        turned = rng.uniform() < 0.5
        far = rng.uniform(0.0, 0.2) if turned else float(np.exp(rng.uniform(*np.log([0.3, 3.0]))))
        turn = rng.uniform(TURNED, np.pi) if turned else rng.uniform(0.0, 0.5)
        bearing = rng.uniform(-np.pi, np.pi)
        off = Pose.planar(far * np.cos(bearing), far * np.sin(bearing), turn * rng.choice([-1, 1]))
        put(localizer, stream.truth @ off)
        return stream.feed(localizer, WATCH)
    return stream.feed(localizer, 2 * WATCH + SECOND, dark=Span(0, WATCH + SECOND))


def near(here: Pose, there: Pose) -> bool:
    step = here.inverse() @ there
    return float(np.hypot(*step.position[:2])) < 2.0 * FAR and abs(step.yaw) < 2.0 * TURNED


def put(localizer: Localizer, pose: Pose) -> None:
    """Let the localiser believe a pose as if it had found it."""
    localizer._take(Placement(pose, "put there"))


def _watched(kind: str, told: Iterable[tuple[Estimate, Pose]]) -> Trial:
    since: int | None = None
    delay, most, sure, unsaid, before = np.inf, 0.0, 0, 0, 0
    for estimate, truth in told:
        off, turn = _off(estimate, truth)
        wrong = off > FAR or turn > TURNED
        most = max(most, off)
        flagged = estimate.health in FLAGGED
        unsaid = unsaid + estimate.stamp - before if wrong and before and not flagged else 0
        sure, before = max(sure, unsaid), estimate.stamp
        if not wrong:
            if since is not None and np.isinf(delay) and estimate.stamp - since <= SOON:
                # It came right in time: nobody was misled.
                since = None
            continue
        if since is None:
            since = estimate.stamp
        if flagged and np.isinf(delay):
            delay = (estimate.stamp - since) / SECOND
    return Trial(kind, since is not None, delay, most, sure / SECOND)


def _off(estimate: Estimate, truth: Pose) -> tuple[float, float]:
    if estimate.map_from_base is None:
        return np.inf, np.pi
    step = estimate.map_from_base.position - truth.position
    return float(np.linalg.norm(step)), abs(wrap_angle(estimate.map_from_base.yaw - truth.yaw))


class Stream:
    """A recording that is read from anywhere, in a time of its own that only goes on."""

    def __init__(self, recording: Recording) -> None:
        self._truth = recording.truth
        self._readings = tuple(r for r in recording.readings if not isinstance(r, Hint))
        self._ends = np.array([end_of(r) for r in self._readings])
        self._now, self._shift, self._next = SECOND, 0, 0

    @property
    def truth(self) -> Pose:
        """Where the robot is."""
        return self._truth[self._now - self._shift]

    def jump(self, stamp: int) -> None:
        """Go on from another time of the recording [ns], rounded to a tick."""
        stamp -= stamp % (SECOND // 50)
        self._shift = self._now - stamp
        self._next = int(np.searchsorted(self._ends, stamp, side="right"))

    def feed(
        self, localizer: Localizer, span: int, *, dark: Span | None = None
    ) -> Iterator[tuple[Estimate, Pose]]:
        """Feed some time of it [ns] and yield estimates with the truth.

        Args:
            localizer: takes the readings.
            span: how long.
            dark: since now, when scanners say nothing and wheels slip.
        """
        end, begin = self._now + span, self._now
        while self._now < end and self._next < len(self._readings):
            reading = self._readings[self._next]
            self._next += 1
            moved = replace(reading, stamp=reading.stamp + self._shift)
            heard: Sequence[Reading] = (moved,)
            if dark is not None:
                while_dark = Span(begin + dark.begin, begin + dark.end)
                heard = tuple(slipping(heard, (while_dark,)))
                if isinstance(moved, Scan):
                    heard = tuple(silent(heard, source_of(moved), while_dark))
            for one in heard:
                estimate = localizer.add(one)
                truth = self._truth.get(estimate.stamp - self._shift)
                if estimate.stamp > self._now and truth is not None:
                    self._now = estimate.stamp
                    yield estimate, truth
