"""Rearrangement of furniture since the world was mapped: a pure function from plan to plan.

Every movable piece may be pushed, turned or removed, and a few boxes are added. Nothing ends up in a
wall, in another piece, in a doorway, on the tour, at a spawn or a named place, or in the path of an
actor; a piece for which no free spot is found stays in place.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, islice, pairwise
from typing import Final

import numpy as np

from robot_sim.actors.actor_bodies import ARM_REACH
from robot_sim.floorplan.actors_in_plan import Actor, Cart, DoorLeaf
from robot_sim.floorplan.doorways import doorways
from robot_sim.floorplan.plan import Piece, Plan, Waypoint
from robot_sim.layout.rectangles import Rectangles, line_between
from robot_sim.scene_objects.blocks import Block
from robot_sim.scene_objects.furniture import footprint, piece_blocks, size_of
from robot_sim.scene_objects.ramps_and_steps import Slab
from robot_sim.scene_objects.walls import wall_blocks

ROBOT_CLEARANCE: Final = 0.7
"""Distance of moved pieces from the tour's line, spawns and places [m]: a P3-AT turns within 0.34
m, and does not follow a line exactly."""
PERSON_CLEARANCE: Final = 0.35
"""Distance of moved pieces from the line of an actor's path [m]."""
DOOR_CLEARANCE: Final = 0.6
"""Free distance on both sides of a door opening [m]."""
GAP: Final = 0.02
"""Distance of moved pieces from walls and other pieces [m]."""
NEW_BOXES: Final = 0.1
"""Number of added boxes per movable piece; at least one is added."""
_TRIES: Final = 60
_REACHABLE: Final = 2.0
"""Height above which objects are over people's heads [m]."""


@dataclass(frozen=True, slots=True)
class Mobility:
    """Limits within which pieces of a kind are moved."""

    least: float
    """Shortest displacement [m]."""
    most: float
    """Longest displacement [m]."""
    turn: float
    """Largest rotation in either direction [rad]."""
    gone: float = 0.0
    """Probability of being removed."""


MOBILITY: Final = {
    "chair": Mobility(0.3, 1.5, math.pi, 0.15),
    "box": Mobility(0.5, 2.5, math.pi, 0.25),
    "plant": Mobility(0.3, 1.2, math.pi, 0.1),
    "desk": Mobility(0.3, 1.0, 0.3),
    "table": Mobility(0.3, 1.0, 0.3),
    "round_table": Mobility(0.3, 1.0, math.pi),
    "sofa": Mobility(0.3, 1.0, 0.3),
    "cabinet": Mobility(0.2, 0.7, 0.2),
    "pallet": Mobility(0.3, 2.5, 0.4, 0.3),
    "drum": Mobility(0.3, 2.0, math.pi, 0.2),
    "forklift": Mobility(1.0, 5.0, math.pi, 0.2),
    "planting_table": Mobility(0.2, 0.6, 0.1),
    "bench": Mobility(0.3, 1.5, 0.6),
    "planter": Mobility(0.3, 1.2, 0.4),
    "bicycle_stand": Mobility(0.3, 1.5, 0.3),
}
"""Kinds that are moved, and how far; chosen. All other kinds stay: pillars, shelves, counters,
racks, machines, tanks, trees."""


def rearranged(plan: Plan, seed: int) -> Plan:
    """Return the plan with its furniture moved.

    Args:
        plan: The plan as it was mapped.
        seed: Seed of the result; each piece draws by the seed and its own name.
    """
    fixed = Rectangles(_fixed(plan))
    kept_free = Rectangles(_kept_free(plan))
    pieces = {p.name: p for p in plan.furniture}
    movable = [p for p in plan.furniture if p.kind in MOBILITY]

    def others(name: str) -> Rectangles:
        return Rectangles(_row(p, GAP) for p in pieces.values() if p.name != name)

    def fits(piece: Piece, origin: Waypoint, rest: Rectangles) -> bool:
        return (
            _within(piece, plan)
            and not rest.meet(*_spot(piece))
            and not fixed.meet(*_spot(piece))
            and not kept_free.meet(*_spot(piece))
            and all(_on_or_off(piece, slab) for slab in plan.slabs)
            # It is pushed across the room, not through a wall.
            and not fixed.meet(*line_between(origin, (piece.x, piece.y), 0.0))
        )

    # Small ones first: a desk has room once its chair was moved.
    for piece in sorted(movable, key=lambda p: math.prod(size_of(p)[:2])):
        rng = np.random.default_rng([seed, zlib.crc32(piece.name.encode())])
        habit = MOBILITY[piece.kind]
        if rng.random() < habit.gone:
            del pieces[piece.name]
            continue
        rest = others(piece.name)
        for attempt in range(_TRIES):
            # In narrow places a smaller displacement may fit.
            share = 1.0 if 2 * attempt < _TRIES else 0.3
            candidate = _displaced(piece, habit, rng, share)
            if fits(candidate, (piece.x, piece.y), rest):
                pieces[piece.name] = candidate
                break
    anchors = [(p.x, p.y) for p in movable] + list(plan.tour)
    rng = np.random.default_rng([seed, len(pieces)])
    taken = {p.name for p in plan.furniture}
    names = (name for i in count() if (name := f"left_box_{i}") not in taken)
    wanted = max(1, round(NEW_BOXES * len(movable))) if anchors else 0
    for name in islice(names, wanted):
        rest = others("")
        size = tuple(float(v) for v in rng.uniform((0.3, 0.3, 0.3), (0.8, 0.6, 0.9)))
        for _ in range(_TRIES):
            x, y = anchors[rng.integers(len(anchors))]
            anchor = Piece(name, "box", x, y, size=(size[0], size[1], size[2]))
            candidate = _displaced(anchor, Mobility(0.5, 3.0, math.pi), rng)
            if fits(candidate, (x, y), rest):
                pieces[candidate.name] = candidate
                break
    return replace(plan, furniture=tuple(pieces.values()))


def _displaced(
    piece: Piece, habit: Mobility, rng: np.random.Generator, share: float = 1.0
) -> Piece:
    distance = share * rng.uniform(habit.least, habit.most)
    direction = rng.uniform(-math.pi, math.pi)
    return replace(
        piece,
        x=piece.x + distance * math.cos(direction),
        y=piece.y + distance * math.sin(direction),
        yaw=piece.yaw + share * rng.uniform(-habit.turn, habit.turn),
    )


def _spot(piece: Piece) -> tuple[float, float, tuple[float, float], float]:
    width, depth, _ = size_of(piece)
    return piece.x, piece.y, (0.5 * width, 0.5 * depth), piece.yaw


def _row(piece: Piece, margin: float) -> tuple[float, float, float, float, float]:
    x, y, (along, across), yaw = _spot(piece)
    return x, y, along + margin, across + margin, yaw


def _within(piece: Piece, plan: Plan) -> bool:
    x, y, half, _ = _spot(piece)
    reach = math.hypot(*half)
    x0, y0, x1, y1 = plan.bounds
    return x0 + reach < x < x1 - reach and y0 + reach < y < y1 - reach


def _on_or_off(piece: Piece, slab: Slab) -> bool:
    """Return whether a piece stands entirely on a level slab, or entirely beside the slab."""
    half = (0.5 * slab.length, 0.5 * slab.width)
    beside = not Rectangles([(slab.x, slab.y, *half, slab.yaw)]).meet(*_spot(piece))
    on_top = slab.level and bool(np.isfinite(slab.heights(np.array(footprint(piece)))).all())
    return beside or on_top


def _fixed(plan: Plan) -> Iterator[tuple[float, float, float, float, float]]:
    """Yield the static solids that a person could run into."""
    for block in _fixed_blocks(plan):
        if block.bottom - block.ground < _REACHABLE:
            along, across, _ = block.half
            yield block.x, block.y, along + GAP, across + GAP, block.yaw


def _fixed_blocks(plan: Plan) -> Iterator[Block]:
    for wall in plan.walls:
        yield from wall_blocks(wall)
    for glazing in plan.glazings:
        yield from glazing.blocks()
    for piece in plan.furniture:
        if piece.kind not in MOBILITY:
            yield from piece_blocks(piece)


def _kept_free(plan: Plan) -> Iterator[tuple[float, float, float, float, float]]:
    """Yield the areas that stay free: doorways, and the paths of the robot and of actors."""
    for door in doorways(plan).values():
        yield door.x, door.y, 0.5 * door.width, DOOR_CLEARANCE, door.yaw
    for placement in (*plan.spawns.values(), *plan.places.values()):
        yield placement.x, placement.y, ROBOT_CLEARANCE, ROBOT_CLEARANCE, 0.0
    yield from _lines(plan.tour, ROBOT_CLEARANCE)
    for actor in plan.actors:
        yield from _actor_areas(actor)


def _actor_areas(one: Actor) -> Iterator[tuple[float, float, float, float, float]]:
    """Yield the areas in which an actor walks or a leaf swings."""
    if isinstance(one, DoorLeaf):
        yield *one.hinge, one.width + GAP, one.width + GAP, 0.0
        return
    clearance = PERSON_CLEARANCE
    if isinstance(one, Cart):
        length, width, _ = one.size
        # A cart is turned around at both ends by the person who pushes it.
        front = ARM_REACH + length if one.pushed else 0.5 * length
        clearance = math.hypot(front, 0.5 * width) + GAP
    corners = [*one.path, one.path[0]] if one.loop else one.path
    yield from _lines(corners, clearance)


def _lines(
    corners: Sequence[Sequence[float]], margin: float
) -> Iterator[tuple[float, float, float, float, float]]:
    for a, b in pairwise(corners):
        x, y, half, yaw = line_between(a, b, margin)
        yield x, y, *half, yaw
