"""The command ``farsteer precision``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import tyro

from localization.cli.terminal import Progress, fitted, remark, say, say_json
from localization.extras import has, missing, require
from teleop.errors import SettingError

if TYPE_CHECKING:
    from teleop.scenario.precision.ways import Trial

FILES: Final = ("steps.csv", "precision.md", "precision.png")
"""Names of the files of a trial."""

Method = Literal["time", "odometry", "localization"]


@dataclass(frozen=True)
class Precision:
    """Drive steps on several surfaces, and compare what was commanded with what was driven.

    The robot drives the same steps, straight ones and turns, three times on each surface: once a client
    publishes velocities and counts time, as the program of a thesis about AR glasses does, and twice the
    robot drives them itself as goals of /move, measured by its wheels and by the localiser. All is in
    lockstep over the robot's protocol; the same seed gives the same figures. steps.csv has each step by
    wheels, by the localiser and by ground truth, precision.md the table, precision.png the plot.
    """

    surface: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = (
        "tile",
        "carpet",
        "grass",
    )
    """Surfaces of the whole ground; docs/worlds.md lists them."""
    method: tuple[Method, ...] = ("time", "odometry", "localization")
    """Ways of driving the steps."""
    steps: int = 100
    """Number of steps for each surface and method."""
    scene: str = "office"
    """Scene; the robot begins at its spawn, where a metre must be free on all sides."""
    seed: int = 0
    """Seed of the steps and of the sensors' errors."""
    out: Path | None = None
    """Folder for the files; runs/<time> unless given."""
    overwrite: bool = False
    """Replace the files of an earlier trial in --out."""
    json: bool = False
    """Print the results as JSON."""

    def __call__(self) -> int:
        """Drive, write the files, and print the table."""
        if self.steps < 2:
            raise SettingError(f"--steps must be at least 2, got {self.steps}")
        for library in ("mujoco", "pydantic", "websockets"):
            require(library, "a trial of steps")

        from localization.cli.run_folder import (
            check_folder,
            remove_earlier,
            run_folder,
            writing_to,
        )
        from robot_sim.scene_objects.floor_surfaces import surface_named
        from teleop.scenario.precision.report import draw, markdown, write_csv
        from teleop.scenario.precision.trial import run_trial, trial_scenario

        check_folder(self.out, FILES, overwrite=self.overwrite)
        for name in self.surface:
            surface_named(name)
        bar = Progress()
        trials: list[Trial] = []
        total = len(self.surface) * len(self.method) * self.steps
        for name in self.surface:
            for method in self.method:
                before = len(trials) * self.steps

                def advance(
                    done: int, name: str = name, method: str = method, before: int = before
                ) -> None:
                    bar((before + done) / total, f"{name}, by {method}")

                scenario = trial_scenario(self.scene, name, method, self.steps, self.seed)
                trials.append(run_trial(scenario, progress=advance))
        folder = run_folder(self.out)
        remove_earlier(folder, FILES)
        table = markdown(trials)
        with writing_to(folder):
            write_csv(folder / "steps.csv", trials)
            (folder / "precision.md").write_text(table + "\n", encoding="utf-8")
            if has("matplotlib"):
                title = f"{self.steps} steps on each surface, scene {self.scene}, seed {self.seed}"
                draw(folder / "precision.png", trials, title)
            else:
                remark(f"note: no precision.png: {missing('matplotlib')}")
        bar.end()
        if self.json:
            say_json({"table": table.split("\n"), "folder": folder})
        else:
            say(table, *fitted(f"files in {folder}/"))
        failed = sum(each.outcome != "done" for trial in trials for each in trial.driven)
        return int(failed > 0)
