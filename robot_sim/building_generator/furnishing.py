"""Furnishing of a generated room: groups of furniture, clear of doors and of paths through the room."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.building_generator.room_types import Group, RoomUse
from robot_sim.floorplan.plan import Piece

WAY: Final = 0.62
"""Free width on both sides of the paths through a room [m]: the robot's swing radius and 0.28 m."""
_GAP: Final = 0.1
"""Distance between groups [m]."""
_AISLE: Final = 0.9
"""Distance between a free-standing group and everything else [m]."""
_TRIES: Final = 40
"""Number of positions that are tried for a group."""

Box = tuple[float, float, float, float]
"""Smallest x, y and largest x, y [m]."""


@dataclass(frozen=True, slots=True)
class RoomDoor:
    """A door of a room as seen from inside."""

    x: float
    """x of its middle, in the wall's centre line [m]."""
    y: float
    """y of its middle, in the wall's centre line [m]."""
    inward: tuple[int, int]
    """Unit vector into the room."""
    width: float
    """Width of the door [m]."""

    def ahead(self, distance: float) -> tuple[float, float]:
        """Return the point at a distance [m] inside the room."""
        return self.x + distance * self.inward[0], self.y + distance * self.inward[1]

    @property
    def clear(self) -> Box:
        """The area that must be free to enter straight [m]."""
        half, deep = 0.5 * self.width + 0.1, 1.1
        (x, y), (u, v) = self.ahead(0.5 * deep), self.inward
        dx, dy = abs(u) * 0.5 * deep + abs(v) * half, abs(v) * 0.5 * deep + abs(u) * half
        return x - dx, y - dy, x + dx, y + dy


class Furnisher:
    """One room and the furniture placed in it so far."""

    def __init__(
        self, rng: np.random.Generator, inner: Box, doors: Sequence[RoomDoor], ways: FloatArray
    ) -> None:
        """Begin with an empty room.

        Args:
            rng: Source of all random choices.
            inner: The floor between the inner faces of the walls.
            doors: The doors of the room.
            ways: Points (N, 2) of the paths that stay free, a decimetre apart [m].
        """
        self._rng = rng
        self._inner = inner
        self._doors = [d.clear for d in doors]
        self._ways = ways
        self._taken: list[Box] = []
        self.pieces: list[Piece] = []

    def furnish(self, use: RoomUse) -> None:
        """Place the furniture that the use requires, and some of what it allows, where it fits."""
        for make in use.musts:
            self._put(make(self._rng))
        x0, y0, x1, y1 = self._inner
        for _ in range(round(use.density * (x1 - x0) * (y1 - y0)) if use.mays else 0):
            make = use.mays[int(self._rng.integers(len(use.mays)))]
            self._put(make(self._rng))

    def _put(self, group: Group) -> None:
        for _ in range(_TRIES):
            x, y, turn = self._somewhere(group)
            swapped = turn % 2 == 1
            dx, dy = 0.5 * group.width, 0.5 * group.depth
            dx, dy = (dy, dx) if swapped else (dx, dy)
            box = (x - dx, y - dy, x + dx, y + dy)
            if self._fits(box, _GAP if group.at_wall else _AISLE):
                self._taken.append(box)
                self._add(group, x, y, turn)
                return

    def _somewhere(self, group: Group) -> tuple[float, float, int]:
        """Draw a group's middle [m] and its quarter turns; unrotated, its back is to the north."""
        x0, y0, x1, y1 = self._inner
        turn = int(self._rng.integers(4))
        along, away = 0.5 * group.width, 0.5 * group.depth
        half = (along, away) if turn % 2 == 0 else (away, along)
        u, v = self._rng.random(2)
        x = x0 + half[0] + u * max(0.0, x1 - x0 - 2.0 * half[0])
        y = y0 + half[1] + v * max(0.0, y1 - y0 - 2.0 * half[1])
        if group.at_wall:
            # A small gap to the wall, as in real rooms.
            gap = 0.03
            x = (x, x0 + half[0] + gap, x, x1 - half[0] - gap)[turn]
            y = (y1 - half[1] - gap, y, y0 + half[1] + gap, y)[turn]
        return round(float(x), 2), round(float(y), 2), turn

    def _fits(self, box: Box, aisle: float) -> bool:
        x0, y0, x1, y1 = self._inner
        if box[0] < x0 or box[1] < y0 or box[2] > x1 or box[3] > y1:
            return False
        if any(_overlap(box, other, 0.0) for other in self._doors):
            return False
        if any(_overlap(box, other, aisle) for other in self._taken):
            return False
        gap = np.maximum(np.maximum(box[:2] - self._ways, self._ways - box[2:]), 0.0)
        return bool((np.hypot(*gap.T) >= WAY).all())

    def _add(self, group: Group, x: float, y: float, turn: int) -> None:
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[turn]
        for item in group.items:
            self.pieces.append(
                Piece(
                    name=item.kind,
                    kind=item.kind,
                    x=round(x + c * item.x - s * item.y, 3),
                    y=round(y + s * item.x + c * item.y, 3),
                    yaw=math.radians((item.yaw + 90 * turn + 180) % 360 - 180),
                    size=item.size,
                )
            )


def _overlap(a: Box, b: Box, gap: float) -> bool:
    return a[0] < b[2] + gap and b[0] < a[2] + gap and a[1] < b[3] + gap and b[1] < a[3] + gap


def hub_and_ways(
    rng: np.random.Generator, inner: Box, doors: Sequence[RoomDoor], *, along: bool
) -> tuple[tuple[float, float], FloatArray]:
    """Return a room's hub [m], at which all its paths meet, and the paths as points (N, 2).

    Args:
        rng: Source of the random position of the hub.
        inner: The floor between the inner faces of the walls.
        doors: The doors of the room.
        along: Whether there is a path along the middle of the whole room, as in a corridor.
    """
    x0, y0, x1, y1 = inner
    middle = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    slack = np.maximum(0.2 * np.array([x1 - x0, y1 - y0]) - 0.3, 0.0)
    hub = middle if along else np.round(middle + rng.uniform(-1.0, 1.0, 2) * slack, 1)
    lines: list[list[FloatArray]] = [[hub, hub]]
    for door in doors:
        deep = min(1.0, 0.5 * abs(door.inward[0] * (x1 - x0) + door.inward[1] * (y1 - y0)))
        inside = np.array(door.ahead(deep))
        end = hub
        if along:
            end = np.where([x1 - x0 >= y1 - y0, x1 - x0 < y1 - y0], inside, middle)
        lines.append([np.array(door.ahead(0.0)), inside, end])
    if along:
        reach = 0.5 * np.array([x1 - x0, y1 - y0]) - 1.0
        reach = np.where(reach == reach.max(), reach, 0.0)
        lines.append([middle - reach, middle + reach])
    return (float(hub[0]), float(hub[1])), np.concatenate([_dotted(line) for line in lines])


def _dotted(line: Sequence[FloatArray]) -> FloatArray:
    parts = []
    for a, b in pairwise(line):
        n = 2 + math.ceil(float(np.hypot(*(b - a))) / 0.1)
        parts.append(np.linspace(a, b, n))
    return np.concatenate(parts)


def numbered(pieces: Sequence[Piece]) -> tuple[Piece, ...]:
    """Return the pieces with unique names."""
    return tuple(replace(p, name=f"{p.kind}_{i}") for i, p in enumerate(pieces))
