"""Collisions of actors' paths with static objects, for which a plan is rejected."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.floorplan.actors_in_plan import Cart, DoorLeaf, PathPoint
from robot_sim.floorplan.plan import Plan
from robot_sim.layout.rectangles import Rectangles, line_between
from robot_sim.scene_objects.blocks import Block

_BODY: Final = 0.1
"""Half of the width that must be free along a path [m]: that of the legs; arms are drawn in."""
_HEAD: Final = 1.8
"""Height above which an actor walks under an object [m]."""
_FOOT: Final = 0.05
"""Height below which an actor steps over an object [m]."""


def check_paths(plan: Plan, blocks: Iterable[Block]) -> None:
    """Raise a WorldError if an actor's path leads through a solid; the message names both.

    Args:
        plan: Plan with the actors.
        blocks: Static solids of the plan.
    """
    walkers = [one for one in plan.actors if not isinstance(one, DoorLeaf)]
    kinds = ["cart" if isinstance(one, Cart) else "person" for one in walkers]
    names = [f"{kind} {one.name!r}" for kind, one in zip(kinds, walkers, strict=True)]
    ways = [[*one.path, one.path[0]] if one.loop else one.path for one in walkers]
    _check(dict(zip(names, ways, strict=True)), blocks)


def check_ways(ways: Sequence[Sequence[PathPoint]], blocks: Iterable[Block]) -> None:
    """Raise a WorldError if a way, of which each is walked by a person, leads through a solid."""
    if ways:
        _check({f"person {number}": way for number, way in enumerate(ways, 1)}, blocks)


def _check(ways: Mapping[str, Sequence[PathPoint]], blocks: Iterable[Block]) -> None:
    solid = [b for b in blocks if b.bottom < _HEAD and 2.0 * b.z - b.bottom > _FOOT]
    met = Rectangles((b.x, b.y, b.half[0], b.half[1], b.yaw) for b in solid).met
    for who, corners in ways.items():
        for a, b in pairwise(corners):
            hits = met(*line_between(a, b, _BODY))
            if len(hits):
                raise WorldError(
                    f"{who} walks through {solid[int(hits[0])].name} between"
                    f" [{a[0]:g}, {a[1]:g}] and [{b[0]:g}, {b[1]:g}]"
                )
