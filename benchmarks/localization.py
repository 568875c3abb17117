"""The localiser beside its peers on the same readings, each figure with count, bounds and goal.

Parts by name: nominal occluded furniture courtyard slips corridor consistency dropouts latency kidnap lost
hints kidnapped speed, and two that take long and go by name only: kidnapped-2000 alarms.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from benchmarks._alarms import alarms
from benchmarks._drives import (
    compare,
    consistency,
    corridor,
    courtyard,
    directions_named,
    furniture,
    nominal,
    occlusion,
    slips,
    speed,
)
from benchmarks._faults import carried_away, dropouts, latency
from benchmarks._figures import Figure, Sheet, say
from benchmarks._lost import lost
from benchmarks._trials import hints, kidnapped, kidnapped_far

PARTS: dict[str, Callable[[], Iterator[Figure]]] = {
    "nominal": lambda: compare(nominal()),
    "occluded": lambda: compare(occlusion()),
    "furniture": lambda: compare(furniture()),
    "courtyard": lambda: compare(courtyard()),
    "slips": lambda: compare(slips()),
    "corridor": lambda: compare(corridor(), directions_named),
    "consistency": consistency,
    "dropouts": dropouts,
    "latency": latency,
    "kidnap": carried_away,
    "lost": lost,
    "hints": hints,
    "kidnapped": kidnapped,
    "speed": speed,
    "kidnapped-2000": kidnapped_far,
    "alarms": alarms,
}
LONG = ("kidnapped-2000", "alarms")
"""Done only if they are named."""


def main(parts: Sequence[str] = (), *, out: Path | None = None) -> None:
    """Measure some parts, or all but the long ones, and print their figures.

    Args:
        parts: by name.
        out: a sheet of figures; parts that are measured take their places in it, the others stay.
    """
    sheet = Sheet(out)
    for name in parts or [p for p in PARTS if p not in LONG]:
        begun, figures = time.process_time(), list[Figure]()
        say(f" {name}")
        for figure in PARTS[name]():
            show(figure, figures[-1] if figures else None)
            figures.append(figure)
        seconds = time.process_time() - begun
        sheet.put(name, figures, seconds=seconds)
        say(f"   ({seconds:.0f} s of CPU)")


def show(figure: Figure, before: Figure | None) -> None:
    """Print a figure beneath its case and method, which are printed when they change."""
    if before is None or (before.case, before.method) != (figure.case, figure.method):
        say(f"  {figure.case}: {figure.method}")
    count = f"n {figure.n}" if figure.n else ""
    goal = f"goal {figure.goal}: {figure.verdict}" if figure.verdict else ""
    say(f"    {figure.quantity:38s} {figure.text:28s} {count:8s} {goal}".rstrip())
