"""Table, file and plot of trials: what was asked for against what was truly driven."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from teleop.scenario.precision.ways import Driven, Trial

_NAMES: Final = {
    "time": "time (client, 10 Hz)",
    "odometry": "wheel odometry",
    "localization": "localiser",
}
"""Names of the methods, for people."""

_COLUMNS: Final = (
    "surface",
    "driven_by",
    "number",
    "outcome",
    "commanded_distance_m",
    "commanded_angle_deg",
    "wheel_distance_m",
    "wheel_angle_deg",
    "localizer_distance_m",
    "localizer_angle_deg",
    "true_distance_m",
    "true_angle_deg",
)


@dataclass(frozen=True, slots=True)
class StepErrors:
    """Errors of the steps of one kind: driven less commanded, positive if it went too far."""

    mean: float
    """Mean error."""
    absolute: float
    """Mean of the absolute errors."""
    worst: float
    """Largest absolute error."""
    count: int
    """Number of steps."""


def errors_of(trial: Trial, *, straight: bool) -> FloatArray:
    """Return how much too far each done step of a kind truly went, in its own direction [mm or deg]."""
    return np.array(
        [
            _error(each)
            for each in trial.driven
            if each.outcome == "done" and _straight(each) is straight
        ]
    )


def summary(errors: FloatArray) -> StepErrors:
    """Return the figures of a table's cell."""
    if not errors.size:
        return StepErrors(math.nan, math.nan, math.nan, 0)
    size = np.abs(errors)
    return StepErrors(float(errors.mean()), float(size.mean()), float(size.max()), errors.size)


def _straight(driven: Driven) -> bool:
    return driven.step.distance != 0.0


def _error(driven: Driven) -> float:
    step, true = driven.step, driven.true
    if _straight(driven):
        return 1000.0 * math.copysign(1.0, step.distance) * (true.distance - step.distance)
    return math.degrees(math.copysign(1.0, step.angle) * (true.angle - step.angle))


def markdown(trials: Sequence[Trial]) -> str:
    """Return the table of all trials."""
    lines = [
        "| surface | driven by | straight: mean [mm] | mean size [mm] | worst [mm] | turns: mean [deg] | mean size [deg] | worst [deg] | done |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for trial in trials:
        way = summary(errors_of(trial, straight=True))
        turn = summary(errors_of(trial, straight=False))
        lines.append(
            f"| {trial.surface} | {_NAMES[trial.method]} | {way.mean:+.1f} | {way.absolute:.1f} | {way.worst:.1f}"
            f" | {turn.mean:+.2f} | {turn.absolute:.2f} | {turn.worst:.2f}"
            f" | {way.count + turn.count} of {len(trial.driven)} |"
        )
    return "\n".join(lines)


def write_csv(path: Path, trials: Sequence[Trial]) -> None:
    """Write each step as a line."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        for trial in trials:
            for number, each in enumerate(trial.driven, 1):
                step, wheels, estimated = each.step, each.wheels, each.localizer
                values = (
                    *(step.distance, math.degrees(step.angle)),
                    *(wheels.distance, math.degrees(wheels.angle)),
                    *(
                        (math.nan, math.nan)
                        if estimated is None
                        else (estimated.distance, math.degrees(estimated.angle))
                    ),
                    *(each.true.distance, math.degrees(each.true.angle)),
                )
                texts = [f"{value:.5f}" for value in values]
                writer.writerow((trial.surface, trial.method, number, each.outcome, *texts))


def draw(path: Path, trials: Sequence[Trial], title: str) -> None:
    """Draw the errors of all trials, surface by surface; needs matplotlib."""
    import matplotlib
    from matplotlib.figure import Figure

    surfaces = list(dict.fromkeys(trial.surface for trial in trials))
    colours = {"time": "#5d6770", "odometry": "#0b62a8", "localization": "#c2571a"}
    with matplotlib.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(10.0, 4.2), layout="constrained", dpi=110)
        figure.suptitle(title)
        ways, turns = figure.subplots(1, 2)
        for axes, straight, label in (
            (ways, True, "straight steps: driven less commanded [mm]"),
            (turns, False, "turns: driven less commanded [deg]"),
        ):
            methods = list(dict.fromkeys(trial.method for trial in trials))
            for trial in trials:
                errors = errors_of(trial, straight=straight)
                offset = 0.25 * (methods.index(trial.method) - 0.5 * (len(methods) - 1))
                place = surfaces.index(trial.surface) + offset
                spread = np.linspace(-0.08, 0.08, errors.size)
                axes.plot(place + spread, errors, ".", ms=4, color=colours[trial.method])
            axes.axhline(0.0, color="black", lw=0.8)
            axes.set_xticks(range(len(surfaces)), surfaces)
            axes.set_ylabel(label)
            axes.set_yscale("symlog", linthresh=1.0 if straight else 0.1)
        for method in methods:
            ways.plot([], [], ".", color=colours[method], label=_NAMES[method])
        ways.legend(loc="best")
        figure.savefig(path)
