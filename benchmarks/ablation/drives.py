"""The drives of the ablation: simulated scenes as they are and under stress, real logs, the mirror log.

Each drive takes a change of the settings and yields figures; it is recorded or loaded when it is first run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from benchmarks.ablation.mechanisms import Change
from benchmarks.ablation.mirror_log import MirrorDrive, mirror_drive, run_mirror
from benchmarks.common.figures import Figure
from benchmarks.localization.lost import lost_trials
from benchmarks.real.kidnaps import kidnap, pairs
from benchmarks.real.logs import Excerpt, RealDrive, real_drive
from benchmarks.real.scores import run_real
from benchmarks.replay.recordings import Recording, map_of, record, world_of
from benchmarks.replay.replaying import Laps, Run, replay, score
from localization.evaluation.fault_injection import Span, end_of, kidnapped, late, silent, slipping
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND, Health, Hint, Pose, Reading

Drive = Callable[[Change, str], Iterator[Figure]]
"""Runs a drive with changed settings, and yields its figures under a configuration's name."""

SECONDS = 40.0
"""Length of a drive through a scene under stress [s]."""
NOMINAL = 25.0
"""Length of a drive as it is [s]."""
LATE = 15.0
"""Length of the drive with late scans [s]."""
SCENES = (("office", 11, 21), ("courtyard", 31, None), ("corridor", 41, None))
"""With the seed of the drive, and under stress the seed by which the furniture was moved, if it was."""
SLIPS = (8.0, 16.0, 24.0, 32.0)
"""Under stress all wheels report twice their speed for a second at these times [s] ..."""
OUTAGES = (20.0,)
"""... both scanners are silent for 3 s from these times [s], and people walk about."""
LIFTED, SET_DOWN = 14.0, 26.0
"""The robot is carried from where it is at the first time of a drive to where it is at the second [s]."""
TILTED = np.deg2rad(2.0)
"""A mount is given wrong by this yaw [rad]."""
EXCERPTS = (
    Excerpt("intel", 1820.0, 1900.0),
    Excerpt("fr079", 150.0, 225.0),
    Excerpt("aces", 525.0, 630.0),
    Excerpt("fr101"),
    Excerpt("seattle"),
    Excerpt("csail"),
)
"""Stretches of real logs that hold what is hard about them: a logger that stalls, wheels that turn against
the motion, and a pause of 3 s in which the robot turns; and whole logs that no setting was chosen by."""
KIDNAPPED = ("fr079", "csail")
"""Logs on which robots are carried off ..."""
KIDNAPS = 8
"""... so many on each."""
PUT_WRONG = (("office", 71), ("building-701-400", 72))
"""Scenes, with the seeds of the drives, in which estimates are put wrong ..."""
TRIALS = 24
"""... so many in each."""
SAID = 2.0
"""A kidnap should be said within this time [s]."""
WRONG = 0.5
"""An estimate farther off than this is wrong [m]."""
_SCANNERS = ("laser_horizontal", "laser_vertical")
_DOUBT = (Health.SUSPECT, Health.LOST, Health.RELOCALISING, Health.WAITING)


@dataclass(frozen=True, slots=True)
class Simulated:
    """A drive through a scene."""

    case: str
    scene: str
    make: Callable[[], Recording]

    def __call__(self, change: Change, name: str) -> Iterator[Figure]:
        """Replay the drive and yield its figures."""
        recording, laps = _recorded(self.make), Laps()
        config = change(LocalizerConfig())
        localizer = Localizer(map_of(self.scene), recording.mounts, config, stage=laps.stage)
        run = replay(recording, localizer, laps)
        yield from _figures(self.case, name, run)


def _figures(case: str, name: str, run: Run) -> Iterator[Figure]:
    s, counted = score(run), run.counted()
    n = len(counted)
    off = np.array([np.linalg.norm((m.truth.position - m.estimate.position)[:2])
                    for m in counted if m.estimate is not None])  # fmt: skip
    doubt = np.mean([m.health in _DOUBT for m in counted]) if counted else np.nan
    busy = sum(sum(v) for v in run.laps.of.values()) * 1e3
    yield Figure(case, name, "position", s.rmse * 100.0, "cm", n)
    yield Figure(case, name, "heading", float(np.rad2deg(s.yaw)), "deg", n)
    yield Figure(case, name, "NEES", s.nees, "", n)
    yield Figure(case, name, "wrong", float((off > WRONG).mean()) * 100.0 if n else np.nan, "%", n)
    yield Figure(case, name, "doubt", float(doubt) * 100.0, "%", n)
    if case.startswith("mount"):
        warned = np.mean([any("mount" in r for r in m.reasons) for m in counted]) if n else np.nan
        yield Figure(case, name, "mount warned", float(warned) * 100.0, "%", n)
    yield Figure(case, name, COST, busy / max(len(run.moments), 1), "ms", n)


COST = "CPU per sweep"
"""The one quantity that differs from run to run."""


@cache
def _recorded(make: Callable[[], Recording]) -> Recording:
    return make()


@cache
def _plain(scene: str, seed: int) -> Recording:
    return record(world_of(scene), name=scene, seed=seed, seconds=SECONDS)


def _nominal(scene: str, seed: int) -> Recording:
    recording = _plain(scene, seed)
    return recording.with_fault(scene, tuple(_until(recording.readings, NOMINAL)))


def _until(readings: Iterable[Reading], seconds: float) -> Iterator[Reading]:
    return (r for r in readings if end_of(r) < seconds * SECOND)


def _stressed(scene: str, seed: int, rearranged: int | None) -> Recording:
    world = world_of(scene, rearranged=rearranged, alive=True, timing=seed)
    recording = record(world, name=scene, seed=seed, seconds=SECONDS)
    readings: Iterable[Reading] = slipping(recording.readings, _spans(SLIPS, 1.0))
    for span in _spans(OUTAGES, 3.0):
        for scanner in _SCANNERS:
            readings = silent(readings, scanner, span)
    return recording.with_fault("stressed", tuple(readings))


def _carried(scene: str, seed: int) -> Recording:
    recording, gap = _plain(scene, seed), SECOND // 50
    lifted, down = (round(t * SECOND) for t in (LIFTED, SET_DOWN))
    before = [r for r in recording.readings if end_of(r) <= lifted]
    after = [r for r in recording.readings if end_of(r) > down and not isinstance(r, Hint)]
    shift = max(end_of(r) for r in before) + gap - end_of(after[0])
    truth: dict[int, Pose] = {t: p for t, p in recording.truth.items() if t <= lifted}
    truth |= {t + shift: p for t, p in recording.truth.items() if t > down}
    readings = tuple(kidnapped(before, after, gap=gap))
    return replace(recording, name="carried off", readings=readings, truth=truth)


def _late(scene: str, seed: int) -> Recording:
    recording = _plain(scene, seed)
    readings: Iterable[Reading] = _until(recording.readings, LATE)
    for i, scanner in enumerate(_SCANNERS):
        readings = late(readings, scanner, SECOND // 4, jitter=SECOND // 10, seed=i)
    return recording.with_fault("late", tuple(readings))


def _misaligned(scene: str, seed: int) -> Recording:
    recording = _plain(scene, seed)
    frame = _SCANNERS[0]
    turned = recording.mounts[frame] @ Pose.planar(0.0, 0.0, TILTED)
    return replace(recording, mounts={**recording.mounts, frame: turned})


def _spans(begins: Iterable[float], seconds: float) -> list[Span]:
    return [Span(round(t * SECOND), round((t + seconds) * SECOND)) for t in begins]


@dataclass(frozen=True, slots=True)
class Real:
    """An excerpt of a real log."""

    folder: Path
    excerpt: Excerpt

    def __call__(self, change: Change, name: str) -> Iterator[Figure]:
        """Replay the excerpt and yield its figures."""
        drive, case = _loaded(self.folder, self.excerpt), self.excerpt.case
        s, _ = run_real(drive, change(LocalizerConfig.of(drive.log.sensors)))
        yield Figure(case, name, "wrong", s.wrong * 100.0, "%", s.n)
        yield Figure(case, name, "fails after", s.fails_after, "s", s.n)
        yield Figure(case, name, "mean", s.mean * 100.0, "cm", s.references)
        yield Figure(case, name, "p95", s.p95 * 100.0, "cm", s.references)
        yield Figure(case, name, "relations", s.relation * 100.0, "cm", s.relations)
        yield Figure(case, name, "trusted though wrong", s.trusted * 100.0, "%", s.n)
        yield Figure(case, name, "calm", s.calm * 100.0, "%", s.n)
        yield Figure(case, name, "NEES(3), p50", s.nees, "", s.references)


@dataclass(frozen=True, slots=True)
class Kidnaps:
    """Robots carried off on a real log."""

    folder: Path
    name: str

    def __call__(self, change: Change, name: str) -> Iterator[Figure]:
        """Carry them off and yield the figures."""
        drive = _loaded(self.folder, Excerpt(self.name))
        config = change(LocalizerConfig.of(drive.log.sensors))
        told = [kidnap(drive, config, *pair) for pair in pairs(drive, count=KIDNAPS, seed=5)]
        known, case, n = [k for k in told if not k.doubted], f"kidnaps, {self.name}", len(told)
        yield Figure(case, name, "ready", float(len(known)), "", n)
        yield Figure(case, name, "said", float(sum(k.alarm <= SAID for k in known)), "", n)
        yield Figure(
            case, name, "recovered", float(sum(np.isfinite(k.recovery) for k in known)), "", n
        )
        yield Figure(case, name, "misled", sum(k.misled for k in told), "s", n)
        yield Figure(case, name, "false alarms", float(sum(k.false_alarms for k in told)), "", n)


@dataclass(frozen=True, slots=True)
class PutWrong:
    """Estimates that are put wrong in a scene."""

    scene: str
    seed: int

    def __call__(self, change: Change, name: str) -> Iterator[Figure]:
        """Put them wrong and yield the figures."""
        drive, case = _plain(self.scene, self.seed), f"put wrong, {self.scene}"
        config = change(LocalizerConfig())
        told = list(lost_trials(drive, map_of(self.scene), count=TRIALS, seed=5, config=config))
        wrong = [t for t in told if t.wrong]
        yield Figure(case, name, "ever wrong", float(len(wrong)), "", TRIALS)
        yield Figure(case, name, "said", float(sum(t.flagged for t in wrong)), "", TRIALS)
        yield Figure(
            case,
            name,
            "trusted though wrong",
            max((t.sure for t in wrong), default=0.0),
            "s",
            TRIALS,
        )


@cache
def _loaded(folder: Path, excerpt: Excerpt) -> RealDrive:
    return real_drive(folder, excerpt)


@dataclass(frozen=True, slots=True)
class Mirror:
    """The log of a pose that was replaced by its mirror image."""

    folder: Path

    def __call__(self, change: Change, name: str) -> Iterator[Figure]:
        """Replay the log and yield its figures."""
        s = run_mirror(_opened(self.folder), change)
        yield Figure("mirror", name, "jumps", float(s.jumps), "", s.n)
        yield Figure("mirror", name, "first jump", s.first, "s", s.n)
        yield Figure("mirror", name, "farthest step", s.farthest, "m", s.n)
        yield Figure("mirror", name, "doubt", s.doubt * 100.0, "%", s.n)


@cache
def _opened(folder: Path) -> MirrorDrive:
    return mirror_drive(folder)


def drives(real: Path | None = None, mirror: Path | None = None) -> dict[str, Drive]:
    """Return the drives by case.

    Args:
        real: folder of the real logs; left out if None.
        mirror: folder of the mirror log; left out if None.
    """
    found: dict[str, Drive] = {}
    for place, drive in PUT_WRONG:
        found[f"put wrong, {place}"] = PutWrong(place, drive)
    for scene, seed, rearranged in SCENES:
        found[scene] = Simulated(scene, scene, partial(_nominal, scene, seed))
        case = f"{scene}, stressed"
        found[case] = Simulated(case, scene, partial(_stressed, scene, seed, rearranged))
    scene, seed, _ = SCENES[0]
    for what, make in (
        ("carried off", _carried),
        ("late scans", _late),
        ("mount 2 deg off", _misaligned),
    ):
        case = f"{what}, {scene}"
        found[case] = Simulated(case, scene, partial(make, scene, seed))
    if real is not None:
        found |= {e.case: Real(real, e) for e in EXCERPTS}
        found |= {f"kidnaps, {log}": Kidnaps(real, log) for log in KIDNAPPED}
    if mirror is not None:
        found["mirror"] = Mirror(mirror)
    return found
