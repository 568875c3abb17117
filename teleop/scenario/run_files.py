"""Names of the files of a run of a scenario, known before anything is imported that runs one."""

from __future__ import annotations

from typing import Final

RUN_FILES: Final = (
    "client.log",
    "commands.jsonl",
    "estimate.tum",
    "inbox.jsonl",
    "junit.xml",
    "notes.jsonl",
    "operator.rrd",
    "outcome.json",
    "readings.mcap",
    "report.html",
    "run.png",
    "scenario.json",
    "steps.csv",
    "summary.json",
    "trace.csv",
    "truth.tum",
)
"""Those that a run replaces with --overwrite."""
