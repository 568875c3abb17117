"""The command ``farsteer scenario run``: runs scenarios, judges them, and writes their reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from localization.cli.terminal import Progress, remark, say, say_json
from localization.extras import require
from teleop.errors import SettingError
from teleop.scenario.run_files import RUN_FILES

if TYPE_CHECKING:
    from teleop.scenario.scenario_runs import Ran, RunRequest


@dataclass(frozen=True)
class Run:
    """Run scenarios, judge them, and write their reports.

    A scenario file says where the robot drives, what has to be done, what goes wrong, and which limits must
    hold. An operator of the library drives, or a program of yours: --client starts it with the robot's
    address in FARSTEER_URL, keeps what it prints, and ends it with all that it started.

    Examples: `farsteer scenario run my.toml`, or `farsteer scenario run office-visit --client "npm run e2e"`,
    or all of a folder: `farsteer scenario run scenarios/ --out build/scenarios`.

    The exit status is 0 if all limits hold, 1 if one is missed, 2 if a file cannot be run, and 3 if the
    client failed; of many files, the largest.
    """

    files: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="FILE ...")] = ()
    """Scenario files, folders of them, or names of scenarios of the project (`farsteer scenario list`)."""
    client: str | None = None
    """Command line of a client that drives in the place of the operator; a shell reads it."""
    pace: Literal["real", "lockstep"] | None = None
    """Robot time goes as the clock goes, or as fast as possible (a client then has to call /sim/step); by default
    real with a client, else lockstep."""
    operator: Annotated[str | None, tyro.conf.arg(metavar="MODULE:CLASS")] = None
    """An operator of your own that drives in the place of the scenario's: a subclass of Operator."""
    seed: int | None = None
    """Seed in the place of the scenario's."""
    out: Path | None = None
    """Folder for the files; runs/<time> unless given. Of many scenarios each has a folder in it."""
    overwrite: bool = False
    """Replace the files of an earlier run in --out."""
    jobs: int | None = None
    """Scenarios that run side by side; by default one for each core, and one at a time in real time."""
    tokens: Path | None = None
    """File of tokens (as of `farsteer serve --tokens`), one of which the client must show; it finds a token of its own
    in FARSTEER_TOKEN."""
    port: int = 0
    """Port of the robot for a client that you start yourself; any free one by default."""
    json: bool = False
    """Print the verdicts as JSON."""

    def __call__(self) -> int:
        """Run, report, and return the worst exit status."""
        require("mujoco", "running a scenario")
        require("pydantic", "running a scenario")
        require("websockets", "running a scenario")
        if not self.files:
            raise SettingError("no scenario is given; `farsteer scenario list` names some")
        if self.jobs is not None and self.jobs < 1:
            raise SettingError(f"--jobs must be >= 1, got {self.jobs}")
        if self.client is not None and self.operator is not None:
            raise SettingError("--client and --operator cannot both drive; give one of them")
        if self.seed is not None and not 0 <= self.seed < 2**63:
            raise SettingError(f"--seed must be >= 0 and < 2**63, got {self.seed}")

        from localization.cli.run_folder import check_folder, run_folder, writing_to
        from teleop.scenario.files.shipped import scenario_files
        from teleop.scenario.scenario_runs import check_request

        files = scenario_files(self.files)
        check_folder(self.out, RUN_FILES, overwrite=self.overwrite)
        bar = Progress()
        if len(files) == 1:
            # An error of the only file is the command's own.
            request = self._request(files[0])
            check_request(request)
            folder = run_folder(self.out)
            with writing_to(folder):
                ran = [self._run(replace(request, folder=folder), bar)]
        else:
            readable, refused = self._requests(files)
            folder = run_folder(self.out)
            with writing_to(folder):
                ran = self._run_all(readable, refused, files, folder, bar)
        bar.end()
        return self._report(ran, folder, is_whole=len(ran) == len(files))

    def _request(self, file: Path) -> RunRequest:
        from teleop.scenario.files.reading import read_scenario
        from teleop.scenario.scenario_runs import RunRequest

        scenario = read_scenario(file)
        if self.seed is not None:
            scenario = replace(scenario, seed=self.seed)
        return RunRequest(
            file,
            scenario,
            Path(),
            pace=self.pace,
            client=self.client,
            operator=self.operator,
            tokens=self.tokens,
            port=self.port,
        )

    def _requests(self, files: Sequence[Path]) -> tuple[list[RunRequest], list[Ran]]:
        """Read all files before one is run; return what can be run, and what is said of the others."""
        from teleop.scenario.files.errors import ScenarioFileError
        from teleop.scenario.scenario_runs import not_run

        readable, refused = [], []
        for file in files:
            try:
                readable.append(self._request(file))
            except ScenarioFileError as error:
                refused.append(not_run(file, str(error)))
        return readable, refused

    def _run(self, request: RunRequest, bar: Progress) -> Ran:
        from localization.cli.run_folder import remove_earlier
        from teleop.scenario.scenario_runs import run_request

        remove_earlier(request.folder, RUN_FILES)
        return run_request(request, bar)

    def _run_all(
        self,
        readable: Sequence[RunRequest],
        refused: Sequence[Ran],
        files: Sequence[Path],
        folder: Path,
        bar: Progress,
    ) -> list[Ran]:
        from localization.cli.run_folder import check_folder, remove_earlier
        from teleop.scenario.files.operator_settings import Client
        from teleop.scenario.reports.junit import junit
        from teleop.scenario.reports.run_reports import JUNIT
        from teleop.scenario.scenario_runs import cores, run_many, with_folders

        requests = with_folders(readable, folder)
        for request in requests:
            check_folder(request.folder, RUN_FILES, overwrite=self.overwrite)
            remove_earlier(request.folder, RUN_FILES)
        is_client = any(isinstance(r.scenario.operator, Client) for r in requests)
        is_real = self.pace == "real" or (
            self.pace is None and (self.client is not None or (is_client and self.operator is None))
        )
        bar(0.0, f"running {len(requests)} scenarios")
        ran = run_many(requests, self.jobs or (1 if is_real else cores()), bar) if requests else []
        ran = sorted([*ran, *refused], key=lambda each: files.index(each.file))
        failures = [(str(each.file), each.failure) for each in ran if each.outcome is None]
        outcomes = [each.outcome for each in ran if each.outcome is not None]
        (folder / JUNIT).write_bytes(junit(outcomes, failures))
        return ran

    def _report(self, ran: Sequence[Ran], folder: Path, *, is_whole: bool) -> int:
        from teleop.scenario.reports.table import table

        verdicts = [each.verdict for each in ran]
        if self.json:
            say_json({"scenarios": [_plain(each) for each in ran], "folder": folder})
        else:
            say(*table(verdicts), f"\nfiles in {folder}/")
        if not is_whole or any(each.is_interrupted for each in ran):
            remark("interrupted: not all scenarios were run to their ends")
            return 130
        return max(int(verdict.status) for verdict in verdicts)


def _plain(ran: Ran) -> dict[str, object]:
    from teleop.scenario.reports.json_report import outcome_values

    verdict = ran.verdict
    facts = {
        "file": ran.file,
        "name": verdict.name,
        "status": verdict.status.name.lower(),
        "details": list(verdict.details),
        "folder": verdict.folder or None,
    }
    if ran.outcome is None:
        return facts
    values = outcome_values(ran.outcome)
    return facts | {k: values[k] for k in ("ending", "limits", "figures", "sha256", "factor")}
