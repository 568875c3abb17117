"""Read the files that a run leaves behind (`make sim ARGS="--out runs/first"`), and plot the position error."""

import argparse
import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from localization.evaluation.estimate_trace import read_trace
from localization.evaluation.trajectory_errors import associate, errors
from localization.evaluation.tum_file import read_tum


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path, help="folder of a run")
    parser.add_argument("--out", type=Path, default=Path("error.png"))
    arguments = parser.parse_args()

    estimate = read_tum(arguments.run / "estimate.tum")
    truth = read_tum(arguments.run / "truth.tum")
    scenario = json.loads((arguments.run / "scenario.json").read_text(encoding="utf-8"))
    rows = read_trace(arguments.run / "trace.csv")
    tracking = sum(row.health == "tracking" for row in rows) / len(rows)
    found = errors(*associate(estimate, truth))
    print(f"scene {scenario['world']['scene']}, seed {scenario['seed']}")
    print(f"{len(rows)} estimates, {tracking:.1%} of them tracking")
    print(f"position error: rmse {1e3 * np.sqrt(np.mean(found.distances**2)):.1f} mm")

    figure = Figure(figsize=(8, 3))
    axes = figure.subplots()
    axes.plot(1e3 * found.distances)
    axes.set_xlabel("estimate")
    axes.set_ylabel("position error [mm]")
    figure.savefig(arguments.out)
    print("written:", arguments.out)


if __name__ == "__main__":
    main()
