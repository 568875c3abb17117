"""Textures of floors and of the ground outdoors; each tiles without a seam."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from robot_sim.cameras.look.pattern_noise import (
    Image,
    cell_values,
    grid_lines,
    noise,
    pixels,
    shade,
    stones,
)

SIZE: Final = 256
"""Side of a texture [pixels]."""


def carpet() -> Image:
    """Return carpet squares, 0.5 m wide, 2 by 2 of them."""
    pile = noise(SIZE, 0.3, 1, stretch=0.5)
    squares = cell_values(SIZE, 2, 2, 2)
    return shade((0.36, 0.38, 0.43), 0.10 * pile, 0.05 * squares, -0.12 * grid_lines(SIZE, 2, 2, 1))


def tile() -> Image:
    """Return light stoneware tiles with grey joints, 4 by 4 of them."""
    joint = grid_lines(SIZE, 4, 4, 2)
    stone = 0.03 * noise(SIZE, 1.0, 3) + 0.03 * cell_values(SIZE, 4, 4, 4)
    return shade((0.74, 0.72, 0.68), stone, -0.35 * joint)


def wet_tile() -> Image:
    """Return darker red-brown tiles, 4 by 4 of them."""
    joint = grid_lines(SIZE, 4, 4, 3)
    stone = 0.08 * noise(SIZE, 1.2, 5) + 0.08 * cell_values(SIZE, 4, 4, 6)
    return shade((0.42, 0.30, 0.25), stone, -0.35 * joint)


def concrete() -> Image:
    """Return trowelled concrete with a joint around a slab."""
    cloud, grain = noise(SIZE, 1.5, 7), noise(SIZE, 0.2, 8)
    return shade((0.56, 0.56, 0.54), 0.05 * cloud, 0.03 * grain, -0.25 * grid_lines(SIZE, 1, 1, 1))


def wet_concrete() -> Image:
    """Return concrete with damp stains."""
    damp = np.clip(noise(SIZE, 1.6, 9), 0.0, 1.5)
    return shade((0.47, 0.48, 0.47), -0.14 * damp, 0.03 * noise(SIZE, 0.2, 10))


def asphalt() -> Image:
    """Return asphalt: dark binder with light grit."""
    grit = np.clip(noise(SIZE, 0.15, 11), 0.5, 3.0) - 0.5
    return shade((0.33, 0.33, 0.34), 0.25 * grit, 0.06 * noise(SIZE, 1.4, 12))


def grass() -> Image:
    """Return turf: blades, tufts, and some dry spots."""
    blades, tufts = noise(SIZE, 0.4, 13, stretch=0.4), noise(SIZE, 1.2, 14)
    dry = np.clip(noise(SIZE, 1.4, 15) - 0.6, 0.0, 1.0)[..., None]
    green = np.asarray((0.31, 0.44, 0.19)) * (1.0 + 0.22 * blades + 0.14 * tufts)[..., None]
    straw = np.asarray((0.46, 0.43, 0.24)) * (1.0 + 0.15 * blades)[..., None]
    return pixels(green + 0.6 * dry * (straw - green))


def gravel() -> Image:
    """Return a bed of stones."""
    edge, own = stones(SIZE, 900, 16)
    relief = np.clip(1.15 - edge, 0.25, 1.0) - 0.75
    return shade((0.58, 0.55, 0.50), 0.22 * own, 0.7 * relief)


def planks() -> Image:
    """Return floor boards."""
    grain = noise(SIZE, 0.8, 17, stretch=16.0)
    boards = cell_values(SIZE, 1, 6, 18)
    return shade((0.58, 0.42, 0.26), 0.09 * grain, 0.10 * boards, -0.4 * grid_lines(SIZE, 1, 6, 1))


def ice() -> Image:
    """Return pale ice with cloudy patches."""
    return shade((0.78, 0.86, 0.91), 0.07 * noise(SIZE, 1.6, 19))


GROUNDS: Final[Mapping[str, Callable[[], Image]]] = {
    "carpet": carpet,
    "tile": tile,
    "wet_tile": wet_tile,
    "concrete": concrete,
    "wet_concrete": wet_concrete,
    "asphalt": asphalt,
    "grass": grass,
    "gravel": gravel,
    "planks": planks,
    "ice": ice,
}
"""Makers of the textures by name."""
