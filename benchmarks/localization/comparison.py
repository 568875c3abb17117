"""The localiser beside its peers on the same readings, each figure with count, bounds and goal.

Parts by name: nominal occluded furniture courtyard slips imperfect corridor consistency dropouts latency kidnap
carried-a-little lost hints kidnapped recovery speed, and some that take long and go by name only: kidnapped-changed
kidnapped-2000 alarms-1 to alarms-8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from benchmarks.common.figures import Figure
from benchmarks.common.sheet import measure
from benchmarks.localization.alarms import CHUNKS, alarms
from benchmarks.localization.drives import (
    compare,
    consistency,
    corridor,
    courtyard,
    directions_named,
    furniture,
    imperfect,
    nominal,
    occlusion,
    slips,
    speed,
)
from benchmarks.localization.faults import carried_away, dropouts, latency
from benchmarks.localization.lost import lost
from benchmarks.localization.recovery import recovery
from benchmarks.localization.small_carries import carried_a_little
from benchmarks.localization.trials import (
    hints,
    kidnapped,
    kidnapped_changed,
    kidnapped_far,
    wrong_hints,
)

PARTS: dict[str, Callable[[], Iterator[Figure]]] = {
    "nominal": lambda: compare(nominal()),
    "occluded": lambda: compare(occlusion()),
    "furniture": lambda: compare(furniture()),
    "courtyard": lambda: compare(courtyard()),
    "slips": lambda: compare(slips()),
    "imperfect": lambda: compare(imperfect()),
    "corridor": lambda: compare(corridor(), directions_named),
    "consistency": consistency,
    "dropouts": dropouts,
    "latency": latency,
    "kidnap": carried_away,
    "carried-a-little": carried_a_little,
    "lost": lost,
    "hints": hints,
    "wrong-hints": wrong_hints,
    "kidnapped": kidnapped,
    "recovery": recovery,
    "speed": speed,
    "kidnapped-changed": kidnapped_changed,
    "kidnapped-2000": kidnapped_far,
    **{f"alarms-{i + 1}": partial(alarms, i) for i in range(CHUNKS)},
}
LONG = ("kidnapped-changed", "kidnapped-2000", *(f"alarms-{i + 1}" for i in range(CHUNKS)))
"""Done only if they are named."""


def main(parts: Sequence[str] = (), *, out: Path | None = None) -> None:
    """Measure some parts, or all but the long ones, and print their figures.

    Args:
        parts: by name.
        out: a sheet of figures; parts that are named take their places in it, the others stay.
    """
    names = parts or [name for name in PARTS if name not in LONG]
    measure({name: PARTS[name] for name in names}, out, whole=not parts)
