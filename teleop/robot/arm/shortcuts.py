"""Shorter ways: what a search has found is pulled straight where that is free."""

from __future__ import annotations

from collections.abc import Generator
from itertools import pairwise
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from teleop.robot.arm.clear_ways import ClearWays

_TRIES: Final = 40
"""Shortcuts between random points that are tried."""
_VAIN: Final = 12
"""So many in a row that are not free or gain nothing end the search."""
_GAIN: Final = 0.01
"""Share of a way that a shortcut must save."""

Shorter = Generator[None, None, list[FloatArray]]


def shortened(ways: ClearWays, way: list[FloatArray], chance: np.random.Generator) -> Shorter:
    """Find a shorter free way between the same ends; yields when the budget is used up."""
    way = yield from _without_detours(ways, way)
    vain = 0
    for _ in range(_TRIES):
        if len(way) == 2 or vain == _VAIN:
            break
        cut = yield from _cut(ways, way, chance)
        vain = vain + 1 if cut is None else 0
        way = cut or way
    return (yield from _without_detours(ways, way))


def length(way: list[FloatArray]) -> float:
    """Return the length of a way [rad]."""
    return sum(float(np.linalg.norm(b - a)) for a, b in pairwise(way))


def _without_detours(ways: ClearWays, way: list[FloatArray]) -> Shorter:
    """Go from each corner to the furthest one that can be reached straight."""
    kept, at = [way[0]], 0
    while at < len(way) - 1:
        further = len(way) - 1
        while further > at + 1 and not (yield from ways.straight(way[at], way[further])):
            further -= 1
        at = further
        kept.append(way[at])
    return kept


def _cut(
    ways: ClearWays, way: list[FloatArray], chance: np.random.Generator
) -> Generator[None, None, list[FloatArray] | None]:
    """Try to join two random points of a way, on two of its pieces."""
    marks = np.concatenate(([0.0], np.cumsum([np.linalg.norm(b - a) for a, b in pairwise(way)])))
    low, high = np.sort(chance.uniform(0.0, marks[-1], 2))
    first, last = (int(np.searchsorted(marks, m, "right")) - 1 for m in (low, high))
    last = min(last, len(way) - 2)
    if first == last:
        return None
    begin, end = (
        way[k] + (way[k + 1] - way[k]) * ((m - marks[k]) / (marks[k + 1] - marks[k]))
        for k, m in ((first, low), (last, high))
    )
    if float(np.linalg.norm(end - begin)) > (1.0 - _GAIN) * (high - low):
        return None
    if not (ways.pose(begin) and ways.pose(end)):
        return None
    if not (yield from ways.straight(begin, end)):
        return None
    return [*way[: first + 1], begin, end, *way[last + 1 :]]
