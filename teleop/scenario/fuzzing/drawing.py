"""One strategy that draws whole sessions: world, start, operators, link and faults.

Times are drawn in half seconds and figures from short lists, so that what is found stays readable.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import chain
from random import Random
from typing import Any, Final, TypeVar, get_args, get_type_hints

from hypothesis import HealthCheck, given, settings, strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from robot_sim.floorplan.doorways import doorways
from robot_sim.worlds.loading import load_plan
from teleop.scenario.files import arm_tasks as tasks, faults, operator_settings as operators
from teleop.scenario.files.faults import Fault
from teleop.scenario.files.limits import Limits
from teleop.scenario.files.operator_settings import Operator
from teleop.scenario.files.scenario import (
    NO_SCANNERS,
    Goal,
    Mission,
    Scenario,
    Start,
    WorldSettings,
)

_Made = TypeVar("_Made")

DURATION: Final = 20.0
"""Duration of a drawn session [s]."""
SCENES: Final = ("office", "corridor", "warehouse", "glasshouse", "courtyard")
"""Scenes that are drawn, the most common one first."""
ROLES: Final = ((), (), ("operate", "operate"), ("operate", "view"), ("view", "operate"))
"""Roles of the tokens of both operators; none where nobody needs a token."""
MOST_FAULTS: Final = 5
"""Largest number of faults of a drawn session."""
_BYTES: Final = 4096
"""Random bytes for a session: more than any takes."""


@lru_cache(maxsize=len(SCENES))
def places_of(scene: str) -> tuple[str, ...]:
    """Return the names of a scene's places."""
    return tuple(sorted(load_plan(scene).places))


@lru_cache(maxsize=len(SCENES))
def doors_of(scene: str) -> tuple[str, ...]:
    """Return the names of a scene's doorways."""
    return tuple(sorted(doorways(load_plan(scene))))


def halves(begin: float, end: float) -> SearchStrategy[float]:
    """Return a strategy of times in half seconds, both ends included."""
    return st.integers(round(2 * begin), round(2 * end)).map(lambda half: 0.5 * half)


def drawn(
    made: type[_Made], **fields: SearchStrategy[Any] | tuple[Any, ...]
) -> SearchStrategy[_Made]:
    """Return a strategy of the values of a class of the schema.

    Args:
        made: The class; if it is of a kind, that is given.
        **fields: Strategy of each field, or values of which one is drawn, the most common one first.
    """
    strategies: dict[str, SearchStrategy[Any]] = {
        name: st.sampled_from(values) if isinstance(values, tuple) else values
        for name, values in fields.items()
    }
    kind = get_args(get_type_hints(made).get("kind"))
    return st.builds(made, **{"kind": st.just(*kind)} if kind else {}, **strategies)


def driving() -> SearchStrategy[Operator]:
    """Return a strategy of operators of the library."""
    speeds = (0.5, 0.3, 0.7, 1.2)
    return st.one_of(
        drawn(
            operators.Follower, speed=speeds, interface=("joy", "cmd_vel"), rate=(10.0, 5.0, 30.0)
        ),
        drawn(operators.Steering, speed=speeds, reaction_time=(0.3, 0.6), lapses=(0.0, 6.0)),
        drawn(operators.Careless, speed=speeds, mistakes=(10.0, 30.0), oddities=(0.0, 20.0)),
    )


def fault(scene: str) -> SearchStrategy[Fault]:
    """Return a strategy of faults in a scene; links and being carried off come twice as often as others."""
    at, lasting = halves(1.0, DURATION - 3.0), (1.0, 0.5, 2.0, 4.0)
    # Made anew each, since Hypothesis takes the same strategy twice for once.
    links = (
        drawn(
            faults.Link,
            at=at,
            lasting=(4.0, 1.0, 2.0, 8.0),
            direction=("both", "up", "down"),
            delay=(0.0, 0.2, 0.8, 1.5, 3.0),
            jitter=(0.0, 0.1, 0.5),
            rate=(0.0, 0.0, 20_000.0),
            blackout=(False, False, True),
        )
        for _ in range(2)
    )
    kidnaps = (drawn(faults.Kidnap, at=at, to=("anywhere",)) for _ in range(2))
    scanners = ("both", "laser_horizontal", "laser_vertical")
    kinds: list[SearchStrategy[Fault]] = [
        *links,
        drawn(faults.OperatorKilled, at=at, silent=st.booleans()),
        *kidnaps,
        drawn(faults.WheelSlip, at=at, lasting=lasting, factor=(2.0, 0.0, 1.3)),
        drawn(faults.ScannerDead, at=at, lasting=lasting, scanner=scanners),
        drawn(faults.ScannerDirty, at=at, lasting=lasting, share=(0.2, 0.4)),
        drawn(faults.WrongHint, at=at, off=(0.5, 2.0, 6.0), turned=(0.0, 30.0, 180.0)),
        drawn(faults.EStopPressed, at=at, lasting=lasting),
        drawn(faults.ClockStep, at=at, step=(5.0, -5.0, 0.4, -0.4)),
    ]
    if doors := doors_of(scene):
        kinds.append(drawn(faults.DoorClosed, at=at, door=doors, lasting=lasting))
    return st.one_of(kinds)


def together(scene: str) -> SearchStrategy[tuple[Fault, ...]]:
    """Return a strategy of faults that come at once, and of single ones, which are more common."""
    at = halves(1.0, DURATION - 10.0)
    single = fault(scene).map(lambda one: (one,))
    return st.one_of(single, single, single, at.flatmap(_at_once))


def _at_once(at: float) -> SearchStrategy[tuple[Fault, ...]]:
    """Return a strategy of faults that begin at one time.

    A robot that knows nothing but its wheels, which lie; one that stays lost; one that sees too little for a hint.
    """
    lasting = st.sampled_from((2.0, 4.0, 8.0))

    def dead(seconds: float) -> Fault:
        return faults.ScannerDead("scanner_dead", at, seconds)

    slips = lasting.map(lambda s: (faults.WheelSlip("wheel_slip", at, s), dead(s)))
    lost = lasting.map(lambda s: (faults.Kidnap("kidnap", at), dead(s)))
    dirt = faults.ScannerDirty("scanner_dirty", at, 8.0, "both", 0.4)
    hints = st.sampled_from((0.3, 1.0)).map(
        lambda off: (dirt, faults.WrongHint("wrong_hint", at + 1.0, off, 15.0))
    )
    return st.one_of(slips, lost, hints)


def starts(place: str) -> SearchStrategy[Start]:
    """Return a strategy of starts at a place."""
    about = drawn(Start, at=(place,), known=("about",), off=(0.0, 0.5), turned=(0.0, 10.0))
    known = st.just(Start(at=place))
    return st.one_of(known, known, about, about, st.just(Start(at=place, known="nothing")))


def hands() -> SearchStrategy[Operator]:
    """Return a strategy of people at an arm, who also drive with it."""
    spots = ((0.25, 0.0, 0.10), (0.20, 0.15, 0.0), (0.22, 0.0, -0.15), (0.6, 0.2, 0.3))
    rates = ((0.6, 0.0, 0.0, 0.0, 0.0), (0.0, -0.5, 0.5, 0.0, 0.0), (1.0,) * 5)
    jumps = ((-0.4, 0.4, 0.4), (0.73, 0.0, 0.0), (0.0, 0.05, 0.0))
    lasting = (2.0, 1.0, 4.0)
    task: list[SearchStrategy[tasks.Task]] = [
        drawn(tasks.Move, to=("ready", "stow", "floor")),
        drawn(tasks.Reach, to=spots, lasting=(4.0,)),
        drawn(tasks.Sweep, radius=(0.05, 0.0, 0.15), cone=(0.0, 20.0), lasting=lasting),
        drawn(tasks.Roam, far=(0.3, 0.6), speed=(0.3, 1.0), lasting=lasting),
        drawn(tasks.Clutch, times=(5,)),
        drawn(tasks.Lose, by=jumps, drift=(0.0, 0.3), said=st.booleans()),
        drawn(tasks.Jog, rates=rates, lasting=lasting),
        drawn(tasks.Drive, speed=(0.5, -0.5, 0.0), turn=(0.0, 1.0), lasting=lasting),
        drawn(tasks.Wait),
    ]
    several = st.lists(st.one_of(task), min_size=4, max_size=8).map(tuple)
    return drawn(operators.Hand, tasks=several)


@st.composite
def sessions(draw: DrawFn) -> Scenario:
    """Draw a session; where it starts, its goal must be another place.

    Whether it has an arm is drawn last, so that all others are what they were without arms.
    """
    session = draw(without_arm())
    if not draw(st.sampled_from((*(False,) * 5, True))):
        return session
    first, second = draw(hands()), draw(st.one_of(st.just(session.second), hands()))
    world = replace(session.world, arm="s2", scanner=NO_SCANNERS, effects=False)
    start = Start(at=session.start.at)
    return replace(session, world=world, start=start, operator=first, second=second)


@st.composite
def without_arm(draw: DrawFn) -> Scenario:
    """Draw a session of a robot without an arm."""
    scene = draw(st.sampled_from(SCENES))
    places = places_of(scene)
    start = draw(st.sampled_from(places))
    goal = draw(st.sampled_from([place for place in places if place != start]))
    return Scenario(
        format=1,
        name="fuzz",
        seed=draw(st.integers(0, 9999)),
        world=WorldSettings(
            scene=scene,
            alive=draw(st.sampled_from((False, False, True))),
            effects=draw(st.sampled_from((False, False, False, False, True))),
        ),
        start=draw(starts(start)),
        mission=Mission(goals=(Goal(at=goal),), time_limit=DURATION),
        operator=draw(driving()),
        second=draw(st.one_of(st.none(), driving())),
        roles=draw(st.sampled_from(ROLES)),
        fault=tuple(chain(*draw(st.lists(together(scene), max_size=MOST_FAULTS))))[:MOST_FAULTS],
        limits=Limits(goals=False, violations=1_000_000, rules=True),
    )


def draw_session(seed: int) -> Scenario | None:
    """Return the session that a number stands for; None if it stands for none.

    Hypothesis' engine would draw many that are nearly alike; its interface for other fuzzers takes random bytes.
    """
    found: list[Scenario] = []

    @settings(database=None, deadline=None, suppress_health_check=list(HealthCheck))
    @given(sessions())
    def keep(scenario: Scenario) -> None:
        found.append(scenario)

    handle: Any = keep
    handle.hypothesis.fuzz_one_input(Random(seed).randbytes(_BYTES))
    return found[0] if found else None
