"""Runs of scenario files, one or many at a time, each with its reports in a folder of its own."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from concurrent.futures import Future, as_completed
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from localization.errors import LocalizationError
from teleop.errors import SettingError, TeleopError
from teleop.scenario.reports.run_reports import JUNIT
from teleop.scenario.worker_pool import worker_pool

if TYPE_CHECKING:
    from teleop.scenario.files.scenario import Scenario
    from teleop.scenario.operators.operator import Operator
    from teleop.scenario.referee.outcome import Outcome
    from teleop.scenario.reports.table import Verdict
    from teleop.scenario.session.in_memory import Progress


@dataclass(frozen=True, slots=True)
class RunRequest:
    """A scenario to be run, and how; it can be sent to another process."""

    file: Path
    """The scenario file."""
    scenario: Scenario
    """What it says."""
    folder: Path
    """Folder of the run."""
    pace: Literal["real", "lockstep"] | None = None
    """The pace; by default ``real`` with a client that is not ours, else ``lockstep``."""
    client: str | None = None
    """Command line of the client under test."""
    operator: str | Operator | None = None
    """An operator of the user's own, or its ``module:Class``."""
    tokens: Path | None = None
    """File of tokens of which the client must have one."""
    port: int = 0
    """Port of the server; 0 for any free one."""


@dataclass(frozen=True, slots=True, eq=False)
class Ran:
    """What came of a scenario file."""

    verdict: Verdict
    """Its line of the table."""
    outcome: Outcome | None
    """Its outcome; None if it could not be run."""
    file: Path
    """The scenario file."""
    is_interrupted: bool = False
    """Whether Ctrl-C ended it."""

    @property
    def failure(self) -> str:
        """Why it could not be run."""
        return "\n".join(self.verdict.details)


def check_request(request: RunRequest) -> None:
    """Check that a scenario can be run in its world, before anything is written.

    Raises:
        ScenarioFileError: If it cannot; the error names file, line, and what would work.
        LocalizationError: If its map cannot be used.
        SimulationError: If its world cannot be built.
    """
    from teleop.scenario.files.errors import ScenarioError, located
    from teleop.scenario.session.scene import checked_scene_of

    try:
        checked_scene_of(request.scenario, request.file.parent)
    except ScenarioError as error:
        raise located(error, request.file) from None


def run_request(request: RunRequest, progress: Progress = lambda share, text: None) -> Ran:
    """Run a scenario and write its reports, also if Ctrl-C ends it.

    Raises:
        TeleopError: If it cannot be run; an error of the scenario names file and line.
        LocalizationError: If its map cannot be used.
        SimulationError: If its world cannot be built.
    """
    from teleop.scenario.files.errors import ScenarioError, located
    from teleop.scenario.reports.run_reports import write_reports
    from teleop.scenario.reports.table import verdict
    from teleop.scenario.session.run import RunInterrupted, run_scenario
    from teleop.scenario.session.scene import scene_of

    operator = request.operator
    if isinstance(operator, str):
        operator = operator_named(operator)
    is_interrupted = False
    try:
        outcome = run_scenario(
            request.scenario,
            request.folder,
            beside=request.file.parent,
            pace=request.pace,
            client=request.client,
            operator=operator,
            tokens=request.tokens,
            port=request.port,
            progress=progress,
        )
    except ScenarioError as error:
        raise located(error, request.file) from None
    except RunInterrupted as interruption:
        outcome, is_interrupted = interruption.outcome, True
    progress(1.0, "writing the report")
    points = scene_of(request.scenario, request.file.parent).cloud.points
    write_reports(outcome, request.folder, points)
    return Ran(verdict(outcome, str(request.folder)), outcome, request.file, is_interrupted)


def run_many(
    requests: Sequence[RunRequest], jobs: int, progress: Progress = lambda share, text: None
) -> list[Ran]:
    """Run scenarios side by side in processes; one that cannot be run does not keep the others from it.

    Args:
        requests: The scenarios.
        jobs: Number of processes.
        progress: Called as each scenario is over.

    Returns:
        What came of them; upon Ctrl-C, of those that had begun.

    Raises:
        TeleopError: If one of the processes was killed.
    """
    if jobs == 1:
        return _one_by_one(requests, progress)
    futures: list[Future[Ran]] = []
    with suppress(KeyboardInterrupt), worker_pool(min(jobs, len(requests))) as pool:
        futures += [pool.submit(_run_or_say_why, request) for request in requests]
        for number, future in enumerate(as_completed(futures), 1):
            progress(number / len(requests), _line(future.result()))
    return [each.result() for each in futures if not _has_not_begun(each)]


def _one_by_one(requests: Sequence[RunRequest], progress: Progress) -> list[Ran]:
    ran: list[Ran] = []
    with suppress(KeyboardInterrupt):
        for number, request in enumerate(requests, 1):
            ran.append(_run_or_say_why(request))
            progress(number / len(requests), _line(ran[-1]))
            if ran[-1].is_interrupted:
                break
    return ran


def _has_not_begun(future: Future[Ran]) -> bool:
    return future.cancelled() or isinstance(future.exception(), KeyboardInterrupt)


def _line(ran: Ran) -> str:
    return f"{ran.verdict.name}: {ran.verdict.status.name.lower().replace('_', ' ')}"


def _run_or_say_why(request: RunRequest) -> Ran:
    from robot_sim import SimulationError

    try:
        return run_request(request)
    except (TeleopError, LocalizationError, SimulationError, OSError) as error:
        return not_run(request.file, str(error))


def not_run(file: Path, reason: str) -> Ran:
    """Return what is said of a file that cannot be run."""
    from teleop.scenario.referee.outcome import ExitStatus
    from teleop.scenario.reports.table import Verdict

    lines = tuple(reason.split("\n"))
    return Ran(Verdict(file.name, ExitStatus.BAD_INPUT, 0.0, 0.0, lines, ""), None, file)


def with_folders(requests: Sequence[RunRequest], folder: Path) -> list[RunRequest]:
    """Return requests with a name of its own for each, and a folder of that name beside the report on all."""
    taken = {JUNIT}
    placed = []
    for request in requests:
        scenario, name = request.scenario, request.scenario.name
        # Readers of JUnit XML take cases of one name for one.
        names = (name if number == 1 else f"{name[:70]}-{number}" for number in count(1))
        own = next(each for each in names if each not in taken)
        taken.add(own)
        placed.append(replace(request, scenario=replace(scenario, name=own), folder=folder / own))
    return placed


def operator_named(name: str) -> Operator:
    """Return an operator of the user's own.

    Args:
        name: ``module:Class``; the module is found as ``python -m`` finds it, from the working directory, too.

    Raises:
        SettingError: If there is no such class, or it is no operator.
    """
    from teleop.scenario.operators.operator import Operator

    module_name, colon, class_name = name.partition(":")
    if not (module_name and colon and class_name):
        raise SettingError(f"--operator {name}: must be module:Class, such as my_operators:Slow")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise
        raise SettingError(f"--operator {name}: there is no module {error.name}") from None
    kind = getattr(module, class_name, None)
    if not (isinstance(kind, type) and issubclass(kind, Operator)):
        own = [
            n for n, k in vars(module).items() if isinstance(k, type) and issubclass(k, Operator)
        ]
        found = ", ".join(n for n in own if n != "Operator") or "no class that is an Operator"
        raise SettingError(f"--operator {name}: {module_name} has {found}")
    return kind()


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))
