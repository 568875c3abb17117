"""Walls as blocks, split at their doors and windows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.scene_objects.blocks import Block, box
from robot_sim.scene_objects.plan_elements import Door, Wall, Window

DOUBLE_GLAZING: Final = 0.024
"""Thickness of double glazing [m]."""

_LEAST: Final = 1e-6
"""Thickness below which a part is omitted [m]."""


def wall_blocks(wall: Wall) -> Iterator[Block]:
    """Yield the blocks of a wall, with a lintel over each door and glass in each window.

    Raises:
        WorldError: an opening does not fit into the wall, or two overlap.
    """
    every: tuple[Door | Window, ...] = (*wall.doors, *wall.windows)
    openings = sorted(every, key=lambda opening: opening.at)
    edges = [0.0]
    for opening in openings:
        low, high = opening.at - 0.5 * opening.width, opening.at + 0.5 * opening.width
        if low < edges[-1] or high > wall.length:
            kind = "door" if isinstance(opening, Door) else "window"
            raise WorldError(
                f"wall {wall.name!r}: the {kind} at {opening.at:g} m does not fit into it"
            )
        edges += [low, high]
    edges.append(wall.length)
    for i, (low, high) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        if high - low > _LEAST:
            yield _piece(wall, f"{i}", low, high, 0.0, wall.height)
    for i, door in enumerate(o for o in openings if isinstance(o, Door)):
        if door.height < wall.height:
            yield _piece(wall, f"lintel_{i}", *_span(door), door.height, wall.height)
    for i, window in enumerate(o for o in openings if isinstance(o, Window)):
        yield from _window_blocks(wall, window, i)


def _window_blocks(wall: Wall, window: Window, index: int) -> Iterator[Block]:
    low, high = _span(window)
    top = window.sill + window.height
    if window.sill < 0.0 or top > wall.height:
        raise WorldError(
            f"wall {wall.name!r}: the window at {window.at:g} m reaches from {window.sill:g} m to"
            f" {top:g} m, the wall from 0 m to {wall.height:g} m"
        )
    if window.sill > _LEAST:
        yield _piece(wall, f"sill_{index}", low, high, 0.0, window.sill)
    if wall.height - top > _LEAST:
        yield _piece(wall, f"over_{index}", low, high, top, wall.height)
    pane = box(
        f"{wall.name}_pane_{index}", 0.5 * (low + high), 0.0, window.sill, top,
        (high - low, DOUBLE_GLAZING), "glass",
    )  # fmt: skip
    yield pane.moved(*wall.start, wall.yaw)


def _span(opening: Door | Window) -> tuple[float, float]:
    return opening.at - 0.5 * opening.width, opening.at + 0.5 * opening.width


def _piece(wall: Wall, label: str, low: float, high: float, bottom: float, top: float) -> Block:
    block = box(
        f"{wall.name}_{label}", 0.5 * (low + high), 0.0, bottom, top,
        (high - low, wall.thickness), wall.material,
    )  # fmt: skip
    return block.moved(*wall.start, wall.yaw)
