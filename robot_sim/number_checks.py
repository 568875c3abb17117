"""Checks that numbers of a floor plan are finite or positive, with errors that name the entry."""

from __future__ import annotations

import math

from robot_sim.errors import WorldError


def check_finite(what: str, **values: float) -> None:
    """Raise a WorldError that names the first value that is not finite."""
    for key, value in values.items():
        if not math.isfinite(value):
            raise WorldError(f"{what}: {key} must be finite, got {value}")


def check_positive(what: str, *, unit: str = " m", **values: float) -> None:
    """Raise a WorldError that names the first value that is not finite and positive; lengths by default."""
    for key, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise WorldError(f"{what}: {key} must be > 0{unit}, got {value:g}")


def check_bounds(what: str, bounds: tuple[float, float, float, float]) -> None:
    """Raise a WorldError if the smallest x, y and largest x, y are not finite, or not in this order."""
    x0, y0, x1, y1 = bounds
    check_finite(what, x0=x0, y0=y0, x1=x1, y1=y1)
    if not (x1 > x0 and y1 > y0):
        raise WorldError(
            f"{what}: bounds must be [x0, y0, x1, y1] with x1 > x0 and y1 > y0, got {list(bounds)}"
        )
