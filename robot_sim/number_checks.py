"""Checks of the numbers in a plan, told in one line."""

from __future__ import annotations

import math

from robot_sim.errors import WorldError


def check_finite(what: str, **values: float) -> None:
    """Raise a WorldError that names the first value which is not finite."""
    for key, value in values.items():
        if not math.isfinite(value):
            raise WorldError(f"{what}: {key} must be finite, got {value}")


def check_positive(what: str, **values: float) -> None:
    """Raise a WorldError that names the first length which is not finite and positive."""
    for key, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise WorldError(f"{what}: {key} must be > 0 m, got {value:g}")
