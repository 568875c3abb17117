"""The scenarios that come with the project: all of them are run, and what they are for is judged."""

from __future__ import annotations

from dataclasses import fields
from typing import Final, get_args, get_type_hints

import pytest

from robot_sim import scene_names
from teleop.scenario.files.faults import Fault
from teleop.scenario.files.limits import Limits
from teleop.scenario.files.operator_settings import Operator
from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.files.shipped import shipped_files
from teleop.scenario.referee.outcome import ExitStatus, Outcome
from teleop.scenario.session.run import run_scenario

FILES: Final = shipped_files()
SCENARIOS: Final = {name: read_scenario(file) for name, file in FILES.items()}
FOLDER: Final = next(iter(FILES.values())).parent


def run(scenario: Scenario) -> Outcome:
    return run_scenario(scenario, beside=FOLDER)


def kinds(union: object) -> set[str]:
    """Return what ``kind`` may be in a union of faults or operators."""
    members = get_args(get_args(union)[0])
    return {get_args(get_type_hints(member)["kind"])[0] for member in members}


def test_there_are_at_least_thirty_with_a_description_each() -> None:
    assert len(SCENARIOS) >= 30
    for name, scenario in SCENARIOS.items():
        assert scenario.name == name
        assert len(scenario.description.split()) >= 10, name


def test_all_worlds_faults_and_operators_of_the_library_take_part() -> None:
    every = SCENARIOS.values()
    assert {s.world.scene for s in every} == set(scene_names())
    assert {fault.kind for s in every for fault in s.fault} == kinds(Fault)
    assert {s.operator.kind for s in every} == kinds(Operator) - {"client"}
    assert {s.start.known for s in every} == {"exactly", "about", "nothing"}


def test_each_but_the_tour_lasts_a_minute_at_most_and_each_has_limits_besides_its_goals() -> None:
    unless_given = Limits()
    names = {field.name for field in fields(Limits)} - {"goals", "violations"}
    for name, scenario in SCENARIOS.items():
        assert scenario.mission.time_limit <= 60.0 or scenario.mission.tour, name
        given = [n for n in names if getattr(scenario.limits, n) != getattr(unless_given, n)]
        assert len(given) >= 2, name


SHOWN: Final[dict[str, dict[str, tuple[float, float]]]] = {
    "arm-bad-trajectories": {"arm_refused": (3, 8)},
    "arm-drive-unstowed": {"distance": (3.0, 4.2)},
    "arm-drops-box": {"dropped": (1, 1)},
    "arm-mirror": {"mirror_error": (0.001, 0.03)},
    "arm-on-ramp": {"tilt": (0.3, 0.38)},
    "arm-out-of-reach": {"tip_moved": (0.35, 0.6)},
    "arm-stuck": {"load_max": (0.95, 1.0), "arm_contacts": (1, 3)},
    "arm-wrist-turns-over": {"arm_refused": (0, 0)},
    "courtyard-ramp": {"tilt": (0.05, 0.35)},
    "door-closed": {"goal_time": (13.0, 60.0)},
    "earth-rovers-29": {"stops": (1, 1), "runaway": (0.35, 0.7)},
    "from-ros-to-unity": {"hints": (1, 1), "lost": (0.2, 2.0)},
    "hint-wrong": {"hints": (2, 2)},
    "kidnapped": {"lost": (0.1, 30.0)},
    "link-lost-downwards": {"goal_time": (17.0, 45.0)},
    "link-lost-on-the-way": {"stops": (1, 1), "stopping_time": (0.5, 1.5)},
    "rosaria-51": {"stops": (1, 1), "runaway": (0.2, 0.6)},
    "start-about": {"lost": (0.1, 5.0)},
}
"""Figures that show that what a scenario is about has happened: least and greatest."""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SCENARIOS if name != "tour"])
def test_robot_passes(name: str) -> None:
    """The tour, whose station is a process of its own, is driven in ``test_tour.py``."""
    outcome = run(SCENARIOS[name])
    missed = [(check.name, check.value) for check in outcome.checks if not check.met]
    assert missed == []
    assert outcome.status is ExitStatus.PASSED
    for figure, (least, greatest) in SHOWN.get(name, {}).items():
        assert least <= outcome.figures[figure] <= greatest, figure
