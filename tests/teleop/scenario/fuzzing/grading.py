"""Grades the fuzzer by mutants of the robot: ``python -m tests.teleop.scenario.fuzzing.grading [NAMES]``.

Each mutant is looked for in sessions of consecutive numbers, in a process of its own, until a rule is broken or the
budget is used up; then the statistics are asked. A line says which rule found it, after how many sessions and
seconds, and how many events the shrunk session has.
"""

from __future__ import annotations

import argparse
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from teleop.clock import wall_seconds
from teleop.scenario.fuzzing.campaign import attempt
from teleop.scenario.fuzzing.judged_session import JudgedSession
from teleop.scenario.fuzzing.session_statistics import compare, reference


@dataclass(frozen=True)
class Grade:
    """How a mutant was found."""

    name: str
    """Name of the mutant."""
    rule: str
    """The rule, or the share, that found it; empty if none did."""
    sessions: int
    """Number of sessions that were run."""
    seconds: float
    """Real time that they took, with the shrinking [s]."""
    events: int
    """Number of faults of the shrunk session; -1 without one."""


def grade(name: str, first: int, most: int, seconds: float) -> Grade:
    """Apply a mutant to this process, and look for it."""
    from tests.teleop.scenario.fuzzing.arm_mutants import ARM_MUTANTS
    from tests.teleop.scenario.fuzzing.robot_mutants import MUTANTS

    (MUTANTS | ARM_MUTANTS)[name]()
    begun = wall_seconds()
    judged: list[JudgedSession] = []
    for number in range(first, first + most):
        done = attempt(number)
        if done.judged is None:
            continue
        judged.append(done.judged)
        spent = wall_seconds() - begun
        if done.failure is not None:
            events = len(done.failure.shrunk.fault)
            return Grade(name, done.failure.broken.rule, len(judged), spent, events)
        if len(judged) % 20 == 0 or spent > seconds:
            differing = [each for each in compare(judged, reference()) if each.differs]
            if differing:
                return Grade(name, differing[0].name, len(judged), spent, -1)
        if spent > seconds:
            break
    return Grade(name, "", len(judged), wall_seconds() - begun, -1)


def main() -> None:
    """Grade."""
    from tests.teleop.scenario.fuzzing.arm_mutants import ARM_MUTANTS
    from tests.teleop.scenario.fuzzing.robot_mutants import MUTANTS

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "names", nargs="*", default=[*MUTANTS, *ARM_MUTANTS], help="mutants; all by default"
    )
    parser.add_argument("--first", type=int, default=0, help="number of the first session")
    parser.add_argument("--most", type=int, default=200, help="largest number of sessions")
    parser.add_argument("--seconds", type=float, default=240.0, help="budget of each [s]")
    parser.add_argument("--jobs", type=int, default=2, help="number of processes")
    options = parser.parse_args()
    context = multiprocessing.get_context("spawn")
    found = 0
    # A mutant stays in its process, so that each has one of its own.
    with ProcessPoolExecutor(options.jobs, mp_context=context, max_tasks_per_child=1) as pool:
        running = [
            pool.submit(grade, name, options.first, options.most, options.seconds)
            for name in options.names
        ]
        for each in running:
            g = each.result()
            found += bool(g.rule)
            print(  # noqa: T201
                f"{g.name:28} {g.rule or 'NOT FOUND':24} {g.sessions:4} sessions {g.seconds:6.0f} s"
                f" {g.events if g.events >= 0 else '-':>3} events",
                flush=True,
            )
    print(f"{found} of {len(running)} found")  # noqa: T201


if __name__ == "__main__":
    main()
