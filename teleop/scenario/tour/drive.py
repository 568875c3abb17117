"""Driving a tour: runs its scenario, and writes the report and the picture beside the files of the run."""

from __future__ import annotations

import contextlib
import json
from dataclasses import dataclass
from pathlib import Path

from localization.cli.run_folder import remove_earlier
from teleop.clock import Stopwatch
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.outcome import ExitStatus, Outcome
from teleop.scenario.reports.run_reports import write_reports
from teleop.scenario.run_files import RUN_FILES
from teleop.scenario.session.in_memory import Progress
from teleop.scenario.session.run import RunInterrupted, run_scenario
from teleop.scenario.session.scene import Scene, scene_of
from teleop.scenario.tour.measures import Meter, TickMeasures, stage_times, verdict_line
from teleop.scenario.tour.summary import SUMMARY, ReportError, RunSummary, TourFacts, summarise


@dataclass(frozen=True, slots=True, eq=False)
class DrivenTour:
    """What came of a tour."""

    summary: RunSummary
    """Its results."""
    outcome: Outcome
    """What the referee says of it."""


def drive_tour(
    scenario: Scenario,
    folder: Path,
    *,
    camera: str | None = None,
    picture: bool = True,
    progress: Progress = lambda share, text: None,
) -> DrivenTour:
    """Run a scenario, measure it, and write its reports; nothing stays of one that ends before its first tick.

    Args:
        scenario: The scenario; that of a tour, or any other whose run begins with a tick.
        folder: Folder of the run, which is created.
        camera: Name of the camera that the robot carries; None for none.
        picture: Whether ``run.png`` is drawn.
        progress: Called with the progress.

    Raises:
        KeyboardInterrupt: If it is interrupted before its first tick.
        ReportError: If it ends before its first tick.
    """
    watch, meter, measures = Stopwatch(), Meter(), TickMeasures()
    try:
        progress(0.0, "preparing the map")
        outcome = run_scenario(
            scenario,
            folder,
            observers=(measures.take,),
            wire_observers=(meter,),
            camera=camera,
            stage=watch.stage,
            progress=progress,
        )
    except RunInterrupted as interruption:
        if not measures.begun:
            raise
        outcome = interruption.outcome
    finally:
        if not measures.begun:
            _discard(folder)
    if not measures.begun:
        raise ReportError(f"the run ended before it began: {outcome.ending}")
    scene = scene_of(scenario)
    facts = TourFacts(
        scene=scenario.world.scene,
        seed=scenario.seed,
        map_sha256=scene.cloud.sha256,
        ending=outcome.ending,
        verdicts=tuple(map(verdict_line, measures.verdicts)),
        robot_seconds=outcome.robot_seconds,
        wall_seconds=outcome.robot_seconds / outcome.factor,
        startup_seconds=sum(watch.laps["set-up"]),
        stages=stage_times(watch.laps),
        traffic=meter.traffic(),
        joy_to_motion=tuple(measures.joy_to_motion),
    )
    passed = outcome.status is ExitStatus.PASSED
    summary = summarise(folder, facts, outcome.checks, passed=passed)
    text = json.dumps(summary.to_json(), indent=2)
    (folder / SUMMARY).write_text(text + "\n", encoding="utf-8")
    progress(1.0, "writing the report")
    _report(outcome, folder, scene, measures, picture=picture)
    return DrivenTour(summary, outcome)


def _report(
    outcome: Outcome, folder: Path, scene: Scene, measures: TickMeasures, *, picture: bool
) -> None:
    write_reports(outcome, folder, scene.cloud.points)
    if picture:
        from teleop.scenario.tour.picture import draw

        scenario = outcome.scenario
        title = f"{scenario.world.scene}, seed {scenario.seed}: {outcome.ending}"
        draw(folder, scene.cloud, measures, title=title)


def _discard(folder: Path) -> None:
    """Remove the files of a run that did not begin, and its folder unless it holds other files."""
    remove_earlier(folder, RUN_FILES)
    with contextlib.suppress(OSError):
        folder.rmdir()
