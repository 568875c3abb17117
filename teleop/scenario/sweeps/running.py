"""One run of a sweep: what a worker does, and what it answers."""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from robot_sim import SimulationError
from teleop.clock import Stopwatch
from teleop.errors import TeleopError
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.referee.outcome import ExitStatus, Outcome
from teleop.scenario.session.run import run_scenario

STAGES = ("set-up", "simulation", "localiser", "referee", "wire")
"""Where the time of a run goes; ``wire`` is the frames both ways, and the operator."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """What a run has shown; only ``times`` differs from one machine to the next."""

    verdict: str
    """``passed``, ``missed`` or ``bad input``."""
    ending: str
    """Why the run ended, or why it could not begin."""
    missed: str
    """Names of the limits that were missed, with commas."""
    figures: dict[str, float]
    """All figures; empty if it could not begin."""
    sha256: str
    """Digest of the trajectory; empty if it could not begin."""
    times: dict[str, float]
    """Robot time, processor time, and real time of each stage [s]."""


_DECIDING: Final = ("farsteer", "numpy", "mujoco-core", "kiss-icp")
"""Distributions whose versions decide the bits."""


def deciding_versions() -> dict[str, str]:
    """Return the versions of what decides the bits of a run, by distribution."""
    return {name: version(name) for name in _DECIDING}


def run_one(scenario: str, beside: str | None) -> dict[str, Any]:
    """Run a scenario; called in a worker, so that what goes in and comes out is plain.

    Args:
        scenario: The scenario as JSON.
        beside: Folder of its file, for the files that it names.

    Returns:
        The fields of a ``RunResult``.
    """
    watch = Stopwatch()
    begun = time.process_time()
    with watch.stage("total"):
        result, seconds = _judged(SCHEMA.validate_json(scenario), beside, watch)
    stages = {name: sum(laps) for name, laps in watch.laps.items() if name in STAGES}
    rest = sum(watch.laps["total"]) - sum(stages.values())
    times = {"robot": seconds, "processor": time.process_time() - begun, **stages, "wire": rest}
    return {**result, "times": times}


def _judged(
    scenario: Scenario, beside: str | None, watch: Stopwatch
) -> tuple[dict[str, Any], float]:
    try:
        outcome = run_scenario(
            scenario, beside=None if beside is None else Path(beside), stage=watch.stage
        )
    except (TeleopError, SimulationError) as error:
        text = " ".join(str(error).split())
        empty = {"verdict": "bad input", "ending": text, "missed": "", "figures": {}, "sha256": ""}
        return empty, 0.0
    return _fields(outcome), outcome.robot_seconds


def _fields(outcome: Outcome) -> dict[str, Any]:
    return {
        "verdict": "passed" if outcome.status is ExitStatus.PASSED else "missed",
        "ending": outcome.ending,
        "missed": ",".join(check.name for check in outcome.checks if not check.met),
        "figures": outcome.figures,
        "sha256": outcome.sha256,
    }
