"""The arm: how it follows hands, beside mink, and what that costs; boxes in its jaws, picked and carried over the wire; plans beside OMPL's; its mirror of hobby servos.

Parts by name: carry, clearance, engagements, grasps, hands, idle, mirror, parked, picks, plans, ticks; and, long, ``campaign-1`` to
``campaign-10``, each a hundred thousand steps of hands among boxes: with ``--out`` a campaign is resumed by naming the
parts that the sheet does not have.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from benchmarks.common.figures import Figure
from benchmarks.common.sheet import measure

_HANDLING = ("carry", "grasps", "picks")
"""Parts in ``handling``; the others are in this folder."""
_SHORT = (
    *("carry", "clearance", "engagements", "grasps", "hands", "idle"),
    *("mirror", "parked", "picks", "plans", "ticks"),
)
"""Each is a function in a module of its name; what one needs, another does not load."""
_CAMPAIGN = 10
"""Parts of the campaign."""
PARTS = (*_SHORT, *(f"campaign-{number + 1}" for number in range(_CAMPAIGN)))


def main(parts: list[str] | None = None, *, out: Path | None = None) -> None:
    """Measure some parts, or all but the long ones, and print their figures."""
    measure({name: partial(_part, name) for name in parts or _SHORT}, out, whole=not parts)


def _part(name: str) -> Iterator[Figure]:
    stem, _, number = name.partition("-")
    home = "benchmarks.arm.handling" if stem in _HANDLING else "benchmarks.arm"
    function: Callable[..., Iterator[Figure]] = getattr(
        importlib.import_module(f"{home}.{stem}"), stem
    )
    return function(int(number) - 1) if number else function()
