"""Industrial objects in the furniture catalogue: racks, pallets, forklifts, planting tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from robot_sim.scene_objects.blocks import Block, box
from robot_sim.scene_objects.object_builders import ObjectKind, legs, round_solid, solid

BAY: Final = 2.8
"""Approximate length of a rack's bay [m]: three pallets side by side."""
STOREY: Final = 1.8
"""Approximate height of a rack's storey [m]."""
_FILLED: Final = 0.8
"""Share of a rack's pallet places that are occupied."""
_PALLET: Final = (0.8, 1.2, 0.144)
"""Width, depth and height of a EUR-pallet [m] (EN 13698-1)."""


def _pallet(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield box("deck", 0.0, 0.0, 0.0, _PALLET[2], (width, depth), "wood")
    if height > _PALLET[2]:
        yield box("load", 0.0, 0.0, _PALLET[2], height, (0.94 * width, 0.96 * depth), "cardboard")


def _rack(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield uprights, beams and pallets; the seed decides which places are occupied and how high."""
    rng = np.random.default_rng(seed)
    bays, storeys = max(1, round(width / BAY)), max(1, round(height / STOREY))
    bay, storey = width / bays, height / storeys
    for i in range(bays + 1):
        x = np.clip(-0.5 * width + i * bay, -0.5 * width + 0.05, 0.5 * width - 0.05)
        for j, y in enumerate((-0.5 * depth + 0.04, 0.5 * depth - 0.04)):
            yield box(f"upright_{i}_{j}", float(x), y, 0.0, height, (0.1, 0.08), "metal")
    for k in range(1, storeys):
        for j, y in enumerate((-0.5 * depth + 0.025, 0.5 * depth - 0.025)):
            yield box(
                f"beam_{k}_{j}", 0.0, y, k * storey - 0.12, k * storey, (width, 0.05), "metal"
            )
    for k in range(storeys):
        for i in range(bays):
            for n, load in enumerate(rng.uniform(0.5, 1.35, 3) * (rng.random(3) < _FILLED)):
                if load > 0.0:
                    x = -0.5 * width + (i + (n + 0.5) / 3) * bay + rng.uniform(-0.03, 0.03)
                    top = k * storey + min(float(load), storey - 0.25)
                    wide = (min(_PALLET[0], bay / 3 - 0.1), min(_PALLET[1], depth - 0.04))
                    yield from _goods(f"pallet_{k}_{i}_{n}", float(x), k * storey, top, wide)


def _goods(
    name: str, x: float, low: float, high: float, size: tuple[float, float]
) -> Iterator[Block]:
    if low == 0.0:
        # One solid for objects within the robot's height: each costs physics, and there are hundreds.
        yield box(f"{name}_load", x, 0.0, 0.0, high, size, "cardboard")
        return
    yield box(f"{name}_deck", x, 0.0, low, low + _PALLET[2], size, "wood")
    load = (0.94 * size[0], 0.96 * size[1])
    yield box(f"{name}_load", x, 0.0, low + _PALLET[2], high, load, "cardboard")


def _dock_door(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a closed roller door in its frame, to be placed before a wall; its face is towards -y."""
    for i, x in enumerate((-0.5 * width + 0.1, 0.5 * width - 0.1)):
        yield box(f"jamb_{i}", x, 0.0, 0.0, height, (0.2, depth), "metal")
    yield box("leaf", 0.0, 0.25 * depth, 0.0, height - 0.3, (width - 0.4, 0.5 * depth), "plastic")
    yield box("drum", 0.0, 0.0, height - 0.3, height, (width - 0.4, depth), "metal")


def _forklift(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a parked forklift, its forks towards +x."""
    body = 0.62 * width
    yield box("body", -0.5 * (width - body), 0.0, 0.08, 1.1, (body, depth), "plastic")
    yield box("mast", -0.5 * width + body + 0.06, 0.0, 0.0, height, (0.12, 0.7 * depth), "metal")
    yield box("roof", -0.5 * (width - body) - 0.1, 0.0, 2.0, 2.08, (0.8 * body, depth), "metal")
    fork = width - body - 0.12
    for i, y in enumerate((-0.25 * depth, 0.25 * depth)):
        yield box(f"fork_{i}", 0.5 * (width - fork), y, 0.05, 0.1, (fork, 0.12), "metal")


def _guard_rail(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    for i, x in enumerate((-0.5 * width + 0.08, 0.5 * width - 0.08)):
        yield box(f"post_{i}", x, 0.0, 0.0, height, (0.12, 0.5 * depth), "metal")
    yield box("rail", 0.0, 0.0, 0.6 * height, 0.95 * height, (width, depth), "metal")


def _planting_table(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a bench of seedlings on legs; the seed decides the height of each tray."""
    rng = np.random.default_rng(seed)
    top = min(0.8, 0.8 * height)
    yield box("top", 0.0, 0.0, top - 0.08, top, (width, depth), "metal")
    yield from legs(width, depth, top - 0.08, 0.06)
    trays = max(1, round(width / 0.6))
    for i in range(trays):
        x = -0.5 * width + (i + 0.5) * width / trays
        grown = top + (height - top) * float(rng.uniform(0.2, 1.0))
        yield box(f"tray_{i}", x, 0.0, top, grown, (0.8 * width / trays, 0.85 * depth), "leaves")


def _heating(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    """Yield a bank of pipes along a wall: three rails on brackets."""
    for i in range(3):
        z = height * (0.25 + 0.3 * i)
        yield box(f"pipe_{i}", 0.0, 0.0, z, z + 0.06, (width, 0.06), "metal")
    for i, x in enumerate((-0.45 * width, 0.45 * width)):
        yield box(f"bracket_{i}", x, 0.0, 0.0, height, (0.05, depth), "metal")


INDUSTRIAL: Final = {
    "rack": ObjectKind(_rack, (4 * BAY, 1.2, 7.2)),
    "pallet": ObjectKind(_pallet, (0.8, 1.2, 1.2)),
    "dock_door": ObjectKind(_dock_door, (3.0, 0.2, 3.4)),
    "forklift": ObjectKind(_forklift, (2.6, 1.1, 2.2)),
    "guard_rail": ObjectKind(_guard_rail, (1.6, 0.16, 0.5)),
    "drum": ObjectKind(round_solid("plastic"), (0.6, 0.6, 0.9)),
    "machine": ObjectKind(solid("metal"), (1.8, 1.0, 1.6)),
    "planting_table": ObjectKind(_planting_table, (3.0, 1.2, 1.3)),
    "heating": ObjectKind(_heating, (3.0, 0.12, 0.5)),
    "tank": ObjectKind(round_solid("plastic"), (1.4, 1.4, 1.8)),
}
"""Kinds by their names in a floor plan."""
