"""The robot's physics against published figures and closed forms, row by row."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Final

from robot_sim.validation import (
    driving_rows as driving,
    imperfection_rows as flaws,
    repeatability_rows as trust,
    turning_rows as turning,
)
from robot_sim.validation.row import Row as Row

PARTS: Final[Mapping[str, Callable[[], Iterator[Row]]]] = MappingProxyType(
    {
        "turning in place": turning.in_place,
        "curves": turning.curves,
        "anisotropic friction": turning.anisotropy,
        "centre of mass": turning.offsets,
        "tyre width": turning.width,
        "effort": turning.effort,
        "steadiness": turning.steadiness,
        "driving straight": driving.straight,
        "slopes": driving.slopes,
        "steps": driving.responses,
        "uneven tyres": flaws.radii,
        "dead band": flaws.dead_band,
        "replay": trust.replay,
        "chatter": trust.chatter,
        "default contacts": trust.control,
    }
)
"""What is validated, by name, in the order of the report."""


def validate(progress: Callable[[float, str], None] | None = None) -> tuple[Row, ...]:
    """Run every validation; deterministic, some seconds of one core.

    Args:
        progress: Told the share that is done, and what comes next.
    """
    rows: list[Row] = []
    for i, (name, part) in enumerate(PARTS.items()):
        if progress is not None:
            progress(i / len(PARTS), name)
        rows += part()
    return tuple(rows)
