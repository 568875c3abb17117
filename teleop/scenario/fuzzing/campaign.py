"""A campaign: sessions on several cores until time is up, the failures shrunk, the rest counted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace
from itertools import islice

from robot_sim import SimulationError
from teleop.clock import wall_seconds
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.fuzzing.drawing import draw_session
from teleop.scenario.fuzzing.judged_session import JudgedSession, judge_session
from teleop.scenario.fuzzing.shrinking import shrink
from teleop.scenario.referee.rules.rule import Broken
from teleop.scenario.worker_pool import worker_pool

_AGAIN = 20
"""Of so many sessions one is run twice, and must give the same bits."""


@dataclass(frozen=True, slots=True)
class Failure:
    """A session that broke a rule, and the smallest one found that does."""

    number: int
    """Number of the session."""
    drawn: Scenario
    """The session as it was drawn."""
    broken: Broken
    """The rule, and how the drawn session broke it."""
    shrunk: Scenario
    """The smallest one; the drawn one, if it was not shrunk."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """What became of one number."""

    number: int
    """Number of the session."""
    judged: JudgedSession | None
    """The session; None if the number stands for none that can be run."""
    failure: Failure | None = None
    """How it failed, if it did."""


def attempt(number: int, *, shrinking: bool = True) -> Attempt:
    """Draw the session of a number, run it, and shrink it if it breaks a rule."""
    scenario = draw_session(number)
    judged = None if scenario is None else _judged(scenario)
    if scenario is None or judged is None:
        return Attempt(number, None)
    if not judged.broken and number % _AGAIN == 0:
        again = judge_session(scenario)
        if again.sha256 != judged.sha256:
            how = f"digest {judged.sha256[:12]} and, when run again, {again.sha256[:12]}"
            judged = replace(judged, broken=(Broken("same-bits", 0, how),))
    if not judged.broken:
        return Attempt(number, judged)
    broken = judged.broken[0]
    smallest = scenario
    if shrinking and broken.stamp:
        smallest = shrink(
            scenario, broken.stamp * 1e-9, lambda smaller: broken_at(smaller, broken.rule)
        )
    return Attempt(number, judged, Failure(number, scenario, broken, smallest))


def broken_at(scenario: Scenario, rule: str) -> float | None:
    """Return the robot time at which a session breaks a rule [s]; None if it does not, or cannot be run."""
    judged = _judged(scenario)
    if judged is None:
        return None
    times = [broken.stamp * 1e-9 for broken in judged.broken if broken.rule == rule]
    return times[0] if times else None


def _judged(scenario: Scenario) -> JudgedSession | None:
    begun = wall_seconds()
    try:
        return judge_session(scenario)
    except SimulationError:
        return None  # a goal that cannot be reached, for instance
    except Exception as error:
        # Whatever a client does, the robot's program must not fall.
        broken = Broken("no-crash", 0, f"{type(error).__name__}: {error}")
        return JudgedSession((broken,), 0.0, wall_seconds() - begun, "", (), math.nan, math.nan)


def campaign(
    numbers: Iterable[int],
    *,
    jobs: int,
    seconds: float,
    shrinking: bool = True,
) -> Iterator[Attempt]:
    """Yield what became of the numbers, as they are done, until time is up.

    Args:
        numbers: Numbers of sessions, in the order in which they are begun.
        jobs: Number of processes.
        seconds: Real time after which none is begun [s].
        shrinking: Whether failures are shrunk.

    Raises:
        TeleopError: If one of the processes was killed.
    """
    begun, waiting = wall_seconds(), iter(numbers)
    with worker_pool(jobs) as pool:
        running: set[Future[Attempt]] = {
            pool.submit(attempt, number, shrinking=shrinking) for number in islice(waiting, jobs)
        }
        while running:
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for each in done:
                yield each.result()
                if wall_seconds() - begun < seconds:
                    for number in islice(waiting, 1):
                        running.add(pool.submit(attempt, number, shrinking=shrinking))
