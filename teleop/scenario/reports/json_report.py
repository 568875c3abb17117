"""An outcome as JSON: everything but the time lines, in plain values."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from localization.cli.terminal import plain
from teleop.scenario.files.scenario import SCHEMA
from teleop.scenario.referee.outcome import Outcome


def outcome_json(outcome: Outcome) -> str:
    """Return the text of ``outcome.json``; figures that are no numbers are null."""
    return json.dumps(outcome_values(outcome), indent=2, allow_nan=False) + "\n"


def outcome_values(outcome: Outcome) -> dict[str, Any]:
    """Return an outcome in the types of JSON, without its time lines."""
    return {
        "name": outcome.scenario.name,
        "status": outcome.status.name.lower(),
        "exit_status": int(outcome.status),
        "passed": outcome.status == 0,
        "ending": outcome.ending,
        "limits": [plain(check) for check in outcome.checks],
        "events": [{**plain(event), "kind": event.kind.value} for event in outcome.events],
        "figures": plain(outcome.figures),
        "command_ages": plain(np.round(outcome.command_ages, 6)),
        "ticks": len(outcome.lines.stamps),
        "sha256": outcome.sha256,
        "pace": outcome.pace,
        "factor": plain(outcome.factor),
        "replay": outcome.replay,
        "scenario": SCHEMA.dump_python(outcome.scenario, mode="json"),
    }
