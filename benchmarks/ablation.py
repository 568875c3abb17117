"""What each part of the localiser adds, and what is lost without it; parts by name: built without."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks._figures import Figure, measure, share
from benchmarks._lost import lost_trials
from benchmarks._peers import KISS_PEER
from benchmarks._recordings import Recording, map_of, record, world_of
from benchmarks._replaying import Laps, Run, Score, replay, score
from localization.evaluation.fault_injection import Clutter, Span, occluded, silent, slipping
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher
from localization.matching.registration import RegistrationConfig
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND, Reading

SECONDS = 40.0
SCENES = (("office", 11), ("building-701-400", 12))
"""With the seed of the drive; nothing was tuned in the second."""
SLIPS = (8.0, 16.0, 24.0, 32.0)
"""Under stress all wheels report twice their speed for a second at these times [s] ..."""
HIDDEN = Clutter(0.3)
"""... and 30 % of the beams are hidden."""
OUTAGES = (10.0, 20.0, 30.0)
"""Both scanners say nothing for 4 s from these times [s]."""

_BARE = RegistrationConfig(backface_culling=False, debias=0.0)
_ALONE = LocalizerConfig(matcher=Matcher.NONE, kiss_odometry=False, slip_min_inlier_ratio=2.0)
_PLANE = replace(_ALONE, matcher=Matcher.PLANE, registration=_BARE)
_ALL = LocalizerConfig()


def _wheels_alone() -> LocalizerConfig:
    suite = SensorConfiguration(Motion.WHEELS)
    return replace(_ALONE, sensors=suite, ekf=suite.ekf())


BUILT: dict[str, LocalizerConfig] = {
    "wheels": _wheels_alone(),
    "+ gyro": _ALONE,
    "+ KISS-ICP odometry": replace(_ALONE, kiss_odometry=True),
    "KISS-ICP to map, fixed cov.": replace(
        _ALONE, matcher=Matcher.KISS, kiss_odometry=True, kiss=KISS_PEER
    ),
    "plane MAP": replace(_PLANE, kiss_odometry=True),
    "+ facing gate": replace(
        _PLANE, kiss_odometry=True, registration=replace(_BARE, backface_culling=True)
    ),
    "+ debiasing": replace(_PLANE, kiss_odometry=True, registration=RegistrationConfig()),
    "+ blame rule: all": _ALL,
}
"""Each adds to the row above; KISS-ICP to the map stands for itself."""

_NO_GATE = RegistrationConfig(backface_culling=False)
_LONE = replace(_ALL, kiss_odometry=False)

WITHOUT: dict[str, LocalizerConfig] = {
    "all": _ALL,
    "without KISS-ICP odometry": _LONE,
    "without facing gate": replace(_ALL, registration=_NO_GATE),
    "without debiasing": replace(_ALL, registration=RegistrationConfig(debias=0.0)),
    "without blame rule": replace(_ALL, slip_min_inlier_ratio=2.0),
    "without KISS-ICP odometry and blame rule": replace(_LONE, slip_min_inlier_ratio=2.0),
    "without KISS-ICP odometry and facing gate": replace(_LONE, registration=_NO_GATE),
}
"""What KISS-ICP's odometry does, others do as well: some show only where it is missing."""


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """A drive and the map that belongs to it."""

    recording: Recording
    world: PreparedMap


def _as_it_is(readings: Iterable[Reading], seed: int) -> Iterable[Reading]:
    return readings


def _slips(readings: Iterable[Reading], seed: int) -> Iterable[Reading]:
    return slipping(readings, _spans(SLIPS, 1.0))


def _slips_in_a_crowd(readings: Iterable[Reading], seed: int) -> Iterable[Reading]:
    return _slips(occluded(readings, HIDDEN, seed=seed), seed)


def _outages(readings: Iterable[Reading], seed: int) -> Iterable[Reading]:
    for span in _spans(OUTAGES, 4.0):
        for scanner in ("laser_horizontal", "laser_vertical"):
            readings = silent(readings, scanner, span)
    return readings


def _spans(begins: Iterable[float], seconds: float) -> list[Span]:
    return [Span(round(t * SECOND), round((t + seconds) * SECOND)) for t in begins]


STRESSES: dict[str, Callable[[Iterable[Reading], int], Iterable[Reading]]] = {
    "nominal": _as_it_is,
    "slips": _slips,
    "slips, 30 % hidden": _slips_in_a_crowd,
    "scanners silent for 4 s": _outages,
}
CORRIDOR = "corridor"
"""Where nothing holds the robot along it; driven as it is."""
WRONG = "put wrong"
"""Robots whose pose was put wrong: the share that says so within 2 s."""
WRONG_TRIALS = 24


def drives(stresses: Sequence[str]) -> dict[str, list[Drive]]:
    """Record the drives, each once, and put the faults into them."""
    found: dict[str, list[Drive]] = {name: [] for name in stresses}
    for scene, seed in SCENES:
        recording = record(world_of(scene), name=scene, seed=seed, seconds=SECONDS)
        for name in stresses:
            readings = tuple(STRESSES[name](recording.readings, seed))
            found[name].append(Drive(recording.with_fault(name, readings), map_of(scene)))
    corridor = record(world_of(CORRIDOR), name=CORRIDOR, seed=41, seconds=SECONDS)
    return {**found, CORRIDOR: [Drive(corridor, map_of(CORRIDOR))]}


def run(drive: Drive, config: LocalizerConfig) -> Run:
    """Replay a drive to the localiser as configured."""
    laps = Laps()
    localizer = Localizer(drive.world, drive.recording.mounts, config, stage=laps.stage)
    return replay(drive.recording, localizer, laps)


def figures_of(case: str, method: str, runs: Sequence[Run]) -> Iterator[Figure]:
    """Yield a configuration's figures over some drives: the whole error, not its mean over drives."""
    scores: list[Score] = [score(r) for r in runs]
    n = np.array([s.sweeps for s in scores])
    total = int(n.sum())
    rmse = np.sqrt((n * np.array([s.rmse for s in scores]) ** 2).sum() / total)
    honest = (n * np.array([s.nees for s in scores])).sum() / total
    busy = sum(sum(map(sum, r.laps.of.values())) for r in runs) * 1e3
    sweeps = sum(len(r.moments) for r in runs)
    yield Figure(case, method, "ATE", float(rmse) * 100.0, "cm", total)
    yield Figure(case, method, "max", max(s.most for s in scores) * 100.0, "cm", total)
    yield Figure(case, method, "NEES", float(honest), "", total)
    yield Figure(case, method, "all stages", busy / sweeps, "ms", total)


def table(
    rows: dict[str, LocalizerConfig], stresses: Sequence[str], *, wrong: bool
) -> Iterator[Figure]:
    """Yield the figures of each configuration, in each kind of drive.

    Args:
        rows: configurations by name.
        stresses: of the drives.
        wrong: whether to put the pose wrong as well.
    """
    begun = drives(stresses)
    for name, config in rows.items():
        for case, some in begun.items():
            yield from figures_of(case, name, [run(d, config) for d in some])
        if wrong:
            scene, seed = SCENES[1]
            recording = record(world_of(scene), name=scene, seed=seed, seconds=60.0)
            trials = list(
                lost_trials(recording, map_of(scene), count=WRONG_TRIALS, seed=5, config=config)
            )
            bad = [t for t in trials if t.wrong]
            yield share(WRONG, name, "said within 2 s", sum(t.flagged for t in bad), len(bad))


PARTS: dict[str, Callable[[], Iterator[Figure]]] = {
    "built": lambda: table(BUILT, ("nominal", "slips, 30 % hidden"), wrong=False),
    "without": lambda: table(WITHOUT, tuple(STRESSES), wrong=True),
}


def main(parts: Sequence[str] = (), *, out: Path | None = None) -> None:
    """Measure: built up part by part, and all but one.

    Args:
        parts: by name; all if none is named.
        out: a sheet of figures, as for the localisation's.
    """
    measure({name: PARTS[name] for name in parts or PARTS}, out)
