"""One trial: the run of a scenario in which steps are driven on one surface, in one way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from teleop.scenario.files.limits import Limits
from teleop.scenario.files.operator_settings import Method, Steps
from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.scenario import NO_SCANNERS, Mission, Scenario
from teleop.scenario.files.shipped import shipped_files
from teleop.scenario.operators.steps import StepOperator
from teleop.scenario.precision.ways import Trial, Ways
from teleop.scenario.session.run import run_scenario

NAME: Final = "steps-on-carpet"
"""The shipped scenario that a trial changes."""
_LONGEST: Final = 86_400.0
"""Time limit of a trial, which is over after its last step [s]."""


def trial_scenario(scene: str, surface: str, by: Method, count: int, seed: int) -> Scenario:
    """Return the scenario of a trial; the robot has scanners only if it measures its steps by the localiser.

    Args:
        scene: The scene; the robot begins at its spawn.
        surface: Surface of the whole ground.
        by: What the steps are measured by.
        count: Number of steps.
        seed: Seed of the steps and of the sensors' errors.
    """
    shipped = read_scenario(shipped_files()[NAME])
    scanner = shipped.world.scanner if by == "localization" else NO_SCANNERS
    return replace(
        shipped,
        seed=seed,
        world=replace(shipped.world, scene=scene, surface=surface, scanner=scanner),
        mission=Mission(time_limit=_LONGEST),
        operator=Steps("steps", count, by),
        limits=Limits(),
    )


def run_trial(scenario: Scenario, *, progress: Callable[[int], None] = lambda done: None) -> Trial:
    """Run the scenario of a trial.

    Args:
        scenario: The scenario.
        progress: Called now and then with the number of steps that have been driven.

    Raises:
        ScenarioError: If it cannot be run in its world.
        StepError: If a step does not end.
    """
    steps = scenario.operator
    assert isinstance(steps, Steps)
    assert scenario.world.surface is not None
    operator, ways = StepOperator(steps), Ways()
    run_scenario(
        scenario,
        operator=operator,
        observers=(ways.take,),
        progress=lambda share, text: progress(len(operator.driven)),
    )
    return Trial(scenario.world.surface, steps.by, ways.of(operator.driven))
