"""Curves and areas as paths of SVG in a box of 1000 by 100 that is stretched to the panel's size."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from localization.geometry import FloatArray
from localization.report.scales import Scale
from localization.types import IntArray

WIDTH, HEIGHT = 1000.0, 100.0
"""Size of the box."""
_COLUMNS = 1000
"""Number of parts of the time axis of which the extremes are drawn: about one for each pixel."""


def curve(time: FloatArray, values: FloatArray, scale: Scale, style: str) -> Markup:
    """Return a curve; where values are NaN it is interrupted.

    Args:
        time: (N,) places on the time axis, 0 to 1.
        values: (N,) figures.
        scale: Axis of the figures.
        style: Class for its style.
    """
    chosen = extremes(values)
    return drawn(_path(time[chosen], scale.share(values[chosen])), f"curve {style}")


def level(value: float, scale: Scale, style: str) -> Markup:
    """Return a horizontal line."""
    return drawn(_path(np.array([0.0, 1.0]), scale.share(np.full(2, value))), f"level {style}")


def area(time: FloatArray, low: FloatArray, high: FloatArray, scale: Scale, style: str) -> Markup:
    """Return the area between two curves; where values are NaN they are at the bottom."""
    chosen = np.union1d(extremes(low), extremes(high))
    x, below, above = time[chosen], *(np.nan_to_num(scale.share(v[chosen])) for v in (low, high))
    around = _path(np.concatenate([x, x[::-1]]), np.concatenate([above, below[::-1]]))
    return drawn(f"{around}Z" if around else "", f"band {style}")


def upright(x: FloatArray, low: FloatArray, high: FloatArray, scale: Scale, style: str) -> Markup:
    """Return an upright line from one figure to another at each of these places (N,), 0 to 1."""
    ends = HEIGHT * (1.0 - scale.share(np.stack([low, high])))
    words = (f"M{a:.1f} {b:.1f}V{t:.1f}" for a, b, t in zip(x * WIDTH, *ends, strict=True))
    return drawn("".join(words), f"curve {style}")


def dots(x: FloatArray, values: FloatArray, scale: Scale, style: str) -> Markup:
    """Return a dot at each figure, (N,) at places (N,), 0 to 1."""
    heights = HEIGHT * (1.0 - scale.share(values))
    words = (f"M{a:.1f} {up:.1f}h0" for a, up in zip(x * WIDTH, heights, strict=True))
    return drawn("".join(words), f"curve dots {style}")


def bars(shares: FloatArray) -> Markup:
    """Return bars of these heights (N,), 0 to 1, side by side."""
    width = WIDTH / len(shares)
    heights = HEIGHT * (1.0 - shares)
    words = (
        f"M{i * width + 1:.1f} {HEIGHT:.0f}V{top:.1f}h{width - 2:.1f}V{HEIGHT:.0f}Z"
        for i, top in enumerate(heights)
    )
    return drawn("".join(words), "bar")


def drawn(path: str, style: str) -> Markup:
    """Return a path of SVG with classes for its style."""
    return Markup('<path d="{}" class="{}"/>').format(path, style)


def extremes(values: FloatArray) -> IntArray:
    """Return the indices of what must be drawn: of many values the least and largest of each part of the axis.

    A peak of one tick in a run of a day is seen, and a page stays small.
    """
    count = len(values)
    if count <= 2 * _COLUMNS:
        return np.arange(count)
    width = -(-count // _COLUMNS)
    parts = np.full((_COLUMNS, width), np.nan)
    parts.flat[:count] = values
    missing = np.isnan(parts)
    least = np.where(missing, np.inf, parts).argmin(axis=1)
    most = np.where(missing, -np.inf, parts).argmax(axis=1)
    begin, gap = np.arange(_COLUMNS) * width, missing.any(axis=1)
    gaps = (begin + missing.argmax(axis=1))[gap]
    chosen = np.concatenate([begin + least, begin + most, gaps, [0, count - 1]])
    return np.unique(np.minimum(chosen, count - 1))


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
