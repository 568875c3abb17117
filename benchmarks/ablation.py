"""What each part of the localiser adds, and what is lost without it; parts by name: built without."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks._peers import KISS_PEER
from benchmarks._recordings import Recording, map_of, record, world_of
from benchmarks._replaying import Laps, Run, Score, replay, score
from localization.faults import Clutter, Span, occluded, slipping
from localization.localizer import Localizer, LocalizerConfig
from localization.matching import Matcher
from localization.prepared import PreparedMap
from localization.registration import RegistrationConfig
from localization.suites import Motion, Suite
from localization.types import SECOND

SECONDS = 40.0
SCENES = (("office", 11), ("building-701-400", 12))
"""With the seed of the drive; nothing was tuned in the second."""
SLIPS = (8.0, 16.0, 24.0, 32.0)
"""Under stress all wheels report twice their speed for a second at these times [s] ..."""
HIDDEN = Clutter(0.3)
"""... and 30 % of the beams are hidden."""

_BARE = RegistrationConfig(facing=False, debias=0.0)
_ALONE = LocalizerConfig(
    matcher=Matcher.NONE, kiss_odometry=False, second_opinion=False, blame_fit=2.0
)
_PLANE = replace(_ALONE, matcher=Matcher.PLANE, registration=_BARE)
_ALL = LocalizerConfig()


def _wheels_alone() -> LocalizerConfig:
    suite = Suite(Motion.WHEELS)
    return replace(_ALONE, suite=suite, ekf=suite.ekf())


BUILT: dict[str, LocalizerConfig] = {
    "wheels": _wheels_alone(),
    "+ gyro": _ALONE,
    "+ KISS-ICP odometry": replace(_ALONE, kiss_odometry=True),
    "KISS-ICP to map, fixed cov.": replace(
        _ALONE, matcher=Matcher.KISS, kiss_odometry=True, kiss=KISS_PEER
    ),
    "plane MAP": replace(_PLANE, kiss_odometry=True),
    "+ facing gate": replace(_PLANE, kiss_odometry=True, registration=replace(_BARE, facing=True)),
    "+ debiasing": replace(_PLANE, kiss_odometry=True, registration=RegistrationConfig()),
    "+ blame rule": replace(_ALL, second_opinion=False),
    "+ second opinion: all": _ALL,
}
"""Each adds to the row above; KISS-ICP to the map stands for itself."""

WITHOUT: dict[str, LocalizerConfig] = {
    "all": _ALL,
    "without KISS-ICP odometry": replace(_ALL, kiss_odometry=False),
    "without facing gate": replace(_ALL, registration=RegistrationConfig(facing=False)),
    "without debiasing": replace(_ALL, registration=RegistrationConfig(debias=0.0)),
    "without blame rule": replace(_ALL, blame_fit=2.0),
    "without second opinion": replace(_ALL, second_opinion=False),
}


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """A drive and the map that belongs to it."""

    recording: Recording
    world: PreparedMap


def drives(*, stressed: bool) -> Iterator[Drive]:
    """Record the drives, with faults in them or without."""
    spans = [Span(round(t * SECOND), round((t + 1.0) * SECOND)) for t in SLIPS]
    for scene, seed in SCENES:
        recording = record(world_of(scene), name=scene, seed=seed, seconds=SECONDS)
        if stressed:
            faulty = slipping(occluded(recording.readings, HIDDEN, seed=seed), spans)
            recording = recording.with_fault(scene, tuple(faulty))
        yield Drive(recording, map_of(scene))


def run(drive: Drive, config: LocalizerConfig) -> Run:
    """Replay a drive to the localiser as configured."""
    laps = Laps()
    localizer = Localizer(drive.world, drive.recording.mounts, config, stage=laps.stage)
    return replay(drive.recording, localizer, laps)


def cells(runs: Sequence[Run]) -> str:
    """Return a row's figures over some drives: the whole error, not its mean over drives."""
    scores: list[Score] = [score(r) for r in runs]
    n = np.array([s.sweeps for s in scores])
    rmse = np.sqrt((n * np.array([s.rmse for s in scores]) ** 2).sum() / n.sum())
    yaw = np.sqrt((n * np.array([s.yaw for s in scores]) ** 2).sum() / n.sum())
    honest = (n * np.array([s.nees for s in scores])).sum() / n.sum()
    inside = (n * np.array([s.inside for s in scores])).sum() / n.sum()
    most = max(s.most for s in scores)
    busy = sum(sum(map(sum, r.laps.of.values())) for r in runs) * 1e3
    sweeps = sum(len(r.moments) for r in runs)
    return (
        f"{rmse * 100:8.2f} {most * 100:7.1f} {np.rad2deg(yaw):7.3f} {honest:9.1f} {inside:5.0%}"
        f" {busy / sweeps:6.2f}"
    )


def table(rows: dict[str, LocalizerConfig]) -> None:
    """Print a row for each configuration: nominal, then under stress."""
    begun = [list(drives(stressed=False)), list(drives(stressed=True))]
    head = f"{'ATE cm':>8s} {'max':>7s} {'yaw deg':>7s} {'NEES':>9s} {'in95':>5s} {'ms':>6s}"
    print(f"  {'':28s} nominal: {head}   slips and 30 % hidden: {head}", flush=True)
    for name, config in rows.items():
        found = ["".join(cells([run(d, config) for d in some])) for some in begun]
        print(f"  {name:28s}          {found[0]}                          {found[1]}", flush=True)


PARTS: dict[str, Callable[[], None]] = {
    "built": lambda: table(BUILT),
    "without": lambda: table(WITHOUT),
}


def main(parts: Sequence[str] = ()) -> None:
    """Print the tables: built up part by part, and all but one."""
    print(
        f"  {', '.join(s for s, _ in SCENES)}: {SECONDS:.0f} s each; ms is CPU time of all stages per sweep"
    )
    for name in parts or PARTS:
        PARTS[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
