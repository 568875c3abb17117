"""Room types of generated buildings, and the groups of furniture of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np


@dataclass(frozen=True, slots=True)
class Item:
    """A piece of furniture in a group; the group's +y points to the wall behind it."""

    kind: str
    """Kind of furniture, a key of ``furniture.FURNITURE``."""
    x: float
    """x from the group's middle [m]."""
    y: float
    """y from the group's middle [m]."""
    yaw: int = 0
    """Yaw in the group's frame [degrees]."""
    size: tuple[float, float, float] | None = None
    """Width (along its x), depth and height [m]; None for the kind's own."""


@dataclass(frozen=True, slots=True)
class Group:
    """Pieces of furniture that belong together, within an axis-parallel rectangle."""

    width: float
    """Extent along the wall [m]."""
    depth: float
    """Extent away from the wall [m]."""
    items: tuple[Item, ...]
    """The pieces."""
    at_wall: bool = True
    """Whether its back is placed at a wall; otherwise it stands anywhere."""


GroupMaker = Callable[[np.random.Generator], Group]


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a length, rounded to a decimetre."""
    return round(float(rng.uniform(low, high)), 1)


def _alone(kind: str, width: tuple[float, float], depth: float, height: float) -> GroupMaker:
    """Return the maker of a single piece with its back to the wall."""

    def make(rng: np.random.Generator) -> Group:
        wide = _between(rng, *width)
        return Group(wide, depth, (Item(kind, 0.0, 0.0, 0, (wide, depth, height)),))

    return make


def _desk(rng: np.random.Generator) -> Group:
    wide = _between(rng, 1.2, 1.8)
    chair = Item("chair", _between(rng, -0.2, 0.2), -0.5, 90 + int(rng.integers(-25, 26)))
    return Group(wide, 1.5, (Item("desk", 0.0, 0.35, 0, (wide, 0.8, 0.74)), chair))


def _desk_island(rng: np.random.Generator) -> Group:
    """Make four desks, two by two, with a chair at each."""
    items: list[Item] = []
    for x in (-0.8, 0.8):
        for side in (-1, 1):
            items.append(Item("desk", x, 0.4 * side))
            turn = int(rng.integers(-25, 26))
            items.append(Item("chair", x + _between(rng, -0.2, 0.2), 1.15 * side, turn - 90 * side))
    return Group(3.2, 2.9, tuple(items), at_wall=False)


def _table_with_chairs(rng: np.random.Generator) -> Group:
    seats = int(rng.integers(2, 5))
    wide = round(0.7 * seats + 0.2, 1)
    items = [Item("table", 0.0, 0.0, 0, (wide, 1.0, 0.74))]
    for i in range(seats):
        x = 0.7 * (i - 0.5 * (seats - 1))
        for side in (-1, 1):
            if rng.random() < 0.9:
                turn = int(rng.integers(-15, 16))
                items.append(Item("chair", round(x, 3), 0.75 * side, turn - 90 * side))
    return Group(wide, 2.1, tuple(items), at_wall=False)


def _round_table(rng: np.random.Generator) -> Group:
    chairs = (Item("chair", -0.8, 0.0, 0), Item("chair", 0.8, 0.0, 180))
    some = chairs[: int(rng.integers(1, 3))]
    return Group(2.2, 1.0, (Item("round_table", 0.0, 0.0), *some), at_wall=False)


def _seating(rng: np.random.Generator) -> Group:
    wide = _between(rng, 1.6, 2.4)
    table = Item("table", 0.0, -0.6, 0, (1.0, 0.5, 0.45))
    return Group(wide, 1.7, (Item("sofa", 0.0, 0.4, 0, (wide, 0.85, 0.8)), table))


def _bed(rng: np.random.Generator) -> Group:
    wide = float(rng.choice((0.9, 1.4, 1.6)))
    head = Item("counter", 0.0, 0.99, 0, (wide, 0.06, 0.9))
    return Group(wide, 2.1, (Item("counter", 0.0, -0.06, 0, (wide, 2.0, 0.5)), head))


def _kitchen(rng: np.random.Generator) -> Group:
    wide = _between(rng, 1.4, 2.8)
    fridge = Item("cabinet", 0.5 * wide + 0.05, 0.0, 0, (0.6, 0.6, 1.8))
    return Group(wide + 0.7, 0.6, (Item("counter", -0.35, 0.0, 0, (wide, 0.6, 0.92)), fridge))


def _bookcases(rng: np.random.Generator) -> Group:
    """Make two shelves back to back."""
    wide = _between(rng, 1.6, 2.6)
    size = (wide, 0.35, 1.9)
    pair = (Item("shelf", 0.0, -0.2, 0, size), Item("shelf", 0.0, 0.2, 180, size))
    return Group(wide, 0.8, pair, at_wall=False)


def _boxes(rng: np.random.Generator) -> Group:
    size = (_between(rng, 0.4, 0.7), _between(rng, 0.3, 0.5), _between(rng, 0.3, 0.8))
    return Group(0.9, 0.9, (Item("box", 0.0, 0.0, int(rng.integers(-40, 41)), size),))


def _workbench(rng: np.random.Generator) -> Group:
    wide = _between(rng, 1.8, 2.8)
    return Group(wide, 0.9, (Item("table", 0.0, 0.0, 0, (wide, 0.9, 0.85)),))


def _free_pillar(rng: np.random.Generator) -> Group:
    kind = str(rng.choice(("pillar", "round_pillar")))
    return Group(0.4, 0.4, (Item(kind, 0.0, 0.0),), at_wall=False)


_shelf = _alone("shelf", (0.9, 2.0), 0.35, 1.9)
_cabinet = _alone("cabinet", (0.8, 1.2), 0.45, 1.2)
_locker = _alone("cabinet", (0.6, 1.0), 0.3, 1.1)
_counter = _alone("counter", (1.2, 3.0), 0.6, 0.92)
_plant = _alone("plant", (0.4, 0.6), 0.5, 1.5)
_tub = _alone("counter", (1.6, 1.7), 0.75, 0.55)
_basin = _alone("counter", (0.6, 1.0), 0.45, 0.85)
_pilaster = _alone("pillar", (0.3, 0.5), 0.2, 2.8)


@dataclass(frozen=True, slots=True)
class RoomUse:
    """A use of a room."""

    areas: tuple[float, float]
    """Range of the area of suitable rooms [m^2]."""
    weight: float
    """Relative frequency of the use."""
    musts: tuple[GroupMaker, ...]
    """Groups that are placed first."""
    mays: tuple[GroupMaker, ...]
    """Groups that are placed at random afterwards, where they fit."""
    density: float = 0.2
    """Number of optional groups per square metre."""


OFFICE: Final[Mapping[str, RoomUse]] = MappingProxyType(
    {
        "office": RoomUse((6, 30), 5, (_desk,), (_desk, _shelf, _cabinet, _plant, _boxes)),
        "open_office": RoomUse(
            (28, 150), 6, (_desk_island,), (_desk_island, _desk, _shelf, _cabinet, _plant)
        ),
        "meeting_room": RoomUse((12, 60), 3, (_table_with_chairs,), (_cabinet, _plant, _shelf, _counter), 0.1),
        "kitchen": RoomUse((8, 35), 1.2, (_kitchen,), (_round_table, _cabinet, _plant)),
        "library": RoomUse((15, 90), 1.2, (_shelf, _bookcases), (_shelf, _bookcases, _round_table)),
        "lounge": RoomUse((14, 90), 1.2, (_seating,), (_seating, _round_table, _plant, _shelf)),
        "workshop": RoomUse((16, 120), 1.2, (_workbench,), (_workbench, _cabinet, _boxes, _shelf)),
        "washroom": RoomUse((6, 16), 1, (_basin,), (_basin, _cabinet), 0.15),
        "store": RoomUse((6, 30), 1, (_shelf,), (_shelf, _boxes, _boxes, _cabinet), 0.4),
        "hall": RoomUse(
            (60, 400), 5, (_counter, _free_pillar), (_seating, _plant, _free_pillar, _round_table),
            0.08,
        ),
    }
)  # fmt: skip
"""Uses of rooms in an office building."""

HOME: Final[Mapping[str, RoomUse]] = MappingProxyType(
    {
        "living_room": RoomUse((14, 90), 3, (_seating, _shelf), (_seating, _table_with_chairs, _plant)),
        "kitchen": RoomUse((8, 30), 2, (_kitchen,), (_table_with_chairs, _round_table, _counter)),
        "bedroom": RoomUse((8, 40), 4, (_bed, _cabinet), (_shelf, _cabinet, _desk, _plant)),
        "bathroom": RoomUse((5, 14), 2, (_tub, _basin), (_cabinet,), 0.1),
        "study": RoomUse((8, 30), 2, (_desk, _shelf), (_shelf, _seating, _plant)),
        "store": RoomUse((5, 20), 1, (_shelf,), (_shelf, _boxes, _boxes), 0.4),
        "games_room": RoomUse(
            (28, 400), 1, (_table_with_chairs, _free_pillar), (_seating, _plant, _boxes), 0.12
        ),
    }
)  # fmt: skip
"""Uses of rooms in a house."""

CORRIDOR: Final = RoomUse((0, 1e9), 1, (), (_locker, _pilaster, _pilaster, _plant), 0.08)
"""Furniture along a corridor's walls."""


def choose_room_use(
    rng: np.random.Generator, uses: Mapping[str, RoomUse], area: float, taken: Sequence[str]
) -> str:
    """Draw the use of a room of an area [m^2]; uses that exist already are less likely."""
    names = [n for n, use in uses.items() if use.areas[0] <= area <= use.areas[1]]
    if not names:
        small = area < min(use.areas[0] for use in uses.values())
        pick = min if small else max
        return pick(uses, key=lambda n: uses[n].areas[0 if small else 1])
    weights = np.array([uses[n].weight / (1.0 + 0.7 * taken.count(n)) for n in names])
    return names[int(rng.choice(len(names), p=weights / weights.sum()))]
