"""What the guard is worth to the library's operators over slow links: contacts and time, with and without it.

After Luck et al., HRI 2006, and Storms, Vejdemo-Johansson and Tilbury, IJRR 2017: guarded driving gains by delay. Furniture
has moved since the operator's map was made, and old commands are neither slowed nor refused, so that the delay shows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.common.figures import Figure
from benchmarks.guard.resumed import resumed
from teleop.scenario.files.scenario import SCHEMA
from teleop.scenario.session.run import run_scenario

DELAYS: Final = (0.0, 0.3, 0.6, 1.0)
"""Round trips [s]."""
_ROUTES: Final = (
    ("office", "corridor_east"),
    ("office", "kitchen"),
    ("glasshouse", "west_aisle_north"),
    ("warehouse", "aisle_2_west"),
)
"""Scenes, and where to."""
_SEEDS: Final = 3
_LONGEST: Final = 300.0
"""Time after which a drive counts as not arrived [s]."""


@dataclass(frozen=True)
class Trip:
    """Which drive."""

    scene: str
    """Name of the scene."""
    goal: str
    """Name of the place to drive to."""
    delay: float
    """Round trip [s]."""
    seed: int
    """Seed of the robot, and of how furniture has moved."""
    guarded: bool
    """Whether the guard is on."""


@dataclass(frozen=True)
class Arrival(Trip):
    """What came of it."""

    seconds: float
    """Time of the robot that it took [s]."""
    arrived: float
    """Goals that were reached."""
    contacts: float
    """Contacts."""


def campaign(folder: Path) -> Iterator[Figure]:
    """Drive what is missing in ``FOLDER/operators.jsonl``, and yield the figures."""
    plan = [
        Trip(*route, delay, seed, guarded)
        for route, delay, seed, guarded in product(_ROUTES, DELAYS, range(_SEEDS), (True, False))
    ]
    yield from _figures(resumed(folder / "operators.jsonl", plan, _drive, Arrival))


def _drive(trip: Trip) -> Arrival:
    link = {"kind": "link", "at": 0, "lasting": _LONGEST, "delay": 0.5 * trip.delay}
    scenario = SCHEMA.validate_python(
        {
            "format": 1,
            "name": "guard-by-delay",
            "seed": trip.seed,
            "world": {
                "scene": trip.scene,
                "rearranged": trip.seed + 1,
                "stale_limits": False,
                "guard": trip.guarded,
            },
            "mission": {"goals": [{"at": trip.goal, "within": 1.0}], "time_limit": _LONGEST},
            "operator": {"kind": "steering", "speed": 0.7},
            "fault": [link] if trip.delay else [],
        }
    )
    with TemporaryDirectory() as runs:
        outcome = run_scenario(scenario, Path(runs) / "run")
    figures = outcome.figures
    return Arrival(
        **asdict(trip),
        seconds=outcome.robot_seconds,
        arrived=figures["goals_reached"],
        contacts=figures["contacts"],
    )


def _figures(done: list[Arrival]) -> Iterator[Figure]:
    for delay, guarded in product(DELAYS, (True, False)):
        mine = [d for d in done if d.delay == delay and d.guarded is guarded]
        case, method = f"round trip {delay:g} s", f"{'with' if guarded else 'without'} guard"
        for quantity, total, unit in (
            ("arrived", sum(d.arrived for d in mine), ""),
            ("contacts", sum(d.contacts for d in mine), ""),
            ("time", sum(d.seconds for d in mine), "s"),
        ):
            yield Figure(case, method, quantity, total, unit, len(mine))
