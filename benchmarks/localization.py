"""The localiser beside its peers on the same readings; parts by name: nominal occluded furniture courtyard slips corridor consistency hints kidnapped kidnapped-2000 speed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks._peers import SmallGicp, plain
from benchmarks._recordings import Recording, map_of, record, world_of
from benchmarks._replaying import (
    Laps,
    Moment,
    Run,
    Score,
    replay,
    replay_monte_carlo,
    score,
    wilson,
)
from benchmarks._searching import (
    Kidnapping,
    hint_trial,
    kidnap_trial,
    searcher_of,
)
from localization.faults import Clutter, Span, occluded, slipping
from localization.localizer import Localizer
from localization.matching import Matcher
from localization.prepared import PreparedMap
from localization.types import SECOND
from robot_sim import MOUNTS, World

SECONDS = 40.0
"""Length of a drive [s]."""
BUILDINGS = ("building-701-400", "building-702-400")
"""Generated; no constant of the localiser was chosen with them."""
LARGE = "building-901-2000"
"""[m^2] is the last number."""
HEIGHT = float(MOUNTS["laser_horizontal"].position[2])
SLIPS = (8.0, 16.0, 24.0, 32.0)
"""All wheels report twice their speed for a second at these times [s]."""
BARE = (8.0, 30.0)
"""Where scanners see the same in every place of the corridor, as its README has it [m]."""

Method = Callable[[Recording, PreparedMap], Run]


def say(*lines: str) -> None:
    """Print at once, for some parts take minutes."""
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


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


PEERS: dict[str, Method] = {"KISS to map": kiss, "small_gicp": gicp}


@dataclass(frozen=True, slots=True)
class Case:
    """A drive to be replayed to every method."""

    name: str
    scene: str
    recording: Recording


def nominal() -> Iterator[Case]:
    """Tours as they are; scans are distorted by the sweep, the wheels slip as a P3-AT's do."""
    for seed, scene in enumerate(("office", *BUILDINGS), start=11):
        yield _case(f"nominal, {scene}", scene, world_of(scene), seed)


def occlusion() -> Iterator[Case]:
    """The same tours with 30 % of the beams hidden by something near."""
    for seed, scene in ((11, "office"), (12, BUILDINGS[0])):
        case = _case(f"30 % occluded, {scene}", scene, world_of(scene), seed)
        hidden = tuple(occluded(case.recording.readings, Clutter(0.3), seed=seed))
        yield Case(case.name, scene, case.recording.with_fault(case.name, hidden))


def furniture() -> Iterator[Case]:
    """All furniture moved since the map was made."""
    for seed, scene in ((21, "office"), (22, BUILDINGS[0])):
        world = world_of(scene, rearranged=seed)
        yield _case(f"furniture moved, {scene}", scene, world, seed)


def courtyard() -> Iterator[Case]:
    """Uneven ground: roll, pitch and heave."""
    yield _case("courtyard", "courtyard", world_of("courtyard"), 31, seconds=3.0 * SECONDS)


def slips() -> Iterator[Case]:
    """All wheels spin at twice their speed for a second, four times."""
    spans = [Span(round(t * SECOND), round((t + 1.0) * SECOND)) for t in SLIPS]
    for seed, scene in ((11, "office"), (12, BUILDINGS[0])):
        case = _case(f"slip bursts, {scene}", scene, world_of(scene), seed)
        faulty = tuple(slipping(case.recording.readings, spans))
        yield Case(case.name, scene, case.recording.with_fault(case.name, faulty))


def corridor() -> Iterator[Case]:
    """A bare corridor: nothing holds the robot along it."""
    yield _case("corridor", "corridor", world_of("corridor"), 41)


def _case(name: str, scene: str, world: World, seed: int, seconds: float = SECONDS) -> Case:
    return Case(name, scene, record(world, name=name, seed=seed, seconds=seconds))


TITLE = (
    f"  {'case':34s} {'method':14s} {'n':>4s} {'ATE cm (95 %)':>18s} {'max':>6s} {'yaw deg':>8s}"
    f" {'tilt':>5s} {'NEES':>8s} {'in 95%':>6s} {'lost':>5s} {'ms p50':>7s} {'p99':>6s}"
)


def line(case: str, method: str, result: Score, laps: Laps) -> str:
    """Return a row of the table."""
    p50, p99 = laps.ms("registration")
    bounds = f"{result.rmse * 100:.2f} ({result.low * 100:.2f}-{result.high * 100:.2f})"
    return (
        f"  {case:34s} {method:14s} {result.sweeps:4d} {bounds:>18s} {result.most * 100:6.1f}"
        f" {np.rad2deg(result.yaw):8.3f} {np.rad2deg(result.tilt):5.2f} {result.nees:8.1f}"
        f" {result.inside:6.0%} {result.lost:5.0%} {p50:7.2f} {p99:6.2f}"
    )


def compare(
    cases: Iterator[Case], show: Callable[[Case, Run], None] = lambda case, run: None
) -> None:
    """Replay each case to every method and print a row for each."""
    say(TITLE)
    for case in cases:
        world = map_of(case.scene)
        mine = ours(case.recording, world)
        say(line(case.name, "Farsteer", score(mine), mine.laps))
        show(case, mine)
        for name, method in PEERS.items():
            run = method(case.recording, world)
            say(line(case.name, name, score(run), run.laps))
        run = replay_monte_carlo(mine, world, height=HEIGHT)
        say(line(case.name, "Monte Carlo", score(run), run.laps))


def directions_named(case: Case, run: Run) -> None:
    """Tell how soon the direction along the corridor is named, and how long that lasts."""
    bare = [m for m in run.moments if BARE[0] < m.truth.position[0] < BARE[1]]
    named = [m for m in bare if any("no hold in" in r and "forward" in r for r in m.reasons)]
    share = len(named) / max(len(bare), 1)
    soon = f"{(named[0].stamp - bare[0].stamp) / SECOND:.1f} s after" if named else "never since"
    say(
        f"    where it is bare, x {BARE[0]:.0f} to {BARE[1]:.0f} m, 'forward' is named {soon} it begins, and"
        f" in {share:.0%} of {len(bare)} sweeps"
    )


def consistency() -> None:
    """Twenty seeds of a short drive: is the mean NEES at one time what chi-square says?"""
    seeds, scene = range(201, 221), BUILDINGS[0]
    world, map_ = world_of(scene), map_of(scene)
    at_end, means, inside, far = [], [], [], []
    for seed in seeds:
        recording = record(world, name=f"{seed}", seed=seed, seconds=16.0)
        result = score(run := ours(recording, map_))
        means.append(result.nees)
        inside.append(result.inside)
        far.append(result.rmse)
        at_end.append(_nees(run.counted()[-1]))
    drawn = np.random.default_rng(0).choice(means, (2000, len(means))).mean(axis=1)
    low, high = np.percentile(drawn, [2.5, 97.5])
    good = sum(v < 12.592 for v in at_end)
    a, b = wilson(good, len(at_end))
    say(
        f"  {scene}, {len(means)} seeds of 16 s: ATE {np.mean(far) * 100:.2f} cm",
        f"  mean NEES(6) {np.mean(means):.2f} (95 % {low:.2f}-{high:.2f}); sweeps inside the 95 % bound"
        f" {np.mean(inside):.1%}",
        f"  one sweep of each seed, the last: mean NEES {np.mean(at_end):.2f} (4.6-7.6 is honest),"
        f" inside {good} of {len(at_end)} ({a:.0%}-{b:.0%})",
    )


def _nees(moment: Moment) -> float:
    from benchmarks._replaying import error

    e = error(moment)
    return float(e @ np.linalg.solve(moment.covariance, e))


def _moments(scene: str, seed: int, seconds: float, share: float = 0.0) -> tuple[Moment, ...]:
    """Return sweeps with odometry and truth; the estimate in them is used by nobody."""
    recording = record(world_of(scene), name=scene, seed=seed, seconds=seconds)
    if share:
        hidden = tuple(occluded(recording.readings, Clutter(share), seed=seed))
        recording = recording.with_fault(scene, hidden)
    run = replay(recording, Localizer(map_of(scene), recording.mounts, plain(Matcher.PLANE)))
    return run.moments[20:]


def hints(count: int = 300) -> None:
    """Hints that are 3 m and 60 degrees wrong, and say so."""
    rng = np.random.default_rng(5)
    for share in (0.0, 0.3):
        good, answered, wrong, cost = 0, 0, 0, []
        scenes = ("office", *BUILDINGS)
        for scene in scenes:
            moments = _moments(scene, 51, SECONDS, share)
            searcher = searcher_of(map_of(scene), HEIGHT)
            for i in rng.integers(0, len(moments), count // len(scenes)).tolist():
                trial = hint_trial(searcher, moments[i], rng)
                cost.append(trial.seconds)
                good += trial.right
                answered += trial.accepted and trial.right
                wrong += trial.accepted and not trial.right
        n = len(cost)
        low, high = wilson(good, n)
        bad_low, bad_high = wilson(wrong, n)
        p50, p99 = np.percentile(np.array(cost) * 1e3, [50, 99])
        say(
            f"  hints 3 m, 60 deg off, {share:.0%} occluded, n = {n}: best place right {good / n:.1%}"
            f" ({low:.1%}-{high:.1%}), accepted at once {answered / n:.1%}, wrongly accepted {wrong / n:.1%}"
            f" ({bad_low:.1%}-{bad_high:.1%}), CPU {p50:.0f} ms p50, {p99:.0f} p99"
        )


def kidnapped() -> None:
    """A robot somewhere in 400 m^2 that nobody placed; it drives on by up to 3 m."""
    for share, count in ((0.0, 100), (0.3, 50)):
        for scene in BUILDINGS:
            _kidnapped(scene, count, share)


def kidnapped_far() -> None:
    """The same in 2000 m^2."""
    _kidnapped(LARGE, 100, 0.0)


def _kidnapped(scene: str, count: int, share: float) -> None:
    rng = np.random.default_rng(7)
    moments = _moments(scene, 61, 2.0 * SECONDS, share)
    searcher = searcher_of(map_of(scene), HEIGHT)
    trials: list[Kidnapping] = []
    for i in rng.integers(0, max(1, len(moments) - 80), count).tolist():
        trials.append(kidnap_trial(searcher, moments[i:]))
    first = sum(t.first_right for t in trials)
    right, wrong = sum(t.right for t in trials), sum(t.wrong for t in trials)
    low, high = wilson(right, count)
    bad_low, bad_high = wilson(wrong, count)
    p50, p99 = np.percentile([t.search_seconds for t in trials], [50, 99])
    total = np.percentile([t.seconds for t in trials], 50)
    way = np.median([t.way for t in trials if t.right or t.wrong] or [np.nan])
    say(
        f"  kidnapped, {scene}, {share:.0%} occluded, n = {count}: best place of one sweep right"
        f" {first / count:.1%}; after <= 3 m settled right {right / count:.1%} ({low:.1%}-{high:.1%}),"
        f" wrong {wrong / count:.1%} ({bad_low:.1%}-{bad_high:.1%}), after {way:.1f} m;"
        f" CPU search {p50:.2f} s p50, {p99:.2f} p99, all {total:.2f}"
    )


def speed() -> None:
    """What a sweep costs, part by part, in CPU time of one thread."""
    recording = record(world_of("office"), name="office", seed=1, seconds=40.0)
    world = map_of("office")
    mine, theirs = ours(recording, world), kiss(recording, world)
    say(f"  {'stage':20s} {'calls':>6s} {'p50 ms':>8s} {'p99 ms':>8s}")
    for name in mine.laps.of:
        p50, p99 = mine.laps.ms(name)
        say(f"  {name:20s} {len(mine.laps.of[name]):6d} {p50:8.3f} {p99:8.3f}")
    p50, p99 = mine.laps.ms("registration")
    peer50, peer99 = theirs.laps.ms("registration")
    say(
        f"  {'KISS to map':20s} {len(theirs.laps.of['registration']):6d} {peer50:8.3f} {peer99:8.3f}",
        f"  ratio {peer50 / p50:.1f} at p50, {peer99 / p99:.1f} at p99",
        "  registration and filter together, sweep by sweep: {:.2f} ms p50, {:.2f} p99".format(
            *mine.laps.update_ms()
        ),
    )


PARTS: dict[str, Callable[[], None]] = {
    "nominal": lambda: compare(nominal()),
    "occluded": lambda: compare(occlusion()),
    "furniture": lambda: compare(furniture()),
    "courtyard": lambda: compare(courtyard()),
    "slips": lambda: compare(slips()),
    "corridor": lambda: compare(corridor(), directions_named),
    "consistency": consistency,
    "hints": hints,
    "kidnapped": kidnapped,
    "kidnapped-2000": kidnapped_far,
    "speed": speed,
}


def main(parts: Sequence[str] = ()) -> None:
    """Print the tables of some parts, or of all."""
    for name in parts or PARTS:
        begun = time.process_time()
        say(f" {name}")
        PARTS[name]()
        say(f"   ({time.process_time() - begun:.0f} s of CPU)")


if __name__ == "__main__":
    main(sys.argv[1:])
