"""Validation of the robot's physics against published figures and closed forms, row by row."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Final

from robot_sim.validation import (
    arm_rows,
    driving_rows,
    imperfection_rows,
    repeatability_rows,
    turning_rows,
)
from robot_sim.validation.row import Row as Row

PARTS: Final[Mapping[str, Callable[[], Iterator[Row]]]] = MappingProxyType(
    {
        "turning in place": turning_rows.in_place,
        "curves": turning_rows.curves,
        "anisotropic friction": turning_rows.anisotropy,
        "centre of mass": turning_rows.offsets,
        "tyre width": turning_rows.width,
        "effort": turning_rows.effort,
        "steadiness": turning_rows.steadiness,
        "driving straight": driving_rows.straight,
        "slopes": driving_rows.slopes,
        "steps": driving_rows.responses,
        "uneven tyres": imperfection_rows.radii,
        "dead band": imperfection_rows.dead_band,
        "arm": arm_rows.models,
        "turning with the arm": arm_rows.turning,
        "tipping over": arm_rows.tipping_over,
        "replay": repeatability_rows.replay,
        "chatter": repeatability_rows.chatter,
        "default contacts": repeatability_rows.control,
    }
)
"""Parts of the validation by name, in the order of the report."""


def validate(progress: Callable[[float, str], None] | None = None) -> tuple[Row, ...]:
    """Run all parts of the validation; deterministic, some seconds of one core.

    Args:
        progress: Called with the completed share and the name of the next part.
    """
    rows: list[Row] = []
    for i, (name, part) in enumerate(PARTS.items()):
        if progress is not None:
            progress(i / len(PARTS), name)
        rows += part()
    return tuple(rows)
