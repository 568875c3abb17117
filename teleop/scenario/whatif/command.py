"""The command ``farsteer whatif``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import tyro

from localization.cli.terminal import Progress, fitted, remark, say, say_json
from localization.extras import has, missing, require
from teleop.errors import SettingError
from teleop.scenario.run_files import RUN_FILES

if TYPE_CHECKING:
    from teleop.scenario.files.faults import Fault
    from teleop.scenario.referee.outcome import Outcome
    from teleop.scenario.whatif.fork import Futures

PAGE: Final = "whatif.html"
RECORDING: Final = "whatif.rrd"
FILES: Final = (*RUN_FILES, PAGE, RECORDING)
"""Names of the files of a fork."""


@dataclass(frozen=True)
class WhatIf:
    """Fork a recorded run at a time: what if the link had been slower, or the robot carried off?

    The run is repeated, and run once more with a fault from --at on; up to there both are the same to the bit,
    which is verified. An operator of the library drives anew after the fork (closed loop). A client of your own
    cannot: what it sent is delayed or lost as the fault has it, and nobody reacts (open loop), which the report
    says. whatif.html and whatif.rrd show both futures side by side; the fork is a run like any other, to be
    repeated by `farsteer scenario replay` and forked again.

    Examples: `farsteer whatif runs/x --at 41.2 --delay 0.5`, `farsteer whatif runs/x --at 10 --kidnap lobby`.

    The exit status is 0 if the fork keeps all limits, and 1 if it misses one.
    """

    run: Annotated[Path, tyro.conf.Positional]
    """Folder of a run of a scenario, such as runs/2026-01-31T12-00-00."""
    at: float
    """Time of the fork [s]; a tick is 0.02 s."""
    delay: float = 0.0
    """Additional delay of the link, in each direction [s]."""
    jitter: float = 0.0
    """Largest additional delay that is drawn for each message [s]."""
    blackout: float = 0.0
    """Time for which nothing gets through [s]."""
    kidnap: str = ""
    """Place that the robot is carried to: a name, X,Y or X,Y,HEADING [m, degrees], or anywhere."""
    slip: float | None = None
    """Speed of the wheels over that of the ground, such as 2."""
    kill: bool = False
    """The operator's program dies."""
    lasting: float | None = None
    """How long delay and jitter last, to the end by default, or the slip, 1 s by default [s]."""
    operator: Annotated[str | None, tyro.conf.arg(metavar="MODULE:CLASS")] = None
    """The operator of your own that drove the run, if there was one."""
    out: Path | None = None
    """Folder for the fork; one in the run's folder unless given."""
    overwrite: bool = False
    """Replace the files of an earlier fork in --out."""
    json: bool = False
    """Print the results as JSON."""

    def __call__(self) -> int:
        """Fork, report, and return the exit status of the fork."""
        for library in ("mujoco", "pydantic", "websockets"):
            require(library, "a what-if")

        from localization.cli.run_folder import check_folder, remove_earlier, writing_to
        from teleop.scenario.scenario_runs import operator_named
        from teleop.scenario.whatif.fork import fork

        faults, words = self._faults()
        out = self.out or self.run / f"whatif-at-{self.at:g}-{'-'.join(words)}"
        if out.resolve() == self.run.resolve():
            raise SettingError(f"--out {out} is the run itself: give another folder")
        operator = None if self.operator is None else operator_named(self.operator)
        check_folder(out, FILES, overwrite=self.overwrite)
        self._check_place()
        bar = Progress()
        with writing_to(out):
            remove_earlier(out, FILES)
            futures = fork(self.run, self.at, faults, out, operator=operator, progress=bar)
            bar(1.0, "writing the report")
            _write(futures, self.run, out)
        bar.end()
        return self._report(futures, out)

    def _faults(self) -> tuple[tuple[Fault, ...], list[str]]:
        """Return what the fork adds, and words for the name of its folder."""
        from teleop.scenario.files.errors import ScenarioError
        from teleop.scenario.files.reading import scenario_from

        lasting = {} if self.lasting is None else {"lasting": self.lasting}
        asked: list[tuple[str, dict[str, object]]] = []
        if self.delay or self.jitter:
            name = f"delay-{self.delay:g}" + (f"-jitter-{self.jitter:g}" if self.jitter else "")
            values = {"delay": self.delay, "jitter": self.jitter}
            asked.append((name, {"kind": "link", **values, **lasting}))
        if self.blackout:
            name = f"blackout-{self.blackout:g}"
            asked.append((name, {"kind": "link", "blackout": True, "lasting": self.blackout}))
        if self.kidnap:
            word = re.sub(r"[^A-Za-z0-9.]+", "-", self.kidnap).strip("-.")
            asked.append((f"kidnap-{word}", {"kind": "kidnap", "to": _place(self.kidnap)}))
        if self.slip is not None:
            asked.append(
                (f"slip-{self.slip:g}", {"kind": "wheel_slip", "factor": self.slip, **lasting})
            )
        if self.kill:
            asked.append(("kill", {"kind": "operator_killed"}))
        if not asked:
            raise SettingError(
                "what is different? give --delay, --jitter, --blackout, --kidnap, --slip or --kill"
            )
        faults = [{"at": self.at, **table} for _, table in asked]
        try:
            # As from a file, so that values are checked by the same rules.
            made = scenario_from({"format": 1, "name": "whatif", "fault": faults})
        except ExceptionGroup as group:
            errors = [e for e in group.exceptions if isinstance(e, ScenarioError)]
            texts = [f"--{e.path[-1] if e.path else 'at'}: {e.message}" for e in errors]
            raise SettingError("; ".join(texts)) from None
        return made.fault, [name for name, _ in asked]

    def _check_place(self) -> None:
        """Refuse a place where the robot cannot stand, before the run is repeated."""
        if not self.kidnap or self.kidnap == "anywhere":
            return

        from teleop.scenario.session.places import pose_of
        from teleop.scenario.session.recorded_run import read_run
        from teleop.scenario.session.scene import scene_of

        scenario = read_run(self.run).scenario
        pose_of(scene_of(scenario, self.run).world, _place(self.kidnap))

    def _report(self, futures: Futures, out: Path) -> int:
        from localization.report.plain_text import plain_text
        from teleop.scenario.reports.table import verdict
        from teleop.scenario.whatif.futures_page import NAMES, loop_sentences, what_if

        forked = futures.forked
        if self.json:
            say_json(_plain(futures, out))
            return int(forked.status)
        say(*fitted(f"what if {what_if(futures)}?"))
        for name, outcome in zip(NAMES, (futures.actual, forked), strict=True):
            details = "; ".join(map(plain_text, verdict(outcome).details))
            text = f"{outcome.status.name.lower()}, {plain_text(outcome.ending)}"
            say(*fitted(f"{name:15}  {text}{': ' if details else ''}{details}"))
        say(*fitted(*loop_sentences(futures)), f"files in {out}/")
        return int(forked.status)


def _place(text: str) -> str | tuple[float, float] | tuple[float, float, float]:
    """Return a place: a name, or coordinates."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        return text
    if len(numbers) == 2:
        return numbers[0], numbers[1]
    if len(numbers) == 3:
        return numbers[0], numbers[1], numbers[2]
    raise SettingError(f"--kidnap {text}: give a name, X,Y or X,Y,HEADING")


def _write(futures: Futures, run: Path, out: Path) -> None:
    from teleop.scenario.reports.run_reports import write_reports
    from teleop.scenario.session.scene import scene_of
    from teleop.scenario.whatif.futures_page import page

    cloud = scene_of(futures.actual.scenario, run).cloud
    (out / PAGE).write_text(page(futures, cloud.points), encoding="utf-8")
    write_reports(futures.forked, out, cloud.points)
    if not has("rerun"):
        remark(f"note: no {RECORDING}: {missing('rerun')}")
        return

    from localization.display.futures_recording import write_futures
    from teleop.scenario.whatif.recorded_futures import futures_of

    write_futures(out / RECORDING, cloud, futures_of(futures, run, out))


def _plain(futures: Futures, out: Path) -> dict[str, object]:
    return {
        "at": futures.at / 1e9,
        "common_sha256": futures.common,
        "closed_loop": futures.is_closed_loop,
        "why_open_loop": futures.open_loop or None,
        "as_it_was": _facts(futures.actual),
        "with_the_fault": _facts(futures.forked),
        "folder": out,
    }


def _facts(outcome: Outcome) -> dict[str, object]:
    return {
        "status": outcome.status.name.lower(),
        "ending": outcome.ending,
        "figures": outcome.figures,
        "sha256": outcome.sha256,
    }
