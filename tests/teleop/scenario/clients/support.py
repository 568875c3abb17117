"""Small scenarios for clients that are not ours, and runs of them."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from localization.types import SECOND
from teleop.scenario.files.limits import Limits
from teleop.scenario.files.operator_settings import Client
from teleop.scenario.files.scenario import Goal, Mission, Scenario, WorldSettings
from teleop.scenario.referee.outcome import EventKind, Outcome
from teleop.scenario.session.run import replay_run, run_scenario
from tests.teleop.support import ROOT

PROGRAMS: Final = Path(__file__).parent / "programs"
STRAIGHT_ON: Final = Scenario(
    1,
    "straight-on",
    world=WorldSettings("corridor"),
    mission=Mission((Goal((5.0, 4.0)),), time_limit=30.0),
    operator=Client("client", patience=30.0),
    limits=Limits(contacts=0, stopping_time=1.5),
)
"""Two metres straight on, to 0.5 m; a loaded machine has time for it."""


def python(program: str, *arguments: str) -> str:
    """Return the command line of one of the programs here."""
    module = f"tests.teleop.scenario.clients.programs.{program}"
    words = shlex.join([sys.executable, "-m", module, *arguments])
    return f"PYTHONPATH={shlex.quote(str(ROOT))} exec {words}"


def scenario(
    time_limit: float = 30.0, patience: float = 30.0, *, truth: bool = False, **changes: Any
) -> Scenario:
    """Return the small scenario with changes."""
    return replace(
        STRAIGHT_ON,
        mission=replace(STRAIGHT_ON.mission, time_limit=time_limit),
        operator=Client("client", patience, truth),
        **changes,
    )


def run(folder: Path, command: str, judged: Scenario = STRAIGHT_ON, **options: Any) -> Outcome:
    """Run a scenario with a client."""
    return run_scenario(judged, folder, client=command, **options)


def said(outcome: Outcome, kind: EventKind) -> list[str]:
    """Return the texts of the events of a kind."""
    return [event.text for event in outcome.events if event.kind is kind]


def repeats(folder: Path, outcome: Outcome) -> bool:
    """Return whether a run repeats from its folder: to the bit, and with the same verdict for the same reasons."""
    again = replay_run(folder)
    judged = [(check.name, check.met) for check in outcome.checks]
    return (
        (again.sha256, again.status, again.ending)
        == (outcome.sha256, outcome.status, outcome.ending)
        and again.events == outcome.events
        and [(check.name, check.met) for check in again.checks] == judged
    )


def rests(outcome: Outcome) -> bool:
    """Return whether the robot stands still at the end."""
    return bool(np.abs(outcome.lines.speed[-1]).max() < 0.02)


def moved(outcome: Outcome) -> bool:
    """Return whether the robot has ever moved."""
    return bool(outcome.lines.speed[:, 0].max() > 0.3)


def lasted(outcome: Outcome) -> float:
    """Return how long the run took in robot time [s]."""
    return float(outcome.lines.stamps[-1]) / SECOND if len(outcome.lines.stamps) else 0.0
