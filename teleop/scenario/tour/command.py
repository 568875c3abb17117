"""The commands ``farsteer sim`` and ``farsteer evaluate``."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from localization.cli.terminal import Progress, fitted, remark, say, say_json
from teleop.errors import SettingError
from teleop.scenario.run_files import RUN_FILES
from teleop.scenario.tour.options import TourOptions


@dataclass(frozen=True)
class Sim:
    """Drive a scene's tour and report how accurately the robot was localised.

    It runs the scenario `tour` with what the options change in it. There are two processes, joined by rosbridge
    alone: the robot, and a scripted operator that has the map file. The operator gives a hint that is wrong by a
    metre and 20 degrees, then steers by the messages it receives. Both run in lockstep, faster than real time; the
    same seed gives the same bits. The results are in one folder: readings.mcap, truth.tum, estimate.tum, trace.csv,
    summary.json, report.html, run.png, what repeats the run, and the operator's display, operator.rrd, if rerun is
    installed.
    """

    tour: tyro.conf.OmitArgPrefixes[TourOptions] = field(default_factory=TourOptions)
    """Scene, seed, hint and faults."""
    out: Path | None = None
    """Folder for the files; runs/<time> unless given."""
    overwrite: bool = False
    """Replace the files of an earlier run in --out."""
    camera: str | None = None
    """Carry a camera of this model, whose pictures the operator watches: kinect, wide, small, arm; see docs/cameras.md."""
    picture: bool = True
    """Draw run.png."""
    json: bool = False
    """Print the results as JSON."""

    def __call__(self) -> int:
        """Drive and report."""
        from localization.cli.run_folder import (
            check_folder,
            remove_earlier,
            run_folder,
            writing_to,
        )
        from localization.extras import has, missing, require

        check_folder(self.out, RUN_FILES, overwrite=self.overwrite)
        for library in ("mujoco", "pydantic", "websockets"):
            require(library, "driving a tour")

        from teleop.scenario.tour.drive import drive_tour
        from teleop.scenario.tour.options import tour_scenario
        from teleop.scenario.tour.report import summary_table

        if self.camera is not None:
            from robot_sim.cameras import camera_named

            camera_named(self.camera)  # refused before anything is prepared

        scenario, world = tour_scenario(self.tour)
        note = remark if self.json else say
        note(*(f"note: {line}" for line in world.notes))
        if not has("rerun"):
            note(f"no operator.rrd: {missing('rerun')}")
        bar = Progress()
        folder = run_folder(self.out)
        remove_earlier(folder, RUN_FILES)
        with writing_to(folder):
            driven = drive_tour(
                scenario, folder, camera=self.camera, picture=self.picture, progress=bar
            )
        bar.end()
        summary = driven.summary
        if self.json:
            say_json({**summary.to_json(), "folder": folder})
        else:
            say(*fitted(summary_table(summary)), f"\nfiles in {folder}/")
        return 130 if driven.outcome.ending == "interrupted" else int(not summary.passed)


@dataclass(frozen=True)
class Evaluate:
    """Print a run's report again, computed from its files."""

    run: Annotated[Path, tyro.conf.Positional]
    """Folder of a run of `farsteer sim`, such as runs/2026-01-31T12-00-00."""
    json: bool = False
    """Print the report as JSON."""

    def __call__(self) -> int:
        """Compute and print the report."""
        if not (self.run / "summary.json").is_file():
            reason = "holds no summary.json of `farsteer sim`; others: `farsteer scenario replay`"
            raise SettingError(f"{self.run} {reason}")

        from teleop.scenario.tour.report import summary_table
        from teleop.scenario.tour.summary import read_summary

        summary = read_summary(self.run)
        if self.json:
            say_json(summary.to_json())
        else:
            say(*fitted(summary_table(summary)))
        return int(not summary.passed)
