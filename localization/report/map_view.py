"""Top view of a run: walls of the cloud, paths on them, and spots of interest; ``figures.html`` draws it."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from PIL import Image

from localization.geometry import FloatArray
from localization.report.curves import drawn
from localization.report.panels import Ticks, ticks_of
from localization.report.scales import Linear

_LARGEST = 900
"""Number of pixels of the longer side of the picture of the walls."""
_DENSEST = 14.0
"""Largest number of pixels for a metre: clouds have a point each 5 to 10 cm."""
_BLOCK = 2.0
"""Edge of the blocks within which the lowest point is the floor [m]."""
_HEIGHTS = (0.2, 2.0)
"""Heights above the floor of what is a wall in the picture [m]."""
_MARGIN = 1.0
"""Free space around what is drawn [m]."""
_HELD = 5.0
"""Distance of an estimate from all else up to which it may widen the map [m]."""
_LEG = 0.05
"""Least way between two points of a path that is drawn [m]."""
_JUMP = 0.5
"""Way within a tick from which a path is interrupted, where the robot was carried or found itself again [m]."""


@dataclass(frozen=True, slots=True)
class Spot:
    """A point of interest."""

    style: str
    """Class for its style."""
    title: str
    """What is there."""
    x: float
    """Place in ``map`` [m]."""
    y: float
    """Place in ``map`` [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class MapView:
    """What a map shows."""

    low: FloatArray
    """Lower left corner (2,) [m]."""
    size: FloatArray
    """Width and height (2,) [m]."""
    walls: str
    """PNG of the walls in base64; empty without any."""
    paths: Sequence[Markup]
    """Paths in metres, from the bottom to the top."""
    spots: Sequence[Spot]
    """Points of interest."""

    def outline(self, points: FloatArray, style: str) -> Markup:
        """Return a closed line through points (N, 2) [m], with a class for its style."""
        across, down = (points - self.low)[:, 0], (self.low + self.size - points)[:, 1]
        words = (f"{x:.3f} {y:.3f}" for x, y in zip(across, down, strict=True))
        return drawn(f"M{'L'.join(words)}Z", f"path {style}")

    @property
    def ticks(self) -> tuple[Ticks, Ticks]:
        """Ticks of x and of y, in ``map`` [m]."""
        axes = zip(self.low.tolist(), (self.low + self.size).tolist(), strict=True)
        x, y = (ticks_of(Linear(low, high), parts=8) for low, high in axes)
        return x, y

    def place(self, x: float, y: float) -> str:
        """Return the style that puts something at a point [m]."""
        across, up = 100.0 * (np.array([x, y]) - self.low) / self.size
        return f"left:{across:.2f}%;bottom:{up:.2f}%"


def map_view(
    points: FloatArray | None,
    true: FloatArray,
    paths: Sequence[tuple[str, FloatArray]],
    spots: Sequence[Spot],
) -> MapView:
    """Return the map around one or more runs.

    Args:
        points: (N, 3) points of the map's cloud [m]; without, the paths are drawn alone.
        true: (N, 2) all true places of robots, at least one [m].
        paths: Paths (N, 2) [m], with a class for the style of each.
        spots: Points of interest.
    """
    walls = np.zeros((0, 2)) if points is None else wall_points(points)
    every = np.concatenate([walls[_near(walls, true)], true])
    # An estimate that is far off must not shrink everything else.
    low, high = every.min(axis=0) - _HELD, every.max(axis=0) + _HELD
    for _, places in paths:
        every = np.concatenate([every, places[((places >= low) & (places <= high)).all(axis=1)]])
    low, high = every.min(axis=0) - _MARGIN, every.max(axis=0) + _MARGIN
    picture = _wall_picture(walls, low, high) if len(walls) else ""
    lines = [drawn(_path(places, low, high), f"path {style}") for style, places in paths]
    return MapView(low, high - low, picture, lines, spots)


def wall_points(points: FloatArray) -> FloatArray:
    """Return (M, 2) x and y of the points that are as high above the floor around them as walls and furniture."""
    if not len(points):
        return np.zeros((0, 2))
    blocks = np.floor(points[:, :2] / _BLOCK).astype(np.int64)
    _, block = np.unique(blocks, axis=0, return_inverse=True)
    floor = np.full(block.max() + 1, np.inf)
    np.minimum.at(floor, block.ravel(), points[:, 2])
    height = points[:, 2] - floor[block.ravel()]
    return np.asarray(points[(height > _HEIGHTS[0]) & (height < _HEIGHTS[1]), :2])


def _wall_picture(walls: FloatArray, low: FloatArray, high: FloatArray) -> str:
    """Return a PNG in base64: grey where there are walls, the denser the more points, and clear elsewhere."""
    scale = min(_LARGEST / float((high - low).max()), _DENSEST)
    columns, rows = np.maximum(1, np.ceil((high - low) * scale)).astype(int)
    cells = np.floor((walls - low) * scale).astype(np.int64)
    inside = ((cells >= 0) & (cells < [columns, rows])).all(axis=1)
    counts = np.zeros((rows, columns))
    np.add.at(counts, (rows - 1 - cells[inside, 1], cells[inside, 0]), 1.0)
    level = np.minimum(np.ceil(counts), 3).astype(np.uint8)
    image = Image.fromarray(level)
    image.putpalette([128] * 12)
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True, transparency=bytes([0, 130, 200, 255]))
    return base64.b64encode(file.getvalue()).decode("ascii")


def _near(walls: FloatArray, true: FloatArray) -> FloatArray:
    """Return which walls are near enough to the robot's path to be of interest, in a world of any size."""
    reach = max(10.0, 0.5 * float(np.ptp(true, axis=0).max()))
    low, high = true.min(axis=0) - reach, true.max(axis=0) + reach
    return np.asarray(((walls >= low) & (walls <= high)).all(axis=1))


def _path(points: FloatArray, low: FloatArray, high: FloatArray) -> str:
    """Return a path through points (N, 2) in a box with these corners, interrupted where the robot was carried."""
    known = points[np.isfinite(points).all(axis=1)]
    steps = np.hypot(*np.diff(known, axis=0, prepend=known[:1]).T)
    jumps = steps > _JUMP
    # Of each five centimetres of way the first point, and both ends of each piece.
    legs = np.floor(np.cumsum(np.where(jumps, 0.0, steps)) / _LEG)
    chosen = jumps | (np.diff(legs, prepend=-1.0) > 0.0)
    chosen[:-1] |= jumps[1:]
    chosen[-1:] = True
    across, down = known[chosen, 0] - low[0], high[1] - known[chosen, 1]
    pens = ["M", *("M" if jump else "L" for jump in jumps[chosen][1:])]
    return "".join(f"{pen}{x:.2f} {y:.2f}" for pen, x, y in zip(pens, across, down, strict=False))
