"""The command ``farsteer scenario replay``: repeats a run to the bit, and compares the two."""

from __future__ import annotations

import json as json_module
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from localization.cli.terminal import Progress, say, say_json
from localization.extras import require
from teleop.errors import SettingError
from teleop.scenario.run_files import RUN_FILES

if TYPE_CHECKING:
    from localization.types import Pose
    from teleop.robot.tick_record import TickRecord
    from teleop.scenario.referee.outcome import Outcome


@dataclass(frozen=True)
class Replay:
    """Repeat a run to the bit, from what its folder holds, judge it again, and compare the two.

    Neither the client nor the operator takes part: the robot is given the messages that it took then, tick by
    tick. The exit status is 0 if trajectory, estimates, commands and the verdict are the same, and 1 if not.
    A run whose process was killed has neither verdict nor digest; its true poses are compared, and --out completes it.
    """

    run: Annotated[Path, tyro.conf.Positional]
    """Folder of a run, such as runs/2026-01-31T12-00-00."""
    out: Path | None = None
    """Folder for the files of the repeated run; without it, nothing is written."""
    overwrite: bool = False
    """Replace the files of an earlier run in --out."""
    json: bool = False
    """Print the result as JSON."""

    def __call__(self) -> int:
        """Repeat the run and compare."""
        require("mujoco", "repeating a run")
        require("pydantic", "repeating a run")

        recorded = _recorded(self.run / "outcome.json")

        from localization.cli.run_folder import check_folder, remove_earlier, run_folder, writing_to
        from teleop.scenario.session.run import replay_run

        bar = Progress()
        poses: list[Pose] = []

        def observe(tick: TickRecord) -> None:
            poses.append(tick.truth.map_from_base)

        if self.out is None:
            outcome = replay_run(self.run, progress=bar, observers=(observe,))
        else:
            if self.out.resolve() == self.run.resolve():
                raise SettingError(f"--out {self.out} is the run itself: give another folder")
            check_folder(self.out, RUN_FILES, overwrite=self.overwrite)
            with writing_to(folder := run_folder(self.out)):
                remove_earlier(folder, RUN_FILES)
                outcome = replay_run(self.run, folder, progress=bar, observers=(observe,))
                _write(outcome, self.run, folder)
        bar.end()
        if recorded is None:
            return self._report_of_killed(outcome, is_same=_drove(self.run, poses))
        return self._report(outcome, recorded)

    def _report(self, outcome: Outcome, recorded: dict[str, Any]) -> int:
        from teleop.scenario.reports.json_report import outcome_values
        from teleop.scenario.reports.table import table, verdict

        is_same = outcome.sha256 == recorded["sha256"]
        was, found = _judgement(recorded), _judgement(outcome_values(outcome))
        if self.json:
            values = {"same": is_same, "sha256": outcome.sha256, "recorded": recorded["sha256"]}
            say_json({**values, "same_verdict": was == found, "verdict": found, "was": was})
        else:
            digest = recorded["sha256"][:16]
            word = "the same, to the bit" if is_same else f"NOT the same: was {digest}"
            judged = "the same" if was == found else f"NOT the same: was {_words(was)}"
            say(
                *table([verdict(outcome)]),
                f"trajectory {outcome.sha256[:16]}: {word}",
                f"verdict {_words(found)}: {judged}",
            )
        return int(not (is_same and was == found))

    def _report_of_killed(self, outcome: Outcome, *, is_same: bool) -> int:
        from teleop.scenario.reports.table import table, verdict

        if self.json:
            say_json({"same": is_same, "sha256": outcome.sha256, "recorded": None})
        else:
            word = "the same, to the bit" if is_same else "NOT the same"
            say(
                *table([verdict(outcome)]),
                f"{self.run} was killed before it was judged; true poses as far as it went: {word}",
            )
        return int(not is_same)


def _recorded(file: Path) -> dict[str, Any] | None:
    """Return what the recorded run has shown; None if its process ended before that was written."""
    try:
        values: dict[str, Any] = json_module.loads(file.read_text(encoding="utf-8"))
        str(values["sha256"])
        _judgement(values)
    except OSError as error:
        if isinstance(error, FileNotFoundError) and (file.parent / "scenario.json").is_file():
            return None
        reason = f"{file.parent} is not a run of a scenario: {file.name}: {error.strerror}"
        raise SettingError(reason) from None
    except (ValueError, KeyError, TypeError):
        raise SettingError(f"{file} is damaged: it has no sha256, status or limits") from None
    return values


def _judgement(values: dict[str, Any]) -> dict[str, Any]:
    """Return what must be the same in a repeated run: the verdict, and what it is by."""
    missed = [str(check["name"]) for check in values["limits"] if not check["met"]]
    return {"status": str(values["status"]), "missed": missed}


def _words(judgement: dict[str, Any]) -> str:
    missed = f" ({', '.join(judgement['missed'])})" if judgement["missed"] else ""
    return str(judgement["status"]).replace("_", " ") + missed


def _drove(run: Path, poses: list[Pose]) -> bool:
    """Return whether the true poses of a run are the same to the bit."""
    from teleop.scenario.session.recorded_run import read_run

    truth = read_run(run).truth
    return len(truth) == len(poses) and all(
        (truth.positions[index] == pose.position).all()
        and (truth.quaternions_wxyz[index] == pose.quaternion_wxyz).all()
        for index, pose in enumerate(poses)
    )


def _write(outcome: Outcome, run: Path, folder: Path) -> None:
    """Write the reports of a repeated run; what the client printed is that of the recorded one."""
    from teleop.scenario.reports.run_reports import CLIENT_LOG, write_reports
    from teleop.scenario.session.scene import scene_of

    if (run / CLIENT_LOG).is_file():
        shutil.copyfile(run / CLIENT_LOG, folder / CLIENT_LOG)
    write_reports(outcome, folder, scene_of(outcome.scenario, run).cloud.points)
