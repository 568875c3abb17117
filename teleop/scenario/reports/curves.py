"""Curves and bands as paths of SVG in a box of 1000 by 100 that is stretched to the panel's size."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from localization.geometry import FloatArray
from localization.types import IntArray
from teleop.scenario.reports.markup import Markup, element
from teleop.scenario.reports.scales import Scale

WIDTH, HEIGHT = 1000.0, 100.0
"""Size of the box."""
_COLUMNS = 1000
"""Number of parts of the time axis of which the extremes are drawn: about one for each pixel."""


def curve(time: FloatArray, values: FloatArray, scale: Scale, name: str) -> Markup:
    """Return a curve; where values are NaN it is interrupted.

    Args:
        time: (N,) places on the time axis, 0 to 1.
        values: (N,) figures.
        scale: Axis of the figures.
        name: Class for its style.
    """
    chosen = extremes(values)
    return element(
        "path", d=_path(time[chosen], scale.share(values[chosen])), class_=f"curve {name}"
    )


def band(time: FloatArray, upper: FloatArray, scale: Scale, name: str) -> Markup:
    """Return the area below a curve."""
    chosen = extremes(upper)
    x, y = time[chosen], np.nan_to_num(scale.share(upper[chosen]), nan=0.0)
    if not len(x):
        return Markup()
    top = _path(x, y)
    edge = f"{x[-1] * WIDTH:.1f} {HEIGHT:.0f}L{x[0] * WIDTH:.1f} {HEIGHT:.0f}Z"
    return element("path", d=f"{top}L{edge}", class_=f"band {name}")


def level(value: float, scale: Scale, name: str) -> Markup:
    """Return a horizontal line."""
    y = HEIGHT * (1.0 - float(scale.share(np.array([value]))[0]))
    return element("path", d=f"M0 {y:.1f}H{WIDTH:.0f}", class_=f"level {name}")


def between(low: float, high: float, scale: Scale, name: str) -> Markup:
    """Return the area between two values."""
    bottom, top = HEIGHT * (1.0 - scale.share(np.array([low, high])))
    return element(
        "rect", x=0, y=float(top), width=WIDTH, height=float(bottom - top), class_=f"band {name}"
    )


def extremes(values: FloatArray) -> IntArray:
    """Return the indices of what must be drawn: of many values the least and largest of each part of the axis.

    A peak of one tick in a run of a day is seen, and a page stays small.
    """
    count = len(values)
    if count <= 2 * _COLUMNS:
        return np.arange(count)
    edges = np.linspace(0, count, _COLUMNS + 1).astype(np.int64)
    chosen = [0, count - 1]
    for begin, end in pairwise(edges):
        part = values[begin:end]
        missing = np.isnan(part)
        if missing.any():
            chosen.append(int(begin + np.argmax(missing)))
        if not missing.all():
            chosen += [int(begin + np.nanargmin(part)), int(begin + np.nanargmax(part))]
    return np.unique(np.array(chosen, dtype=np.int64))


def _path(x: FloatArray, y: FloatArray) -> str:
    """Return a path through points, 0 to 1 each, interrupted where one is NaN."""
    parts = []
    pen = "M"
    for across, up in zip(x * WIDTH, HEIGHT * (1.0 - y), strict=True):
        if np.isnan(up):
            pen = "M"
            continue
        parts.append(f"{pen}{across:.1f} {up:.1f}")
        pen = "L"
    return "".join(parts)
