"""Checks that numbers of a floor plan are finite or positive, with errors that name the entry."""

from __future__ import annotations

import math

from robot_sim.errors import WorldError


def check_finite(what: str, **values: float) -> None:
    """Raise a WorldError that names the first value that is not finite."""
    for key, value in values.items():
        if not math.isfinite(value):
            raise WorldError(f"{what}: {key} must be finite, got {value}")


def check_positive(what: str, **values: float) -> None:
    """Raise a WorldError that names the first length that is not finite and positive."""
    for key, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise WorldError(f"{what}: {key} must be > 0 m, got {value:g}")
