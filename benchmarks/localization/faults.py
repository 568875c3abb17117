"""Faults recorded once and replayed to every method: silence, lateness, and being carried away.

KISS-ICP to the map and small_gicp run in our filter, which takes late readings as it takes them from us.
The Monte-Carlo localiser gets sweeps when they arrive, with the odometry of their own time; it has no way
back from being carried away, and is left out there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.common.figures import OURS, Figure, share
from benchmarks.localization.alarms import FLAGGED as LOST, WRONG
from benchmarks.localization.drives import (
    BUILDINGS,
    PEERS,
    Case,
    Method,
    compare,
    ours,
    particles,
)
from benchmarks.localization.searching import right
from benchmarks.replay.recordings import Recording, map_of, record, world_of
from benchmarks.replay.replaying import Run
from localization.evaluation.fault_injection import (
    INERTIAL,
    WHEELS,
    Span,
    end_of,
    kidnapped,
    late,
    silent,
)
from localization.geometry import wrap_angle
from localization.types import SECOND, Health, Hint, Pose, Reading

SCENES = ("office", BUILDINGS[0])
OUTAGES = (10.0, 30.0, 50.0)
"""When sources fall silent [s]."""
SCANNERS = ("laser_horizontal", "laser_vertical")


@dataclass(frozen=True, slots=True)
class Silence:
    """Who says nothing, and for how long."""

    name: str
    sources: tuple[str, ...]
    seconds: float
    most: float | None = None
    """How far off the estimate may get meanwhile [cm]."""
    peers: bool = False
    """Whether it is replayed to the peers too."""


SILENCES = (
    Silence("both scanners silent for 10 s", SCANNERS, 10.0, most=15.0, peers=True),
    Silence("both scanners silent for 2 s", SCANNERS, 2.0, most=15.0),
    Silence("horizontal scanner silent for 10 s", SCANNERS[:1], 10.0, most=15.0),
    Silence("vertical scanner silent for 10 s", SCANNERS[1:], 10.0, most=15.0),
    Silence("wheels silent for 10 s", (WHEELS,), 10.0, peers=True),
    Silence("gyro silent for 2 s", (INERTIAL,), 2.0, peers=True),
)


def dropouts() -> Iterator[Figure]:
    """Sources that fall silent three times on each of two drives."""
    drives = [
        (scene, record(world_of(scene), name=scene, seed=seed, seconds=64.0))
        for seed, scene in enumerate(SCENES, start=71)
    ]
    for silence in SILENCES:
        worst: dict[str, list[float]] = {}
        for scene, recording in drives:
            world, (faulty, spans) = map_of(scene), silenced(recording, silence)
            mine = ours(faulty, world)
            runs = {OURS: mine}
            if silence.peers:
                runs |= {name: peer(faulty, world) for name, peer in PEERS.items()}
                runs["Monte Carlo"] = particles(mine, world)
            for name, run in runs.items():
                worst.setdefault(name, []).extend(farthest(run, faulty, spans))
        for name, far in worst.items():
            most = silence.most if name == OURS else None
            n, p50 = len(far), float(np.median(far)) * 100.0
            yield Figure(silence.name, name, "farthest off, p50", p50, "cm", n)
            most_far = max(far) * 100.0
            yield Figure(silence.name, name, "farthest off", most_far, "cm", n, most=most)


def silenced(recording: Recording, silence: Silence) -> tuple[Recording, list[Span]]:
    """Return a drive without what falls silent, and when it does."""
    spans = [Span(round(t * SECOND), round((t + silence.seconds) * SECOND)) for t in OUTAGES]
    readings = recording.readings
    for source in silence.sources:
        for span in spans:
            readings = tuple(silent(readings, source, span))
    return recording.with_fault(silence.name, readings), spans


def farthest(run: Run, recording: Recording, spans: Sequence[Span]) -> Iterator[float]:
    """Yield how far [m] a run was off at most from each span's beginning to 2 s after its end.

    At any time the last output of a method counts, as it does for a driver.
    """
    said = [w for w in run.words if w.estimate is not None]
    stamps = np.array([w.stamp for w in said])
    for span in spans:
        far = 0.0
        for stamp, truth in recording.truth.items():
            if span.begin <= stamp < span.end + 2 * SECOND:
                pose = said[int(np.searchsorted(stamps, stamp, side="right")) - 1].estimate
                assert pose is not None
                far = max(far, float(np.linalg.norm(truth.position - pose.position)))
        yield far


def latency() -> Iterator[Figure]:
    """Readings that come late, and overtake each other."""
    yield from compare(_late())


def _late() -> Iterator[Case]:
    for name, delay, jitter in (
        ("scanners 0.1 s late", 0.1, 0.0),
        ("scanners 0.1 to 0.5 s late", 0.1, 0.4),
    ):
        for seed, scene in enumerate(SCENES, start=11):
            full = f"{name}, {scene}"
            recording = record(world_of(scene), name=full, seed=seed, seconds=40.0)
            readings: Iterable[Reading] = recording.readings
            for source in SCANNERS:
                readings = late(
                    readings,
                    source,
                    round(delay * SECOND),
                    jitter=round(jitter * SECOND),
                    seed=seed,
                )
            yield Case(full, scene, recording.with_fault(full, tuple(readings)))


# Being carried away

CARRIED_SCENES = ("office", *BUILDINGS)
BEFORE, AFTER = 8 * SECOND, 25 * SECOND
"""How long a trial lasts before the robot is carried away and after [ns]."""
TRIALS, PEER_TRIALS = 8, 2
"""In each scene; a peer gets the first ones of ours."""


@dataclass(frozen=True, slots=True)
class Carried:
    """What became of a robot that was carried away; times [s] and ways [m] since it was set down."""

    flagged: float
    """Until it said that it was lost; infinite if it never did."""
    doubted: float
    """The same of any doubt."""
    placed: float
    """Until it was sure again, and right."""
    way: float
    """Driven until then."""
    wrong: bool
    """Whether it was ever sure again of a wrong place."""


def carried_away() -> Iterator[Figure]:
    """Robots that are lifted in mid-drive and set down elsewhere in the same building."""
    found: dict[str, list[Carried]] = {}
    for seed, scene in enumerate(CARRIED_SCENES, start=81):
        rng, world = np.random.default_rng(seed), map_of(scene)
        drive = record(world_of(scene), name=scene, seed=seed, seconds=140.0)
        for i in range(TRIALS):
            recording, moved = carry(drive, rng)
            methods: dict[str, Method] = {OURS: ours, **(PEERS if i < PEER_TRIALS else {})}
            for name, method in methods.items():
                fate = fate_of(method(recording, world), recording, moved)
                found.setdefault(name, []).append(fate)
    for name, fates in found.items():
        yield from _of_carried(name, fates)


def carry(
    drive: Recording,
    rng: np.random.Generator,
    *,
    after: int = AFTER,
    reach: tuple[float, float] | None = None,
) -> tuple[Recording, int]:
    """Cut a drive and splice its pieces; return it, and the stamp from which it is elsewhere [ns].

    Args:
        drive: of which the pieces are.
        rng: draws when the robot is lifted, and where it is set down.
        after: how long the drive goes on then [ns].
        reach: least and greatest distance over which it is carried [m]; else to anywhere that is another place.
    """
    last = max(drive.truth)
    while True:
        lifted = int(rng.integers(BEFORE + 2 * SECOND, last))
        down = int(rng.integers(2 * SECOND, last - after))
        if reach is not None:
            down = lifted + int(rng.integers(-6 * SECOND, 6 * SECOND))
        here, there = _at(drive, lifted), _at(drive, down)
        apart = float(np.hypot(*(here.position - there.position)[:2]))
        if reach is not None:
            if reach[0] < apart < reach[1] and down < last - after:
                break
        elif apart > 1.0 or abs(wrap_angle(here.yaw - there.yaw)) > np.deg2rad(30.0):
            break
    before = [r for r in _between(drive, lifted - BEFORE, lifted) if not isinstance(r, Hint)]
    there_on = _between(drive, down, down + after)
    begin = lifted - BEFORE + SECOND // 2
    x, y, yaw = *_at(drive, begin).position[:2], _at(drive, begin).yaw
    hint = Hint(begin, Pose.planar(float(x), float(y), yaw), np.zeros((6, 6)))
    place = next(i for i, r in enumerate(before) if end_of(r) >= begin)
    spliced = tuple(kidnapped([*before[:place], hint, *before[place:]], there_on))
    moved = max(end_of(r) for r in before)
    shift = end_of(spliced[len(before) + 1]) - end_of(
        next(r for r in there_on if type(r) is not Hint)
    )
    truth = {s: p for s, p in drive.truth.items() if s <= moved}
    truth |= {s + shift: p for s, p in drive.truth.items() if s >= down}
    return Recording(drive.name, spliced, truth, drive.mounts), moved


def _between(drive: Recording, begin: int, end: int) -> list[Reading]:
    return [r for r in drive.readings if begin <= end_of(r) < end]


def _at(drive: Recording, stamp: int) -> Pose:
    return drive.truth[min(drive.truth, key=lambda s: abs(s - stamp))]


def fate_of(run: Run, recording: Recording, moved: int) -> Carried:
    """Return what became of a robot that was elsewhere from the stamp ``moved`` on [ns]."""
    never = float("inf")
    flagged = doubted = placed = never
    way, last, wrong = 0.0, None, False
    for word in run.words:
        truth = recording.truth.get(word.stamp)
        if word.stamp <= moved or truth is None or word.estimate is None:
            continue
        way += 0.0 if last is None else float(np.hypot(*(truth.position - last)[:2]))
        last, passed = truth.position, (word.stamp - moved) / SECOND
        sure = word.health not in (*LOST, Health.SUSPECT)
        if word.health in LOST:
            flagged = min(flagged, passed)
        if not sure:
            doubted = min(doubted, passed)
        elif doubted < never:
            off = float(np.linalg.norm(truth.position - word.estimate.position))
            wrong |= off > WRONG
            if right(word.estimate, truth):
                placed = passed
                break
    return Carried(flagged, doubted, placed, way if placed < never else never, wrong)


def _of_carried(method: str, fates: Sequence[Carried]) -> Iterator[Figure]:
    case, n = "carried away in mid-drive", len(fates)
    in_time = sum(f.flagged <= 2.0 for f in fates)
    doubted = sum(f.doubted <= 2.0 for f in fates)
    least = 99.0 if method == OURS else None
    yield share(case, method, "said to be suspect or lost within 2 s", doubted, n, least=least)
    yield share(case, method, "said to be lost within 2 s", in_time, n)
    back = [f for f in fates if f.placed < float("inf")]
    yield share(case, method, "sure and right again within 25 s", len(back), n)
    yield share(case, method, "sure of a wrong place on the way", sum(f.wrong for f in fates), n)
    for name, unit, values in (
        ("said to be lost after", "s", [f.flagged for f in fates if f.flagged < float("inf")]),
        ("sure and right again after", "s", [f.placed for f in back]),
        ("way until sure and right again", "m", [f.way for f in back]),
    ):
        if values:
            p50, p95 = np.percentile(values, [50, 95])
            yield Figure(case, method, f"{name}, p50", float(p50), unit, len(values))
            yield Figure(case, method, f"{name}, p95", float(p95), unit, len(values))
