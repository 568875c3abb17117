"""Generated buildings: rooms, doors, furniture, places and routes from a seed and an area."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_sim.building_generator.doors_and_windows import (
    INSIDE,
    OUTSIDE,
    Opening,
    openings,
    walls,
    windows,
)
from robot_sim.building_generator.furnishing import Box, Furnisher, RoomDoor, hub_and_ways, numbered
from robot_sim.building_generator.room_layout import Rectangle, RoomLayout, draw_room_layout
from robot_sim.building_generator.room_types import CORRIDOR, HOME, OFFICE, RoomUse, choose_room_use
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Piece, Placement, Plan, Waypoint
from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.footprints import footprints
from robot_sim.layout.route_planning import TOUR_LIMIT, RoutePlanner, turning_clearance
from robot_sim.robot.p3at import P3AT

AREAS: Final = (60.0, 10_000.0)
"""Range of the area of a building [m^2]."""
_HOMELY: Final = 250.0
"""Largest area of a building that may be a house [m^2]."""
_ATTEMPTS: Final = 50
_SURVEYED: Final = 36.0
"""Area above which the survey visits more than one spot of a room [m^2]."""


@dataclass(frozen=True, slots=True)
class Room:
    """A room of a generated building, or a stretch of corridor."""

    name: str
    """Name of the room, and of its place."""
    rectangle: Rectangle
    """Its outline between wall centre lines."""
    pieces: tuple[str, ...]
    """Names of its furniture."""


@dataclass(frozen=True, slots=True)
class Building:
    """A generated building."""

    seed: int
    """Seed that it was generated from."""
    style: str
    """Style of the building: ``office`` or ``house``."""
    plan: Plan
    """Its floor plan."""
    rooms: tuple[Room, ...]
    """Its rooms and corridors."""


def generate(seed: int, area: float, *, name: str | None = None) -> Building:
    """Generate a furnished building; the same seed and area always give the same one.

    Every room can be reached from the spawn with the robot's swing radius plus ``MARGIN``.

    Args:
        seed: Integer >= 0.
        area: Area of the floor [m^2], within ``AREAS``; met to within a few percent.
        name: Name of the world; ``building-<seed>`` by default.

    Raises:
        WorldError: seed or area are invalid.
    """
    if isinstance(seed, bool) or seed != int(seed) or seed < 0:
        raise WorldError(f"seed must be an integer >= 0, got {seed}")
    if not AREAS[0] <= area <= AREAS[1]:
        raise WorldError(f"area must be {AREAS[0]:g} to {AREAS[1]:g} m^2, got {area:g}")
    name = name or f"building-{seed}"
    for attempt in range(_ATTEMPTS):
        entropy = [int(seed), round(100 * area), attempt]
        rng = np.random.default_rng(np.random.SeedSequence(entropy))
        try:
            return _attempt(rng, int(seed), area, name)
        except _Unfit:
            continue
    raise WorldError(f"seed {seed} gives no building of {area:g} m^2; try another seed")


class _Unfit(Exception):
    """This draft cannot be built; the next one may."""


def _attempt(rng: np.random.Generator, seed: int, area: float, name: str) -> Building:
    floor = draw_room_layout(rng, area)
    try:
        ways = openings(rng, floor)
    except WorldError as error:
        raise _Unfit from error
    homely = area <= _HOMELY and rng.random() < 0.5
    height = float(rng.choice((2.5, 2.6, 2.8, 3.0)))
    built = walls(floor, ways, windows(rng, floor), height=height)
    drafts = tuple(_furnished(rng, floor, ways, HOME if homely else OFFICE))
    pieces = iter(numbered([p for d in drafts for p in d.pieces]))
    named = [tuple(next(pieces) for _ in d.pieces) for d in drafts]
    furniture = tuple(p for room in named for p in room)
    bare = Plan(
        name=name,
        bounds=(0.0, 0.0, floor.outline.x1 / 10, floor.outline.y1 / 10),
        spawns={"spawn": Placement(1.0, 1.0)},
        height=height,
        walls=built,
        furniture=furniture,
    )
    space = ClearanceGrid.around(bare.bounds, footprints(bare))
    least = turning_clearance(P3AT())
    start = _start(drafts)
    reach = RoutePlanner(space, start.hub, least=least)
    places = {d.name: _place(d, reach) for d in drafts}
    spots = [(p.x, p.y) for p in places.values()]
    more = [s for d in drafts for s in _more_spots(d, reach)]
    spawn = places[start.name]
    # Routes begin where the robot stands, which need not be the hub.
    reach = RoutePlanner(space, (spawn.x, spawn.y), least=least)
    plan = Plan(
        name=name,
        bounds=bare.bounds,
        spawns={"spawn": spawn},
        height=height,
        walls=built,
        furniture=furniture,
        places=places,
        tour=reach.bounded_trip(
            [s for d, s in zip(drafts, spots, strict=True) if not d.corridor], TOUR_LIMIT
        ),
        survey=reach.round_trip([*spots, *more]),
    )
    rooms = tuple(
        Room(d.name, d.rectangle, tuple(p.name for p in own))
        for d, own in zip(drafts, named, strict=True)
    )
    return Building(seed, "house" if homely else "office", plan, rooms)


@dataclass(frozen=True, slots=True)
class _Draft:
    """A furnished room before its furniture has unique names."""

    name: str
    rectangle: Rectangle
    corridor: bool
    hub: Waypoint
    pieces: tuple[Piece, ...]


def _furnished(
    rng: np.random.Generator,
    floor: RoomLayout,
    ways: Sequence[Opening],
    uses: Mapping[str, RoomUse],
) -> Iterator[_Draft]:
    taken: list[str] = []
    for i, cell in enumerate(floor.cells):
        r = cell.rectangle
        inner = _inner(r, floor.outline)
        kind = "corridor" if cell.corridor else choose_room_use(rng, uses, r.area, taken)
        taken.append(kind)
        doors = [_doorway(o, r) for o in ways if i in o.edge.cells]
        hub, free = hub_and_ways(rng, inner, doors, along=cell.corridor)
        furnisher = Furnisher(rng, inner, doors, free)
        furnisher.furnish(CORRIDOR if cell.corridor else uses[kind])
        name = f"{kind}_{taken.count(kind)}"
        yield _Draft(name, r, cell.corridor, hub, tuple(furnisher.pieces))


def _inner(room: Rectangle, outline: Rectangle) -> Box:
    """Return the floor between the inner faces of a room's walls [m]."""
    half = [
        0.5 * (OUTSIDE if at == rim else INSIDE)
        for at, rim in (
            (room.x0, outline.x0),
            (room.y0, outline.y0),
            (room.x1, outline.x1),
            (room.y1, outline.y1),
        )
    ]
    x0, y0, x1, y1 = (v / 10 for v in (room.x0, room.y0, room.x1, room.y1))
    return x0 + half[0], y0 + half[1], x1 - half[2], y1 - half[3]


def _doorway(opening: Opening, room: Rectangle) -> RoomDoor:
    at, along = opening.edge.at, opening.at / 10
    if opening.edge.upright:
        inward = (1, 0) if at == room.x0 else (-1, 0)
        return RoomDoor(at / 10, along, inward, opening.width / 10)
    inward = (0, 1) if at == room.y0 else (0, -1)
    return RoomDoor(along, at / 10, inward, opening.width / 10)


def _start(drafts: Sequence[_Draft]) -> _Draft:
    """Return the room with the spawn: a hall if there is one, otherwise the main corridor."""
    halls = [d for d in drafts if d.name.startswith(("hall_", "living_room_"))]
    return halls[0] if halls else next(d for d in drafts if d.corridor)


def _window_of(draft: _Draft, space: ClearanceGrid) -> tuple[slice, slice]:
    r = draft.rectangle
    return slice(r.y0, r.y1 + 1), slice(r.x0, r.x1 + 1)


def _place(draft: _Draft, reach: RoutePlanner) -> Placement:
    """Return the roomiest reachable spot of a room, near its hub.

    Raises:
        _Unfit: no spot of the room is roomy enough.
    """
    rows, columns = _window_of(draft, reach.space)
    reached = reach.reached[rows, columns]
    clearance = reach.space.clearance[rows, columns]
    y, x = np.mgrid[: clearance.shape[0], : clearance.shape[1]]
    here = np.hypot(
        x * 0.1 + draft.rectangle.x0 / 10 - draft.hub[0],
        y * 0.1 + draft.rectangle.y0 / 10 - draft.hub[1],
    )
    worth = np.where(reached, np.minimum(clearance, 1.2) - 0.15 * here, -np.inf)
    best = int(np.argmax(worth))
    row, column = np.unravel_index(best, worth.shape)
    if not np.isfinite(worth[row, column]) or clearance[row, column] < P3AT().swing_radius + 0.15:
        raise _Unfit
    px = (draft.rectangle.x0 + int(column)) / 10
    py = (draft.rectangle.y0 + int(row)) / 10
    r = draft.rectangle
    # Facing along the longer side, where there is more to see.
    toward = (0.05 * (r.x0 + r.x1) - px, 0.05 * (r.y0 + r.y1) - py)
    if r.width >= r.depth:
        yaw = 0.0 if toward[0] >= 0.0 else math.pi
    else:
        yaw = 0.5 * math.pi if toward[1] >= 0.0 else -0.5 * math.pi
    return Placement(px, py, yaw)


def _more_spots(draft: _Draft, reach: RoutePlanner) -> Iterator[Waypoint]:
    """Yield spots from which, with a room's place, all of a large or long room is seen."""
    r = draft.rectangle
    if r.area <= _SURVEYED and r.longer <= 80:
        return
    count_x, count_y = (max(1, round(side / 60)) for side in (r.width, r.depth))
    rows, columns = _window_of(draft, reach.space)
    clearance = np.where(reach.reached, reach.space.clearance, 0.0)[rows, columns]
    for part in r.cut(True, *(r.x0 + r.width * i // count_x for i in range(1, count_x))):
        for cell in part.cut(False, *(r.y0 + r.depth * i // count_y for i in range(1, count_y))):
            window = clearance[
                cell.y0 - r.y0 : cell.y1 - r.y0 + 1, cell.x0 - r.x0 : cell.x1 - r.x0 + 1
            ]
            row, column = np.unravel_index(int(np.argmax(window)), window.shape)
            if window[row, column] > 0.0:
                yield (cell.x0 + int(column)) / 10, (cell.y0 + int(row)) / 10
