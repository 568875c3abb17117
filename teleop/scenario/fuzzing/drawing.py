"""One strategy that draws whole sessions: world, start, operators, link and faults.

Times are drawn in half seconds and figures from short lists, so that what is found stays readable.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import chain
from random import Random
from typing import Any, Final

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


def driving() -> SearchStrategy[Operator]:
    """Return a strategy of operators of the library."""
    speeds = st.sampled_from((0.5, 0.3, 0.7, 1.2))
    follower = st.builds(
        operators.Follower,
        kind=st.just("follower"),
        speed=speeds,
        interface=st.sampled_from(("joy", "cmd_vel")),
        rate=st.sampled_from((10.0, 5.0, 30.0)),
    )
    steering = st.builds(
        operators.Steering,
        kind=st.just("steering"),
        speed=speeds,
        reaction_time=st.sampled_from((0.3, 0.6)),
        lapses=st.sampled_from((0.0, 6.0)),
    )
    careless = st.builds(
        operators.Careless,
        kind=st.just("careless"),
        speed=speeds,
        mistakes=st.sampled_from((10.0, 30.0)),
        oddities=st.sampled_from((0.0, 20.0)),
    )
    return st.one_of(follower, steering, careless)


def lasting() -> SearchStrategy[float]:
    """Return a strategy of durations of faults."""
    return st.sampled_from((1.0, 0.5, 2.0, 4.0))


def link(at: SearchStrategy[float]) -> SearchStrategy[Fault]:
    """Return a strategy of bad links."""
    return st.builds(
        faults.Link,
        kind=st.just("link"),
        at=at,
        lasting=st.sampled_from((4.0, 1.0, 2.0, 8.0)),
        direction=st.sampled_from(("both", "up", "down")),
        delay=st.sampled_from((0.0, 0.2, 0.8, 1.5, 3.0)),
        jitter=st.sampled_from((0.0, 0.1, 0.5)),
        rate=st.sampled_from((0.0, 0.0, 20_000.0)),
        blackout=st.sampled_from((False, False, True)),
    )


def kidnap(at: SearchStrategy[float]) -> SearchStrategy[Fault]:
    """Return a strategy of robots that are carried off."""
    return st.builds(faults.Kidnap, kind=st.just("kidnap"), at=at, to=st.just("anywhere"))


def fault(scene: str) -> SearchStrategy[Fault]:
    """Return a strategy of faults in a scene; links and being carried off come twice as often as others."""
    at = halves(1.0, DURATION - 3.0)
    kinds: list[SearchStrategy[Fault]] = [
        link(at),
        link(at),
        st.builds(
            faults.OperatorKilled,
            kind=st.just("operator_killed"),
            at=at,
            silent=st.booleans(),
        ),
        kidnap(at),
        kidnap(at),
        st.builds(
            faults.WheelSlip,
            kind=st.just("wheel_slip"),
            at=at,
            lasting=lasting(),
            factor=st.sampled_from((2.0, 0.0, 1.3)),
        ),
        st.builds(
            faults.ScannerDead,
            kind=st.just("scanner_dead"),
            at=at,
            lasting=lasting(),
            scanner=st.sampled_from(("both", "laser_horizontal", "laser_vertical")),
        ),
        st.builds(
            faults.ScannerDirty,
            kind=st.just("scanner_dirty"),
            at=at,
            lasting=lasting(),
            share=st.sampled_from((0.2, 0.4)),
        ),
        st.builds(
            faults.WrongHint,
            kind=st.just("wrong_hint"),
            at=at,
            off=st.sampled_from((0.5, 2.0, 6.0)),
            turned=st.sampled_from((0.0, 30.0, 180.0)),
        ),
        st.builds(faults.EStopPressed, kind=st.just("estop"), at=at, lasting=lasting()),
        st.builds(
            faults.ClockStep,
            kind=st.just("clock_step"),
            at=at,
            step=st.sampled_from((5.0, -5.0, 0.4, -0.4)),
        ),
    ]
    if doors_of(scene):
        kinds.append(
            st.builds(
                faults.DoorClosed,
                kind=st.just("door_closed"),
                at=at,
                door=st.sampled_from(doors_of(scene)),
                lasting=lasting(),
            )
        )
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
    about = st.builds(
        Start,
        at=st.just(place),
        known=st.just("about"),
        off=st.sampled_from((0.0, 0.5)),
        turned=st.sampled_from((0.0, 10.0)),
    )
    known = st.just(Start(at=place))
    return st.one_of(known, known, about, about, st.just(Start(at=place, known="nothing")))


def hands() -> SearchStrategy[Operator]:
    """Return a strategy of people at an arm, who also drive with it."""
    spots = st.sampled_from(
        ((0.25, 0.0, 0.10), (0.20, 0.15, 0.0), (0.22, 0.0, -0.15), (0.6, 0.2, 0.3))
    )
    rates = st.sampled_from(((0.6, 0.0, 0.0, 0.0, 0.0), (0.0, -0.5, 0.5, 0.0, 0.0), (1.0,) * 5))
    jumps = st.sampled_from(((-0.4, 0.4, 0.4), (0.73, 0.0, 0.0), (0.0, 0.05, 0.0)))
    lasting = st.sampled_from((2.0, 1.0, 4.0))
    task: list[SearchStrategy[tasks.Task]] = [
        st.builds(tasks.Move, kind=st.just("move"), to=st.sampled_from(("ready", "stow", "floor"))),
        st.builds(tasks.Reach, kind=st.just("reach"), to=spots, lasting=st.just(4.0)),
        st.builds(
            tasks.Sweep,
            kind=st.just("sweep"),
            radius=st.sampled_from((0.05, 0.0, 0.15)),
            cone=st.sampled_from((0.0, 20.0)),
            lasting=lasting,
        ),
        st.builds(
            tasks.Roam,
            kind=st.just("roam"),
            far=st.sampled_from((0.3, 0.6)),
            speed=st.sampled_from((0.3, 1.0)),
            lasting=lasting,
        ),
        st.builds(tasks.Clutch, kind=st.just("clutch"), times=st.just(5)),
        st.builds(
            tasks.Lose,
            kind=st.just("lose"),
            by=jumps,
            drift=st.sampled_from((0.0, 0.3)),
            said=st.booleans(),
        ),
        *(st.builds(tasks.Jog, kind=st.just("jog"), rates=rates, lasting=lasting),) * 2,
        st.builds(
            tasks.Drive,
            kind=st.just("drive"),
            speed=st.sampled_from((0.5, -0.5, 0.0)),
            turn=st.sampled_from((0.0, 1.0)),
            lasting=lasting,
        ),
        st.builds(tasks.Wait, kind=st.just("wait")),
    ]
    return st.builds(
        operators.Hand,
        kind=st.just("hand"),
        tasks=st.lists(st.one_of(task), min_size=4, max_size=8).map(tuple),
    )


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
