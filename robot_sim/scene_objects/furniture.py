"""Furniture catalogue: every kind of object that a floor plan can place, as a few blocks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.scene_objects.blocks import Block, box, post
from robot_sim.scene_objects.industrial_objects import INDUSTRIAL
from robot_sim.scene_objects.object_builders import ObjectKind, legs, round_solid, solid
from robot_sim.scene_objects.outdoor_objects import OUTDOOR
from robot_sim.scene_objects.plan_elements import Piece, Waypoint


def _desk(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield box("top", 0.0, 0.0, height - 0.03, height, (width, depth), "wood")
    yield from legs(width, depth, height - 0.03, 0.06)


def _chair(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield post("foot", 0.0, 0.0, 0.03, 0.10, 0.5 * width, "metal")
    yield post("stem", 0.0, 0.0, 0.10, 0.42, 0.03, "metal")
    yield box("seat", 0.0, 0.0, 0.42, 0.50, (depth, width), "fabric")
    yield box("back", -0.5 * depth + 0.03, 0.0, 0.55, height, (0.06, width), "fabric")


def _sofa(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield box("seat", 0.0, 0.0, 0.05, 0.42, (width, depth), "fabric")
    yield box("back", 0.0, 0.5 * depth - 0.1, 0.42, height, (width, 0.2), "fabric")


def _shelf(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    for i, x in enumerate((-0.5 * width + 0.015, 0.5 * width - 0.015)):
        yield box(f"side_{i}", x, 0.0, 0.0, height, (0.03, depth), "wood")
    yield box("back", 0.0, 0.5 * depth - 0.01, 0.0, height, (width - 0.06, 0.02), "wood")
    for i in range(3):
        z = 0.25 + 0.5 * i * (height - 0.3)
        yield box(f"board_{i}", 0.0, -0.01, z, z + 0.03, (width - 0.06, depth - 0.02), "wood")


def _plant(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield post("pot", 0.0, 0.0, 0.0, 0.42, 0.4 * width, "wood")
    yield post("leaves", 0.0, 0.0, 0.55, height, 0.5 * width, "leaves")


def _round_table(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
    yield post("foot", 0.0, 0.0, 0.0, 0.04, 0.3 * width, "metal")
    yield post("stem", 0.0, 0.0, 0.04, height - 0.03, 0.05, "metal")
    yield post("top", 0.0, 0.0, height - 0.03, height, 0.5 * width, "wood")


_TRUNK: Final = 0.1
"""Half the width of a trunk with roots over the width of the crown."""

FURNITURE: Final[Mapping[str, ObjectKind]] = MappingProxyType(
    {
        "desk": ObjectKind(_desk, (1.6, 0.8, 0.74)),
        "table": ObjectKind(_desk, (2.0, 1.0, 0.74)),
        "round_table": ObjectKind(_round_table, (1.0, 1.0, 0.74)),
        "chair": ObjectKind(_chair, (0.5, 0.5, 0.95)),
        "sofa": ObjectKind(_sofa, (1.9, 0.85, 0.8)),
        "shelf": ObjectKind(_shelf, (1.0, 0.35, 1.9)),
        "cabinet": ObjectKind(solid("metal"), (0.8, 0.45, 1.2)),
        "box": ObjectKind(solid("cardboard"), (0.5, 0.4, 0.45)),
        "counter": ObjectKind(solid("wood"), (2.4, 0.6, 0.92)),
        "pillar": ObjectKind(solid("wall"), (0.4, 0.4, 2.8)),
        "round_pillar": ObjectKind(round_solid("wall"), (0.4, 0.4, 2.8)),
        "plant": ObjectKind(_plant, (0.5, 0.5, 1.5)),
        **INDUSTRIAL,
        **OUTDOOR,
    }
)
"""Kinds of a floor plan's ``furniture``."""


def size_of(piece: Piece) -> tuple[float, float, float]:
    """Return width (along its x), depth and height of a piece [m].

    Raises:
        WorldError: its kind is not in the catalogue; the message lists the available ones.
    """
    return piece.size if piece.size is not None else _kind(piece).size


def footprint(piece: Piece) -> tuple[Waypoint, ...]:
    """Return the corners and the centre of the area that a piece covers [m]; of trees, the trunk's."""
    width, depth, _ = size_of(piece)
    share = _TRUNK if piece.kind in ("tree", "conifer") else 0.5
    c, s = math.cos(piece.yaw), math.sin(piece.yaw)
    corners = [(0.0, 0.0)]
    corners += [(sx * share * width, sy * share * depth) for sx in (1, -1) for sy in (1, -1)]
    return tuple((piece.x + c * u - s * v, piece.y + s * u + c * v) for u, v in corners)


def piece_blocks(piece: Piece, ground: float = 0.0) -> Iterator[Block]:
    """Yield the blocks of a piece at its pose, on ground of a given height [m].

    Raises:
        WorldError: its kind is not in the catalogue; the message lists the available ones.
    """
    for part in _kind(piece).build(*size_of(piece), piece.seed):
        block = part.moved(piece.x, piece.y, piece.yaw, ground)
        yield replace(block, name=f"{piece.name}_{part.name}")


def _kind(piece: Piece) -> ObjectKind:
    if piece.kind not in FURNITURE:
        kinds = ", ".join(FURNITURE)
        raise WorldError(f"no furniture of type {piece.kind!r}; available: {kinds}")
    return FURNITURE[piece.kind]
