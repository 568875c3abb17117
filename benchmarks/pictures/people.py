"""``python -m benchmarks.pictures.people SHEET PNG``: false alarms an hour against robots noticed in time."""

from __future__ import annotations

import sys
from pathlib import Path

from benchmarks.common.figures import Figure
from benchmarks.common.sheet import Sheet
from benchmarks.localization.alarms import by_the_hour
from localization.config import LocalizerConfig

NOTICED = "said to be lost within 2 s"


def main(sheet: Path, picture: Path) -> None:
    """Draw each probability at which a pose is believed as a point with its 95 % bounds."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
    for sure, alarms, noticed in points(Sheet(sheet)):
        low, high = alarms.low or 0.0, alarms.high or alarms.value
        across = [[alarms.value - low], [high - alarms.value]]
        share = noticed.value
        up = [[share - (noticed.low or share)], [(noticed.high or share) - share]]
        label = f"{sure:.1%}"
        axes.errorbar(
            [alarms.value], [share], xerr=across, yerr=up, fmt="o", capsize=3, label=label
        )
    axes.set_xlabel("false alarms of being lost, per hour of driving (95 % bounds)")
    axes.set_ylabel("carried off, said to be lost within 2 s [%]")
    axes.set_ylim(-3.0, 103.0)
    axes.set_xlim(left=-0.05)
    axes.legend(title="believed from", loc="center right")
    axes.grid(alpha=0.3)
    figure.savefig(picture, dpi=110)


def points(sheet: Sheet) -> list[tuple[float, Figure, Figure]]:
    """Return what makes sure, false alarms and the share that was noticed, for each probability measured."""
    usual = LocalizerConfig().belief.sure
    found: list[tuple[float, Figure, Figure]] = []
    hours = [f for name, part in sheet.parts.items() if name.startswith("hours") for f in part]
    if hours and "carried" in sheet.parts:
        found.append((usual, _alarms(hours), _noticed(sheet.parts["carried"])))
    for name, part in sheet.parts.items():
        if name.startswith("sure-"):
            found.append((float(name.partition("-")[2]), _alarms(part), _noticed(part)))
    return sorted(found, key=lambda point: point[0])


def _alarms(figures: list[Figure] | tuple[Figure, ...]) -> Figure:
    driven = [f for f in figures if f.case.endswith("alive")]
    return next(f for f in by_the_hour("", driven) if f.quantity.startswith("false alarms"))


def _noticed(figures: tuple[Figure, ...]) -> Figure:
    return next(f for f in figures if f.quantity == NOTICED)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
