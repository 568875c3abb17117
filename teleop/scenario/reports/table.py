"""One table for many outcomes, in the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from localization.cli.terminal import WIDTH
from localization.report.plain_text import plain_text
from teleop.scenario.referee.outcome import ExitStatus, Outcome
from teleop.scenario.reports.limit_text import limit_sentence

_WORDS = {
    ExitStatus.PASSED: "passed",
    ExitStatus.MISSED: "MISSED",
    ExitStatus.BAD_INPUT: "BAD INPUT",
    ExitStatus.CLIENT_FAILED: "CLIENT FAILED",
}


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the table says of one scenario."""

    name: str
    """Name of the scenario, or of the file that could not be read."""
    status: ExitStatus
    """The verdict."""
    seconds: float
    """Robot time [s]."""
    factor: float
    """Robot time over real time."""
    details: tuple[str, ...]
    """Why it did not pass: the limits that were missed, or what went wrong."""
    folder: str
    """Folder of the run; empty if there is none."""


def verdict(outcome: Outcome, folder: str = "") -> Verdict:
    """Return the line of an outcome."""
    details = tuple(limit_sentence(check) for check in outcome.checks if not check.met)
    if outcome.failure:
        details = (outcome.failure, *details)
    return Verdict(
        outcome.scenario.name,
        outcome.status,
        outcome.robot_seconds,
        outcome.factor,
        details,
        folder,
    )


def table(verdicts: Sequence[Verdict]) -> list[str]:
    """Return the lines of the table; below each scenario that did not pass it says why."""
    name_width = min(max([8, *(len(v.name) for v in verdicts)]), WIDTH - 40)
    lines = [f"{'scenario':{name_width}}  {'verdict':13}  {'robot time':>10}  {'factor':>7}"]
    for each in verdicts:
        ran = each.status is not ExitStatus.BAD_INPUT
        times = f"{each.seconds:8.1f} s  {each.factor:6.1f}x" if ran else ""
        line = f"{plain_text(each.name):{name_width}}  {_WORDS[each.status]:13}  {times}"
        lines.append(line.rstrip())
        lines += [f"    {plain_text(detail)}" for detail in each.details]
        if each.folder and each.status is not ExitStatus.PASSED:
            lines.append(f"    see {each.folder}/report.html")
    passed = sum(v.status is ExitStatus.PASSED for v in verdicts)
    return [*lines, f"{passed} of {len(verdicts)} passed"]
