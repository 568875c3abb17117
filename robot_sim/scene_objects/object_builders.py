"""Builders of objects: the type of a furniture catalogue entry, and shapes that many kinds share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from robot_sim.scene_objects.blocks import Block, box, post

Builder = Callable[[float, float, float, int], Iterator[Block]]
"""Creates the blocks of a piece in its own frame from width (along x), depth, height [m] and a seed."""


@dataclass(frozen=True, slots=True)
class ObjectKind:
    """One entry of the catalogue."""

    build: Builder
    """Builder of its blocks."""
    size: tuple[float, float, float]
    """Default width (along its x), depth and height [m]."""


def solid(material: str) -> Builder:
    """Return the builder of a plain box."""

    def build(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
        yield box("body", 0.0, 0.0, 0.0, height, (width, depth), material)

    return build


def round_solid(material: str) -> Builder:
    """Return the builder of a plain cylinder, as wide as its width."""

    def build(width: float, depth: float, height: float, seed: int) -> Iterator[Block]:
        yield post("body", 0.0, 0.0, 0.0, height, 0.5 * width, material)

    return build


def legs(
    width: float, depth: float, height: float, thick: float, material: str = "metal"
) -> Iterator[Block]:
    """Yield four square legs, ``thick`` wide, under a rectangle."""
    for i, (sx, sy) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        x, y = sx * (0.5 * width - thick), sy * (0.5 * depth - thick)
        yield box(f"leg_{i}", x, y, 0.0, height, (thick, thick), material)
