"""The reports of a run in its folder: page, JSON and JUnit XML."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from localization.geometry import FloatArray
from teleop.scenario.referee.outcome import Outcome
from teleop.scenario.reports.json_report import outcome_json
from teleop.scenario.reports.junit import junit
from teleop.scenario.reports.run_page import page

PAGE: Final = "report.html"
JSON: Final = "outcome.json"
JUNIT: Final = "junit.xml"

CLIENT_LOG: Final = "client.log"
"""What a client has printed, if there was one."""

_LINES: Final = 60
"""Number of its last lines that the page shows."""


def write_reports(outcome: Outcome, folder: Path, points: FloatArray | None = None) -> None:
    """Write all reports of an outcome.

    Args:
        outcome: The outcome.
        folder: An existing folder.
        points: (N, 3) points of the map's cloud in ``map`` [m], for the page.
    """
    printed = _end_of(folder / CLIENT_LOG)
    (folder / PAGE).write_text(page(outcome, points, printed), encoding="utf-8")
    (folder / JSON).write_text(outcome_json(outcome), encoding="utf-8")
    (folder / JUNIT).write_bytes(junit([outcome]))


def _end_of(log: Path) -> str:
    """Return the last lines of a log, which may be of any size and hold any bytes."""
    try:
        with log.open("rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - 200 * _LINES))
            text = file.read().decode("utf-8", "replace")
    except FileNotFoundError:
        return ""
    return "\n".join(text.strip().splitlines()[-_LINES:])
