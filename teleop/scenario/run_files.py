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
    "outcome.json",
    "readings.mcap",
    "report.html",
    "scenario.json",
    "steps.csv",
    "trace.csv",
    "truth.tum",
)
"""Those that a run replaces with --overwrite."""
