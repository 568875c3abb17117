"""Doors, windows and walls of a generated building: every cell has a door, most to a corridor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.building_generator.room_layout import CellEdge, RoomLayout
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Door, Wall, Window

INSIDE: Final = 0.12
"""Thickness of walls between cells [m]."""
OUTSIDE: Final = 0.24
"""Thickness of the walls around the building [m]."""
_DOORS: Final = (9, 10, 10, 11, 12)
"""Widths of ordinary doors [dm]; the robot is half a metre wide."""
_WIDE: Final = (12, 14, 16)
"""Widths of the doors of large rooms [dm]."""
_JAMB: Final = 3
"""Least distance between a door and the next corner [dm]."""
_LARGE: Final = 40.0
"""Area from which on a room is large [m^2]."""


@dataclass(frozen=True, slots=True)
class Opening:
    """An opening in an edge: a door, or the whole edge where two corridors meet."""

    edge: CellEdge
    """The edge that it is in."""
    at: int
    """Its middle along the edge's line [dm]."""
    width: int
    """Width of the opening [dm]."""
    walled: bool = True
    """Whether there is a wall around it."""


def openings(rng: np.random.Generator, plan: RoomLayout) -> tuple[Opening, ...]:
    """Return the openings between a layout's cells, which connect all of them.

    Raises:
        WorldError: a cell has no wall that is long enough for a door.
    """
    corridors = {i for i, cell in enumerate(plan.cells) if cell.corridor}
    shared = [e for e in plan.edges if len(e.cells) == 2]
    made: list[Opening] = []
    entered = {min(corridors)}
    while len(entered) < len(plan.cells):
        ways = [e for e in shared if len(entered & set(e.cells)) == 1 and _room_for_door(e)]
        if not ways:
            raise WorldError("a room of the floor plan has no wall long enough for a door")
        # Corridors first, then rooms from corridors, then rooms from rooms.
        rank = [len(set(e.cells) - corridors) for e in ways]
        ways = [e for e, r in zip(ways, rank, strict=True) if r == min(rank)]
        edge = max(ways, key=lambda e: e.length)
        made.append(_opening(rng, plan, edge))
        entered.update(edge.cells)
    used = {o.edge for o in made}
    for edge in shared:
        if edge in used or not _room_for_door(edge):
            continue
        both_corridors = set(edge.cells) <= corridors
        largest = max(plan.cells[i].rectangle.area for i in edge.cells)
        likely = 0.5 if largest > _LARGE and set(edge.cells) & corridors else 0.12
        if both_corridors or rng.random() < likely:
            made.append(_opening(rng, plan, edge))
    return tuple(made)


def _room_for_door(edge: CellEdge) -> bool:
    return edge.length > min(_DOORS) + 2 * _JAMB


def _opening(rng: np.random.Generator, plan: RoomLayout, edge: CellEdge) -> Opening:
    cells = [plan.cells[i] for i in edge.cells]
    if all(c.corridor for c in cells):
        return Opening(edge, (edge.low + edge.high) // 2, edge.length, walled=False)
    large = all(c.corridor or c.rectangle.area >= _LARGE for c in cells)
    width = int(rng.choice(_WIDE if large else _DOORS))
    width = min(width, edge.length - 2 * _JAMB - 1)
    low, high = edge.low + _JAMB + (width + 1) // 2, edge.high - _JAMB - (width + 1) // 2
    return Opening(edge, int(rng.integers(low, high + 1)), width)


def windows(rng: np.random.Generator, plan: RoomLayout) -> dict[CellEdge, tuple[int, int]]:
    """Return the middle and the width [dm] of the window in each outer edge that has one."""
    panes = {}
    for edge in plan.edges:
        widest = edge.length - 12
        if len(edge.cells) == 1 and widest >= 8 and rng.random() < 0.75:
            width = int(rng.integers(min(8, widest), min(widest, 30) + 1))
            slack = (edge.length - width) // 2 - 4
            at = (edge.low + edge.high) // 2 + int(rng.integers(-slack, slack + 1))
            panes[edge] = (at, width)
    return panes


def walls(
    plan: RoomLayout,
    ways: Sequence[Opening],
    panes: dict[CellEdge, tuple[int, int]],
    *,
    height: float,
) -> tuple[Wall, ...]:
    """Return the walls along all edges except open ones; edges in one line share a wall."""
    open_ = {o.edge for o in ways if not o.walled}
    built: list[Wall] = []
    for run in _runs([e for e in plan.edges if e not in open_]):
        first, on_it = run[0], set(run)
        doors = [o for o in ways if o.edge in on_it]
        start = first.low
        outside = len(first.cells) == 1
        built.append(
            Wall(
                name=f"{'outer' if outside else 'inner'}_{len(built)}",
                start=_point(first, start),
                end=_point(first, run[-1].high),
                height=height,
                thickness=OUTSIDE if outside else INSIDE,
                doors=tuple(
                    Door((o.at - start) / 10, o.width / 10)
                    for o in sorted(doors, key=lambda o: o.at)
                ),
                windows=tuple(
                    Window((panes[e][0] - start) / 10, panes[e][1] / 10) for e in run if e in panes
                ),
            )
        )
    return tuple(built)


def _point(edge: CellEdge, along: int) -> tuple[float, float]:
    return (edge.at / 10, along / 10) if edge.upright else (along / 10, edge.at / 10)


def _runs(edges: Sequence[CellEdge]) -> Iterator[list[CellEdge]]:
    """Yield the edges that follow each other on one line, outer and inner ones separately."""
    run: list[CellEdge] = []
    for edge in sorted(edges, key=lambda e: (len(e.cells), e.upright, e.at, e.low)):
        if run:
            last = run[-1]
            same_line = (last.upright, last.at) == (edge.upright, edge.at)
            if not (same_line and last.high == edge.low and len(last.cells) == len(edge.cells)):
                yield run
                run = []
        run.append(edge)
    if run:
        yield run
