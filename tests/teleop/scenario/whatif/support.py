"""A drive of some seconds in the corridor, recorded as a run, and the same as if a client of one's own had driven."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from teleop.scenario.files.reading import scenario_from
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.reports.run_reports import write_reports
from teleop.scenario.session.run import run_scenario


def drive() -> Scenario:
    """Return a scenario of 3 s: the robot sets off along the corridor."""
    return scenario_from(
        {
            "format": 1,
            "name": "drive",
            "world": {"scene": "corridor"},
            "mission": {"time_limit": 3.0},
            "limits": {"stops": 0},
        }
    )


def record(folder: Path) -> Path:
    """Record this drive."""
    write_reports(run_scenario(drive(), folder), folder)
    return folder


def as_if_by_a_client(run: Path, folder: Path) -> Path:
    """Return a copy of a run that says that a client drove; its messages are the same."""
    shutil.copytree(run, folder)
    file = folder / "scenario.json"
    scenario = json.loads(file.read_text())
    scenario["operator"] = {"kind": "client", "patience": 30.0, "truth": False}
    file.write_text(json.dumps(scenario))
    return folder
