"""Fixtures for pytest: a robot to try a client on, and scenarios that judge who drives.

The plugin is loaded by every pytest of an environment in which ``farsteer`` is installed. It imports nothing but
pytest; simulator, localiser and numpy are loaded when a fixture is used.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import pytest

if TYPE_CHECKING:
    from teleop.scenario.operators.operator import Operator
    from teleop.scenario.referee.outcome import Outcome
    from teleop.scenario.robot_process import RobotProcess


class RobotFactory:
    """Starts robots for a test; owns those that it has started."""

    def __init__(self) -> None:
        self._robots: list[RobotProcess] = []

    def __call__(
        self,
        scene: str = "office",
        *,
        pace: Literal["lockstep", "real"] = "lockstep",
        at: str | Sequence[float] | None = None,
        known: Literal["exactly", "about", "nothing"] = "exactly",
        seed: int = 0,
        truth: bool = False,
        spares: bool = False,
        world: Mapping[str, Any] = {},
        faults: Sequence[Mapping[str, Any]] = (),
    ) -> RobotProcess:
        """Start a robot in a process of its own; it ends with the test.

        Args:
            scene: Name of a scene, or path of a scene folder, floor plan or MJCF file.
            pace: Whether its time goes by ``step``, or as the clock goes.
            at: Where it stands: a place of the scene, or x, y [m] and heading [degrees]; by default the scene's start.
            known: Whether it knows that.
            seed: Seed of its noise.
            truth: Whether clients may see the topics of ground truth.
            spares: Whether four boxes and two people can be put into the world by ``/sim/spawn_entity``.
            world: Further fields of a scenario's table ``world``.
            faults: Faults as tables of a scenario, such as ``{"kind": "kidnap", "at": 5}``.
        """
        from teleop.scenario.robot_process import RobotProcess, robot_document

        place = at if at is None or isinstance(at, str) else list(at)
        scenario = robot_document(
            scene,
            seed=seed,
            start={"known": known} | ({} if place is None else {"at": place}),
            truth=truth,
            world=world,
            faults=faults,
        )
        self._robots.append(RobotProcess(scenario, pace, spares=spares))
        return self._robots[-1]

    def stop(self) -> None:
        """End all robots."""
        for robot in self._robots:
            robot.stop()


class ScenarioRunner:
    """Runs scenarios for a test."""

    def __init__(self, folders: pytest.TempPathFactory) -> None:
        """Take what makes the folders of the runs."""
        self._folders = folders

    def __call__(
        self,
        file: str | Path,
        *,
        client: str | None = None,
        operator: Operator | None = None,
        pace: Literal["lockstep", "real"] | None = None,
        seed: int | None = None,
        check: bool = True,
    ) -> Outcome:
        """Run a scenario; the test fails with the table of limits if it does not pass.

        Args:
            file: A scenario file, or the name of a scenario of the project.
            client: Command line of a client that drives in the place of the scenario's operator.
            operator: An operator of your own that drives in its place.
            pace: By default ``real`` with a client, else ``lockstep``.
            seed: Seed in the place of the scenario's.
            check: Whether the test fails unless it passes; else the outcome says how it ended.
        """
        from teleop.scenario.reports.table import table, verdict

        folder = self._folders.mktemp("farsteer-run")
        how = {"client": client, "operator": operator, "pace": pace}
        outcome = _or_fail(lambda: _run(file, folder, seed, how))
        if check and outcome.status:
            pytest.fail("\n".join(table([verdict(outcome, str(folder))])), pytrace=False)
        return outcome


@pytest.fixture
def farsteer_robot() -> Iterator[RobotFactory]:
    """Start simulated robots, each in a process of its own that ends with the test; see ``RobotFactory``."""
    factory = RobotFactory()
    yield factory
    factory.stop()


@pytest.fixture
def farsteer_scenario(tmp_path_factory: pytest.TempPathFactory) -> ScenarioRunner:
    """Run scenario files and judge them; see ``ScenarioRunner``."""
    # As the command does; numpy and MuJoCo read these when they are imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("MUJOCO_GL", "disable")
    return ScenarioRunner(tmp_path_factory)


def _run(file: str | Path, folder: Path, seed: int | None, how: dict[str, Any]) -> Outcome:
    from dataclasses import replace

    from teleop.scenario.files.reading import read_scenario
    from teleop.scenario.files.shipped import scenario_files
    from teleop.scenario.scenario_runs import RunRequest, run_request

    path = scenario_files([str(file)])[0]
    scenario = read_scenario(path)
    if seed is not None:
        scenario = replace(scenario, seed=seed)
    ran = run_request(RunRequest(path, scenario, folder, **how))
    if ran.is_interrupted:
        raise KeyboardInterrupt  # the tests', too
    assert ran.outcome is not None
    return ran.outcome


def _or_fail(run: Callable[[], Outcome]) -> Outcome:
    """Run, or fail the test with the one line of an error that its author can correct."""
    from localization.errors import LocalizationError
    from robot_sim import SimulationError
    from teleop.errors import TeleopError

    try:
        return run()
    except (TeleopError, LocalizationError, SimulationError) as error:
        reason = str(error)
    pytest.fail(reason, pytrace=False)
