"""Top view of a run: walls of the cloud, true and estimated path, goals that were reached, and events."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

import numpy as np
from PIL import Image

from localization.geometry import FloatArray
from teleop.scenario.referee.outcome import Event, EventKind, Outcome
from teleop.scenario.reports.markup import Markup, element, joined

_SHOWN = {
    EventKind.FAULT,
    EventKind.GOAL,
    EventKind.CONTACT,
    EventKind.STOP,
    EventKind.HINT,
    EventKind.VIOLATION,
}
"""What has a place of interest."""
_LARGEST = 900
"""Number of pixels of the longer side of the picture of the walls."""
_DENSEST = 14.0
"""Largest number of pixels for a metre: clouds have a point each 5 to 10 cm."""
_BLOCK = 2.0
"""Edge of the blocks within which the lowest point is the floor [m]."""
_HEIGHTS = (0.2, 2.0)
"""Heights above the floor of what is a wall in the picture [m]."""
MARGIN = 1.0
"""Free space around what is drawn [m]."""
_LEG = 0.05
"""Least way between two points of a path that is drawn [m]."""
_JUMP = 0.5
"""Way within a tick from which a path is interrupted, where the robot was carried or found itself again [m]."""


def map_view(outcome: Outcome, points: FloatArray | None = None) -> Markup:
    """Return the map.

    Args:
        outcome: The outcome.
        points: (N, 3) points of the map's cloud [m]; without, the paths are drawn alone.
    """
    lines = outcome.lines
    walls = np.zeros((0, 2)) if points is None else wall_points(points)
    true, estimated = lines.true[:, :2], lines.estimated[:, :2]
    known = estimated[np.isfinite(estimated).all(axis=1)]
    shown = walls[near(walls, true)]
    every = np.concatenate([shown, true, _held(known, true, shown)])
    if not len(every):
        return element("p", "No tick was run.")
    low, high = every.min(axis=0) - MARGIN, every.max(axis=0) + MARGIN
    size = high - low
    picture = wall_picture(walls, low, high) if len(walls) else None
    drawn = element(
        "svg",
        path(estimated, low, high, "estimated"),
        path(true, low, high, "true"),
        viewBox=f"0 0 {size[0]:.3f} {size[1]:.3f}",
        preserveAspectRatio="none",
        role="img",
        aria_label="true and estimated path",
    )
    image = picture and element("img", src=f"data:image/png;base64,{picture}", alt="walls")
    marks = [
        _mark(event, number, low, size)
        for number, event in enumerate(outcome.events, 1)
        if event.kind in _SHOWN
    ]
    begin = [spot(true[0], low, size, "begin", "start")] if len(true) else []
    end = [spot(true[-1], low, size, "end", "end")] if len(true) else []
    ratio = f"aspect-ratio:{size[0]:.3f}/{size[1]:.3f};max-width:{100 * size[0] / size[1]:.0f}vh"
    keys = (("true", "true path"), ("estimated", "estimated"), ("begin", "start"), ("end", "end"))
    legend = [element("span", element("i", class_=f"key {n}"), t) for n, t in keys]
    legend.append(element("span", f"{size[0]:.0f} x {size[1]:.0f} m"))
    return joined(
        element("div", *legend, class_="head"),
        element("div", image, drawn, *begin, *end, *marks, class_="map", style=ratio),
    )


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


def wall_picture(walls: FloatArray, low: FloatArray, high: FloatArray) -> str:
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


def near(walls: FloatArray, true: FloatArray) -> FloatArray:
    """Return which walls are near enough to the robot's path to be of interest, in a world of any size."""
    if not len(true):
        return np.ones(len(walls), dtype=bool)
    reach = max(10.0, 0.5 * float(np.ptp(true, axis=0).max()))
    low, high = true.min(axis=0) - reach, true.max(axis=0) + reach
    return np.asarray(((walls >= low) & (walls <= high)).all(axis=1))


def _held(estimated: FloatArray, true: FloatArray, walls: FloatArray) -> FloatArray:
    """Return the estimates that may widen the map: an estimate that is far off must not shrink everything else."""
    every = np.concatenate([true, walls])
    if not len(every):
        return np.zeros((0, 2))
    low, high = every.min(axis=0) - 5.0, every.max(axis=0) + 5.0
    return np.asarray(estimated[((estimated >= low) & (estimated <= high)).all(axis=1)])


def path(points: FloatArray, low: FloatArray, high: FloatArray, name: str) -> Markup:
    """Return a path through points (N, 2) in a box with these corners, interrupted where the robot was carried."""
    known = points[np.isfinite(points).all(axis=1)]
    steps = np.hypot(*np.diff(known, axis=0, prepend=known[:1]).T)
    jumps = steps > _JUMP
    # Of each five centimetres of way the first point, and both ends of each piece.
    legs = np.floor(np.cumsum(np.where(jumps, 0.0, steps)) / _LEG)
    drawn = jumps | (np.diff(legs, prepend=-1.0) > 0.0)
    drawn[:-1] |= jumps[1:]
    drawn[-1:] = True
    across, down = known[drawn, 0] - low[0], high[1] - known[drawn, 1]
    pens = ["M", *("M" if jump else "L" for jump in jumps[drawn][1:])]
    words = (f"{pen}{x:.2f} {y:.2f}" for pen, x, y in zip(pens, across, down, strict=False))
    return element("path", d="".join(words), class_=f"path {name}")


def _mark(event: Event, number: int, low: FloatArray, size: FloatArray) -> Markup:
    return element(
        "a",
        number,
        href=f"#event-{number}",
        class_=f"mark on-{event.kind.value}",
        style=place(np.array([event.x, event.y]), low, size),
        title=f"{event.stamp / 1e9:.1f} s: {event.text}",
    )


def spot(point: FloatArray, low: FloatArray, size: FloatArray, name: str, title: str) -> Markup:
    """Return a mark at a point (2,), with a class for its style and a title."""
    return element("i", class_=f"spot {name}", style=place(point, low, size), title=title)


def place(point: FloatArray, low: FloatArray, size: Sequence[float] | FloatArray) -> str:
    """Return the style that puts something at a point (2,) of the map."""
    across, up = 100.0 * (point - low) / size
    return f"left:{across:.2f}%;bottom:{up:.2f}%"
