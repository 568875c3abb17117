"""The robot's physics against published figures and closed forms, row by row."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from robot_sim.validation import driving, flaws, trust, turning
from robot_sim.validation.row import Row as Row

_PARTS: Final[tuple[tuple[str, Callable[[], Iterator[Row]]], ...]] = (
    ("turning in place", turning.in_place),
    ("curves", turning.curves),
    ("anisotropic friction", turning.anisotropy),
    ("centre of mass", turning.offsets),
    ("effort", turning.effort),
    ("steadiness", turning.steadiness),
    ("driving straight", driving.straight),
    ("slopes", driving.slopes),
    ("steps", driving.responses),
    ("uneven tyres", flaws.radii),
    ("dead band", flaws.dead_band),
    ("replay", trust.replay),
    ("chatter", trust.chatter),
    ("default contacts", trust.control),
)


def validate(progress: Callable[[float, str], None] | None = None) -> tuple[Row, ...]:
    """Run every validation; deterministic, some seconds of one core.

    Args:
        progress: Told the share that is done, and what comes next.
    """
    rows: list[Row] = []
    for i, (name, part) in enumerate(_PARTS):
        if progress is not None:
            progress(i / len(_PARTS), name)
        rows += part()
    return tuple(rows)
