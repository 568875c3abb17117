"""The commands ``farsteer sim`` and ``farsteer evaluate``."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

import tyro

from localization.cli.terminal import Progress, fitted, remark, say, say_json
from teleop.errors import SettingError
from teleop.scenario.mission import Mission

FILES: Final = (
    "config.json",
    "estimate.tum",
    "operator.json",
    "operator.rrd",
    "readings.mcap",
    "run.png",
    "summary.json",
    "trace.csv",
    "truth.tum",
)
"""Names of the files of a run."""


@dataclass(frozen=True)
class Sim:
    """Drive a scene's tour and report how accurately the robot was localised.

    There are two processes, joined by rosbridge alone: the robot, and a scripted operator that has the map
    file. The operator gives a hint that is wrong by a metre and 20 degrees, then steers by the messages it
    receives. Both run in lockstep, faster than real time; the same seed gives the same bits. The results
    are in one folder: readings.mcap, truth.tum, estimate.tum, trace.csv, config.json, summary.json,
    run.png, and the operator's display, operator.rrd, if rerun is installed.
    """

    mission: tyro.conf.OmitArgPrefixes[Mission] = field(default_factory=Mission)
    """Scene, seed, hint and faults."""
    out: Path | None = None
    """Folder for the files; runs/<time> unless given."""
    overwrite: bool = False
    """Replace the files of an earlier run in --out."""
    camera: str | None = None
    """Carry a camera of this model, whose pictures the operator watches: kinect, wide, small; see docs/cameras.md."""
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

        check_folder(self.out, FILES, overwrite=self.overwrite)

        from localization.extras import has, missing
        from localization.maps.prepared_map import default_cache
        from robot_sim.survey.route_proposal import with_routes
        from teleop.scenario.lockstep_run import run_over_wire
        from teleop.scenario.run_report import summary_table
        from teleop.scene_clouds import load_scene_cloud, scene_cloud_path

        if self.camera is not None:
            from robot_sim.cameras import camera_named

            camera_named(self.camera)  # refused before anything is prepared

        mission = self.mission
        world = with_routes(mission.robot.world(mission.scene, mission.seed))
        cloud, path = load_scene_cloud(mission.scene), scene_cloud_path(mission.scene)
        note = remark if self.json else say
        note(*(f"note: {line}" for line in world.notes))
        if not has("rerun"):
            note(f"no operator.rrd: {missing('rerun')}")
        bar = Progress()
        folder = run_folder(self.out)
        remove_earlier(folder, FILES)
        with writing_to(folder):
            summary, record = run_over_wire(
                mission,
                world,
                cloud,
                path,
                folder,
                cache=default_cache(),
                progress=bar,
                camera=self.camera,
            )
            if self.picture and record.ticks:
                from teleop.scenario.run_picture import draw

                bar(1.0, "drawing")
                title = (
                    f"farsteer sim --scene {mission.scene} --seed {mission.seed}: {record.ending}"
                )
                draw(record, cloud, folder / "run.png", title=title)
        bar.end()
        if self.json:
            say_json({**summary.to_json(), "folder": folder})
        else:
            say(*fitted(*summary_table(summary).split("\n")), f"\nfiles in {folder}/")
        return 130 if record.ending == "interrupted" else int(not summary.passed)


@dataclass(frozen=True)
class Evaluate:
    """Print a run's report again, computed from its files."""

    run: Annotated[Path, tyro.conf.Positional]
    """Folder of a run, such as runs/2026-01-31T12-00-00."""
    json: bool = False
    """Print the report as JSON."""

    def __call__(self) -> int:
        """Compute and print the report."""
        if not (self.run / "summary.json").is_file():
            raise SettingError(f"{self.run} is not a run: it holds no summary.json")

        from teleop.scenario.run_report import summary_table
        from teleop.scenario.run_summary import read_summary

        summary = read_summary(self.run)
        if self.json:
            say_json(summary.to_json())
        else:
            say(*fitted(*summary_table(summary).split("\n")))
        return int(not summary.passed)
