"""Hours of driving, and how often the localiser cried that it was lost when it was not."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.common.figures import OURS, Figure, poisson, say
from benchmarks.replay.recordings import driving, map_of, world_of
from benchmarks.replay.replaying import SETTLING
from localization.config import LocalizerConfig
from localization.geometry import wrap_angle
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health, Pose
from robot_sim import Simulation

WRONG, WRONG_YAW = 0.25, np.deg2rad(10.0)
"""An estimate is wrong beyond this [m, rad]; a report of being lost within it is a false alarm."""
PATIENCE = 2 * SECOND
"""A wrong estimate must be flagged within this time [ns]."""
FLAGGED = (Health.LOST, Health.RELOCALISING)
DOUBTED = (*FLAGGED, Health.SUSPECT)
CHUNKS = 8
"""Parts that the drives are measured in, each by itself."""
SECONDS = 600.0
"""Length of a drive [s]: there and back on the tour, again and again."""
_COUNTS = (
    "false alarms of being lost",
    "false doubts",
    "wrong for 2 s and not flagged",
    "wrong for 2 s and not even doubted",
)
_GOALS = (0.1, 10.0, None, None)
"""Rates of them [1/h] that are wanted at most; a doubt slows an operator down, and stops nobody."""
_DRIVEN = "driven"


@dataclass(frozen=True, slots=True)
class LongDrive:
    """Where, and from which seed."""

    scene: str
    seed: int
    alive: bool = False


DRIVES = (
    *(LongDrive("office", seed, alive=True) for seed in range(301, 306)),
    *(LongDrive("warehouse", seed, alive=True) for seed in range(311, 314)),
    *(LongDrive("courtyard", seed, alive=True) for seed in (321, 322)),
    LongDrive("glasshouse", 331, alive=True),
    LongDrive("corridor", 341),
    *(LongDrive(f"building-{b}-400", s) for b in range(701, 705) for s in (351, 352)),
    *(LongDrive(f"building-{b}-2000", s) for b in (901, 902) for s in (361, 362)),
)
"""Four hours: with none in it, Poisson's 95 % bound of alarms is below one an hour."""


@dataclass(slots=True)
class Watch:
    """Counts alarms that begin while the estimate is right, and times it is wrong unflagged."""

    lost: int = 0
    """Alarms that it is lost, begun while it was right."""
    suspect: int = 0
    """The same of doubts."""
    missed: int = 0
    """Times it was wrong and not flagged in time."""
    trusted: int = 0
    """Times it was wrong for as long and not even doubted."""
    seconds: float = 0.0
    """That were watched."""
    stories: list[str] = field(default_factory=list)
    """Stamps and reasons, for inspection."""
    _before: Health | None = None
    _last: int = 0
    _unflagged: int = 0
    """For how long it has been wrong and not flagged [ns]."""
    _undoubted: int = 0
    """The same of doubts."""

    def see(self, stamp: int, far: float, turn: float, health: Health, reasons: str) -> None:
        """Take note of one sweep's estimate and how far off it is [m, rad]."""
        right = far <= WRONG and abs(turn) <= WRONG_YAW
        told = f"{stamp / SECOND:.1f} s: {far * 100:.1f} cm off, {health}: {reasons}"
        since = stamp - self._last if self._before is not None else 0
        if self._before is not None and right and health is not self._before:
            if health in FLAGGED and self._before not in FLAGGED:
                self.lost += 1
                self.stories.append(told)
            self.suspect += health is Health.SUSPECT
        self.seconds += since / SECOND
        self._before, self._last = health, stamp
        waited, believed = self._unflagged, self._undoubted
        self._unflagged = 0 if right or health in FLAGGED else waited + since
        self._undoubted = 0 if right or health in DOUBTED else believed + since
        if waited <= PATIENCE < self._unflagged:
            self.missed += 1
            self.stories.append(f"not flagged at {told}")
        self.trusted += believed <= PATIENCE < self._undoubted


def watch(
    drive: LongDrive, seconds: float = SECONDS, config: LocalizerConfig | None = None
) -> Watch:
    """Drive and localise as it goes; nothing is kept but the counts."""
    world = world_of(drive.scene, alive=drive.alive, timing=drive.seed)
    simulation = Simulation(world, seed=drive.seed)
    localizer = Localizer(map_of(drive.scene), simulation.mounts, config or LocalizerConfig())
    truth: dict[int, Pose] = {}
    seen, counted = Watch(), None
    for readings in driving(simulation, world, truth, seed=drive.seed, again=True):
        if simulation.stamp > seconds * SECOND:
            break
        for reading in readings:
            estimate = localizer.add(reading)
            there = truth.get(estimate.stamp)
            if estimate.sweep is None or estimate.map_from_base is None or there is None:
                continue
            counted = estimate.stamp + SETTLING if counted is None else counted
            if estimate.stamp >= counted:
                far, turn = _off(estimate.map_from_base, there)
                seen.see(estimate.stamp, far, turn, estimate.health, "; ".join(estimate.reasons))
    return seen


def _off(estimate: Pose, truth: Pose) -> tuple[float, float]:
    # The height too: a robot believed below the floor is wrong, however right it is in the plane.
    far = float(np.linalg.norm(estimate.position - truth.position))
    return far, wrap_angle(estimate.yaw - truth.yaw)


def alarms(chunk: int) -> Iterator[Figure]:
    """Drive one chunk of the drives and yield each drive's counts."""
    yield from counts(DRIVES[chunk::CHUNKS])


def counts(drives: Iterable[LongDrive], config: LocalizerConfig | None = None) -> Iterator[Figure]:
    """Yield each drive's counts."""
    for drive in drives:
        case = f"{drive.scene}, seed {drive.seed}" + (", alive" if drive.alive else "")
        seen = watch(drive, config=config)
        for story in seen.stories:
            say(f"    {case}, {story}")
        yield Figure(case, OURS, _DRIVEN, seen.seconds / 3600.0, "h")
        each = (seen.lost, seen.suspect, seen.missed, seen.trusted)
        for name, count in zip(_COUNTS, each, strict=True):
            yield Figure(case, OURS, name, float(count))


def by_world(figures: Iterable[Figure]) -> dict[str, list[Figure]]:
    """Return the drives' counts by world, with and without people, and all of them together."""
    worlds: dict[str, list[Figure]] = {}
    people: dict[str, list[Figure]] = {"all with people": [], "all without people": []}
    for figure in figures:
        scene, _, _ = figure.case.partition(",")
        place = f"buildings of {scene.split('-')[2]} m²" if scene.startswith("building-") else scene
        alive = figure.case.endswith("alive")
        worlds.setdefault(f"{place}, with people" if alive else place, []).append(figure)
        people["all with people" if alive else "all without people"].append(figure)
    together = {"all": [f for some in people.values() for f in some]}
    return {name: some for name, some in {**worlds, **people, **together}.items() if some}


def by_the_hour(case: str, figures: Sequence[Figure]) -> Iterator[Figure]:
    """Yield the rates of some drives' events, with Poisson's bounds and their goals."""
    hours = math.fsum(f.value for f in figures if f.quantity == _DRIVEN)
    yield Figure(case, OURS, _DRIVEN, hours, "h", len({f.case for f in figures}))
    for name, most in zip(_COUNTS, _GOALS, strict=True):
        events = round(sum(f.value for f in figures if f.quantity == name))
        low, high = (bound / hours for bound in poisson(events))
        yield Figure(case, OURS, name, events / hours, "per h", events, low, high, most=most)
