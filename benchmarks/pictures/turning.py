"""Figure of the ratio by which the robot turns slower than a differential drive, over the curve.

``python -m benchmarks.pictures.turning docs/images/turning.png`` draws it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from robot_sim.validation.friction_theory import published_chi
from robot_sim.validation.turning_rows import CURVES, chi_in_curve


def draw_turning(path: Path) -> None:
    """Draw chi over lambda: as published, with Coulomb's contacts, and with tyres that bend."""
    fine = np.linspace(0.0, max(CURVES), 400)
    published = np.array([published_chi(x) for x in fine])
    figure = Figure(figsize=(7.0, 3.6), layout="constrained")
    axes = figure.add_subplot()
    axes.fill_between(fine, 0.97 * published, 1.03 * published, color="0.9", label="within 3 %")
    axes.plot(fine, published, color="black", label="published (Wang et al. 2015)")
    for compliant, colour, label in (
        (False, "#d55e00", "Coulomb contacts alone"),
        (True, "#009e73", "this robot"),
    ):
        values = [chi_in_curve(curve, compliant=compliant) for curve in CURVES]
        axes.plot(CURVES, values, "o", color=colour, markersize=5, label=label)
    axes.set_xlabel("openness of the curve, (v left + v right) / (v right - v left)")
    axes.set_ylabel("chi")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    draw_turning(Path(sys.argv[1]))
