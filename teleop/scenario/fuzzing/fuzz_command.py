"""The command ``farsteer fuzz``."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from localization.cli.terminal import Progress, remark, say
from localization.extras import require
from teleop.errors import SettingError

if TYPE_CHECKING:
    from teleop.scenario.fuzzing.campaign import Failure
    from teleop.scenario.fuzzing.judged_session import JudgedSession


@dataclass(frozen=True)
class Fuzz:
    """Draw sessions of every kind, judge them by rules that hold in every run, and shrink what breaks one.

    A session is a world, a start, one or two operators, links and faults, all drawn from its number; it runs in
    lockstep, so that the same number gives the same bits. A session that breaks a rule is shrunk to the smallest one
    that still does, and written as a scenario file: `farsteer scenario run FILE` shows it, and it is a test from
    then on.

    Exit status: 0 nothing was found, 1 a rule was broken or a share is not what it was, 2 bad input.
    """

    hours: float | None = None
    """Time after which no session is begun [h]; until --sessions have run, unless given."""
    sessions: int = 500
    """Number of sessions, unless --hours are given."""
    jobs: int = 0
    """Number of processes; 0 for one on each core."""
    first: int = 0
    """Number of the first session; the others follow."""
    out: Path = Path("fuzz")
    """Folder for the scenario files of what is found."""
    shrinking: Annotated[bool, tyro.conf.arg(name="shrink")] = True
    """Shrink what is found."""
    failures: int = 20
    """Stop after so many failures."""
    rules: bool = False
    """List the rules and end."""
    reference: bool = False
    """Print the shares of these sessions as the file of the reference, and compare with nothing."""

    def __call__(self) -> int:
        """Fuzz and report."""
        require("hypothesis", "drawing sessions")
        if self.rules:
            return _list_rules()
        if self.sessions < 1 or (self.hours is not None and not self.hours > 0.0):
            raise SettingError("sessions must be >= 1, and hours > 0")
        if self.jobs < 0 or self.first < 0:
            raise SettingError("jobs and first must be >= 0")
        return self._run()

    def _run(self) -> int:
        from itertools import count, islice

        from teleop.scenario.fuzzing.campaign import campaign

        jobs = self.jobs or os.cpu_count() or 1
        numbers = count(self.first) if self.hours else islice(count(self.first), self.sessions)
        seconds = 3600.0 * self.hours if self.hours else float("inf")
        judged: list[JudgedSession] = []
        found: list[Failure] = []
        bar, wall, unusable = Progress(), 0.0, 0
        for done in campaign(numbers, jobs=jobs, seconds=seconds, shrinking=self.shrinking):
            if done.judged is None:
                unusable += 1
                continue
            judged.append(done.judged)
            wall += done.judged.wall
            share = wall / jobs / seconds if self.hours else len(judged) / self.sessions
            bar(min(share, 1.0), f"{len(judged)} sessions, {len(found)} failures")
            if done.failure is not None:
                found.append(done.failure)
                remark(f"\n{_described(done.failure, _written(done.failure, self.out))}")
                if len(found) >= self.failures:
                    break
        bar(1.0, f"{len(judged)} sessions, {len(found)} failures")
        return self._report(judged, found, unusable, wall)

    def _report(
        self, judged: list[JudgedSession], found: list[Failure], unusable: int, wall: float
    ) -> int:
        from teleop.scenario.fuzzing.session_statistics import (
            compare,
            reference,
            reference_of,
            to_json,
        )

        if not judged:
            raise SettingError("no session could be run; try other numbers by --first")
        if self.reference:
            say(to_json(reference_of(judged)))
            return int(bool(found))
        robot = sum(each.seconds for each in judged)
        say(
            f"{len(judged)} sessions of {robot / len(judged):.1f} s on average, {unusable} numbers without one"
        )
        say(
            f"{3600.0 * len(judged) / wall:.0f} sessions and {robot / wall:.1f} h of the robot per hour of a core"
        )
        alarms = [each for each in compare(judged, reference()) if each.count]
        for each in alarms:
            word = "DIFFERS" if each.differs else "as ever"
            say(
                f"{word}  {each.name}: {each.value:.3g}, {each.expected:.3g} expected, n {each.count}"
            )
        say(f"{len(found)} sessions broke a rule" + (f"; files in {self.out}" if found else ""))
        return int(bool(found) or any(each.differs for each in alarms))


def _list_rules() -> int:
    from teleop.scenario.referee.rules.rule_book import RULES

    for rule in RULES:
        say(f"{rule.name:15} {rule.sentence}")
    return 0


def _written(failure: Failure, folder: Path) -> Path:
    """Write the shrunk session as a scenario file, and return its path."""
    from dataclasses import replace

    from teleop.scenario.files.writing import scenario_text

    folder.mkdir(parents=True, exist_ok=True)
    name = f"{failure.broken.rule}-{failure.number}"
    path = folder / f"{name}.toml"
    text = f"Rule {failure.broken.rule}: {failure.broken.how}"
    named = replace(failure.shrunk, name=name, description=text)
    path.write_text(scenario_text(named), encoding="utf-8")
    return path


def _described(failure: Failure, path: Path) -> str:
    broken, before, after = failure.broken, failure.drawn, failure.shrunk
    return (
        f"session {failure.number}: rule {broken.rule} is broken at {broken.stamp * 1e-9:.2f} s: {broken.how}\n"
        f"  {len(before.fault)} faults, shrunk to {len(after.fault)}: {path}"
    )
