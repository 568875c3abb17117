"""Drives replayed to every method: ours and its peers, on the same readings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.common.figures import OURS, Figure, share
from benchmarks.replay.matchers import SmallGicp, plain
from benchmarks.replay.recordings import Recording, map_of, record, world_of
from benchmarks.replay.replaying import (
    Laps,
    Moment,
    Run,
    error,
    replay,
    replay_monte_carlo,
    score,
)
from localization.evaluation.fault_injection import Clutter, Span, occluded, slipping
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Reading
from robot_sim import MOUNTS, P3AT, SimulationConfig, World, sensor_suite
from robot_sim.robot.imperfections import MANDOW_2007

SECONDS = 40.0
"""Length of a drive [s]."""
BUILDINGS = tuple(f"building-{seed}-400" for seed in range(701, 705))
"""Generated; no constant of the localiser was chosen with them."""
HEIGHT = float(MOUNTS["laser_horizontal"].position[2])
SLIPS = (8.0, 16.0, 24.0, 32.0)
"""All wheels report twice their speed for a second at these times [s]."""
BARE = (8.0, 30.0)
"""Where scanners see the same in every place of the corridor, as its README has it [m]."""

Method = Callable[[Recording, PreparedMap], Run]


def ours(recording: Recording, world: PreparedMap) -> Run:
    """Our localiser as it is."""
    laps = Laps()
    return replay(recording, Localizer(world, recording.mounts, stage=laps.stage), laps)


def kiss(recording: Recording, world: PreparedMap) -> Run:
    """KISS-ICP to the map with a fixed covariance, in our filter."""
    laps = Laps()
    localizer = Localizer(world, recording.mounts, plain(Matcher.KISS), stage=laps.stage)
    return replay(recording, localizer, laps)


def gicp(recording: Recording, world: PreparedMap) -> Run:
    """small_gicp's plane-ICP with its Hessian, in our filter."""
    laps = Laps()
    localizer = Localizer(
        world,
        recording.mounts,
        plain(Matcher.PLANE),
        stage=laps.stage,
        matcher=SmallGicp(world),
    )
    return replay(recording, localizer, laps)


KISS = "KISS to map"
PEERS: dict[str, Method] = {KISS: kiss, "small_gicp": gicp}


def particles(mine: Run, world: PreparedMap) -> Run:
    """Return what the Monte-Carlo localiser says of the sweeps and the odometry of our run."""
    return replay_monte_carlo(mine, world, height=HEIGHT)


@dataclass(frozen=True, slots=True)
class Case:
    """A drive to be replayed to every method."""

    name: str
    scene: str
    recording: Recording
    goals: Mapping[str, float] = field(default_factory=dict)
    """What our quantities should be at most."""


NEAR = {"ATE": 1.0, "max": 5.0, "yaw": 0.2}
CROWDED = {"ATE": 1.5}


def nominal() -> Iterator[Case]:
    """Tours as they are; scans are distorted by the sweep, the wheels slip as a P3-AT's do."""
    for seed, scene in enumerate(("office", *BUILDINGS), start=11):
        yield _case("nominal", scene, seed, NEAR)


def occlusion() -> Iterator[Case]:
    """The same tours with 30 % of the beams hidden by something near."""
    for seed, scene in enumerate(("office", *BUILDINGS[:2]), start=11):
        case = _case("30 % occluded", scene, seed, CROWDED)
        yield _faulty(case, occluded(case.recording.readings, Clutter(0.3), seed=seed))


def furniture() -> Iterator[Case]:
    """All furniture moved since the map was made."""
    for seed, scene in enumerate(("office", *BUILDINGS[:2]), start=21):
        world = world_of(scene, rearranged=seed)
        yield _case("furniture moved", scene, seed, CROWDED, world=world)


def courtyard() -> Iterator[Case]:
    """Uneven ground: roll, pitch and heave."""
    goals = {"ATE": 3.0, "tilt": 0.5}
    yield _case("uneven ground", "courtyard", 31, goals, seconds=3.0 * SECONDS)


def slips() -> Iterator[Case]:
    """All wheels spin at twice their speed for a second, four times."""
    spans = [Span(round(t * SECOND), round((t + 1.0) * SECOND)) for t in SLIPS]
    for seed, scene in enumerate(("office", *BUILDINGS[:2]), start=11):
        case = _case("slip bursts", scene, seed, {"max": 5.0})
        yield _faulty(case, slipping(case.recording.readings, spans))


def imperfect() -> Iterator[Case]:
    """Tyres of unequal size, which tilt the robot, and scanners whose beams mix, fade and pass through glass."""
    worn = replace(P3AT(), imperfections=MANDOW_2007)
    suite = sensor_suite(realistic=True)
    optical = SimulationConfig(scanners=suite.scanners, inertial=suite.inertial)
    for seed, scene in enumerate(("office", *BUILDINGS[:2]), start=11):
        yield _case("uneven tyres", scene, seed, NEAR, world=world_of(scene, robot=worn))
        yield _case("beam effects", scene, seed, NEAR, config=optical)


def corridor() -> Iterator[Case]:
    """A bare corridor: nothing holds the robot along it."""
    yield _case("nothing to hold on to", "corridor", 41, {"NEES": 10.0})


def _case(
    name: str,
    scene: str,
    seed: int,
    goals: Mapping[str, float],
    *,
    world: World | None = None,
    seconds: float = SECONDS,
    config: SimulationConfig | None = None,
) -> Case:
    """Drive a case; its recording ends with the tour, if that is shorter."""
    where = world or world_of(scene)
    full = f"{name}, {scene}"
    recording = record(where, name=full, seed=seed, seconds=seconds, config=config)
    return Case(full, scene, recording, goals)


def _faulty(case: Case, readings: Iterable[Reading]) -> Case:
    return replace(case, recording=case.recording.with_fault(case.name, tuple(readings)))


def compare(
    cases: Iterable[Case],
    more: Callable[[Case, Run], Iterator[Figure]] = lambda case, run: iter(()),
) -> Iterator[Figure]:
    """Replay each case to every method and yield how it did, and what ``more`` says of our run."""
    for case in cases:
        world = map_of(case.scene)
        mine = ours(case.recording, world)
        yield from figures_of(case, OURS, mine)
        yield from more(case, mine)
        for name, method in PEERS.items():
            yield from figures_of(case, name, method(case.recording, world))
        yield from figures_of(case, "Monte Carlo", particles(mine, world))


def figures_of(case: Case, method: str, run: Run) -> Iterator[Figure]:
    """Yield what is said of a run, with the case's goals if it is ours."""
    s, n = score(run), len(run.counted())
    p50, p99 = run.laps.ms("registration")
    for name, value, unit, low, high in (
        ("ATE", s.rmse * 100.0, "cm", s.low * 100.0, s.high * 100.0),
        ("max", s.most * 100.0, "cm", None, None),
        ("yaw", float(np.rad2deg(s.yaw)), "deg", None, None),
        ("tilt", float(np.rad2deg(s.tilt)), "deg", None, None),
        ("NEES", s.nees, "", None, None),
        ("inside 95 %", s.inside * 100.0, "%", None, None),
        ("lost", s.lost * 100.0, "%", None, None),
        ("registration, p50", p50, "ms", None, None),
        ("registration, p99", p99, "ms", None, None),
    ):
        most = case.goals.get(name) if method == OURS else None
        yield Figure(case.name, method, name, value, unit, n, low, high, most=most)


def directions_named(case: Case, run: Run) -> Iterator[Figure]:
    """Measure how soon the direction along the corridor is named, and for how long."""
    bare = [m for m in run.moments if BARE[0] < m.truth.position[0] < BARE[1]]
    named = [m for m in bare if any("unobservable" in r and "forward" in r for r in m.reasons)]
    soon = (named[0].stamp - bare[0].stamp) / SECOND if named else float("inf")
    n = len(bare)
    yield Figure(case.name, OURS, "direction without hold named after", soon, "s", n, most=1.0)
    yield share(case.name, OURS, "sweeps of the bare part that name it", len(named), n)


def consistency() -> Iterator[Figure]:
    """Twenty seeds of a short drive: is the mean NEES at one time what chi-square says?"""
    scene = BUILDINGS[0]
    case, seeds = f"consistency, {scene}, 20 seeds of 16 s", range(201, 221)
    world, map_ = world_of(scene), map_of(scene)
    at_end, means, inside = [], [], []
    for seed in seeds:
        run = ours(record(world, name=f"{seed}", seed=seed, seconds=16.0), map_)
        result = score(run)
        means.append(result.nees)
        inside.append(result.inside)
        at_end.append(_nees(run.counted()[-1]))
    low, high = _bootstrap(means)
    n = len(means)
    yield Figure(case, OURS, "mean NEES(6)", float(np.mean(means)), "", n, low, high, 2.0, 8.0)
    low, high = _bootstrap(inside)
    mean = float(np.mean(inside)) * 100.0
    yield Figure(
        case, OURS, "sweeps inside 95 %", mean, "%", n, low * 100.0, high * 100.0, least=90.0
    )
    low, high = _bootstrap(at_end)
    yield Figure(case, OURS, "NEES of each last sweep", float(np.mean(at_end)), "", n, low, high)
    good = sum(v < 12.592 for v in at_end)
    yield share(case, OURS, "last sweeps inside 95 %", good, n)


def _nees(moment: Moment) -> float:
    e = error(moment)
    return float(e @ np.linalg.solve(moment.covariance, e))


def _bootstrap(values: list[float]) -> tuple[float, float]:
    """Return 95 % bounds of the mean of independent values."""
    drawn = np.random.default_rng(0).choice(values, (2000, len(values))).mean(axis=1)
    low, high = np.percentile(drawn, [2.5, 97.5])
    return float(low), float(high)


def speed() -> Iterator[Figure]:
    """What a sweep costs, part by part, in CPU time of one thread, beside the peers'."""
    recording, case = record(world_of("office"), name="office", seed=1, seconds=SECONDS), "speed"
    world = map_of("office")
    mine = ours(recording, world)
    for name, goal in (("predict", 0.1), ("deskew", None), ("kiss odometry", None),
                       ("registration", None)):  # fmt: skip
        p50, p99 = mine.laps.ms(name)
        n = len(mine.laps.of[name])
        yield Figure(case, OURS, f"{name}, p50", p50, "ms", n, most=goal)
        yield Figure(case, OURS, f"{name}, p99", p99, "ms", n)
    p50, p99 = mine.laps.update_ms()
    n = len(mine.laps.of["registration"])
    yield Figure(case, OURS, "registration and filter, p50", p50, "ms", n, most=5.0)
    yield Figure(case, OURS, "registration and filter, p99", p99, "ms", n, most=10.0)
    own50, own99 = mine.laps.ms("registration")
    for name, method in PEERS.items():
        run = method(recording, world)
        p50, p99 = run.laps.ms("registration")
        n = len(run.laps.of["registration"])
        least = 3.0 if name == KISS else None
        yield Figure(case, name, "registration, p50", p50, "ms", n)
        yield Figure(case, name, "registration, p99", p99, "ms", n)
        yield Figure(case, name, "times ours, p50", p50 / own50, "", n, least=least)
        yield Figure(case, name, "times ours, p99", p99 / own99, "", n)
