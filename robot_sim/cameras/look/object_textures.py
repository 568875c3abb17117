"""Textures of walls, furniture, plants and machines."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from robot_sim.cameras.look.pattern_noise import (
    Image,
    Rgb,
    cell_values,
    grid_lines,
    noise,
    pixels,
    shade,
    stones,
)

SIZE: Final = 256
"""Side of most textures [pixels]."""


def plaster() -> Image:
    """Return a painted wall, 4 m high: a skirting board at its foot, a little darker there and at the top."""
    size = 512
    height = 4.0 * (1.0 - (np.arange(size) + 0.5) / size)[:, None]
    paint = 0.012 * noise(size, 0.4, 21) + 0.010 * noise(size, 1.5, 22)
    dim = -0.10 * np.exp(-height / 0.25) - 0.06 * np.exp(-np.abs(height - 2.8) / 0.2)
    wall = np.asarray((0.86, 0.85, 0.80)) * (1.0 + paint + dim)[..., None]
    wall[height[:, 0] < 0.08] = (0.42, 0.36, 0.30)
    wall[(height[:, 0] >= 0.07) & (height[:, 0] < 0.08)] = (0.30, 0.26, 0.22)
    return pixels(wall)


def render() -> Image:
    """Return rendered masonry, without a skirting board."""
    return shade((0.80, 0.79, 0.74), 0.02 * noise(SIZE, 0.4, 64), 0.025 * noise(SIZE, 1.5, 65))


def cladding() -> Image:
    """Return sheet panels with ribs, 8 of them, and a joint at the foot."""
    x = np.arange(SIZE)[None, :] / SIZE * 8.0 % 1.0
    rib = np.where(x < 0.14, 0.10, np.where(x < 0.22, -0.22, 0.0)) * np.ones((SIZE, 1))
    joint = np.zeros((SIZE, 1))
    joint[-4:] = -0.35
    return shade((0.70, 0.74, 0.77), rib, joint, 0.02 * noise(SIZE, 1.3, 66))


def ceiling() -> Image:
    """Return suspended ceiling panels, 4 by 4 of 0.6 m, with a lamp two panels long."""
    panel = 0.02 * noise(SIZE, 0.1, 23) - 0.10 * grid_lines(SIZE, 4, 4, 2)
    image = np.repeat(np.full((1, SIZE, 1), 0.80), SIZE, axis=0) * (1.0 + panel)[..., None]
    image = np.repeat(image, 3, axis=2)
    step = SIZE // 4
    lamp = slice(step + 6, 2 * step - 4), slice(step + 6, 3 * step - 4)
    image[lamp] = (1.0, 1.0, 0.97)
    return pixels(image)


def steel_roof() -> Image:
    """Return corrugated sheet with a girder and a lamp."""
    x = np.arange(SIZE)[None, :]
    waves = 0.10 * np.sin(2.0 * np.pi * x * 24 / SIZE) * np.ones((SIZE, 1))
    image = np.full((SIZE, SIZE, 3), 0.50) * (1.0 + waves)[..., None]
    image[:14] = (0.33, 0.35, 0.38)
    image[120:136, 90:166] = (1.0, 1.0, 0.95)
    return pixels(image)


def brick() -> Image:
    """Return brickwork in running bond: 4 bricks by 12 courses."""
    joint = grid_lines(SIZE, 4, 12, 2, bond=True)[..., None]
    clay = 0.12 * cell_values(SIZE, 4, 12, 24, bond=True) + 0.06 * noise(SIZE, 0.5, 25)
    bricks = np.asarray((0.63, 0.38, 0.29)) * (1.0 + clay)[..., None]
    mortar = np.asarray((0.62, 0.59, 0.54)) * (1.0 + 0.04 * noise(SIZE, 0.3, 26))[..., None]
    return pixels(bricks + joint * (mortar - bricks))


def wood(base: Rgb = (0.60, 0.43, 0.26), seed: int = 27) -> Image:
    """Return veneer with upright grain."""
    rings = np.sin(6.0 * noise(SIZE, 1.6, seed, stretch=0.12))
    return shade(base, 0.07 * rings, 0.06 * noise(SIZE, 0.5, seed + 1, stretch=0.04))


def brushed_metal(base: Rgb = (0.58, 0.60, 0.62)) -> Image:
    """Return brushed sheet metal."""
    return shade(base, 0.05 * noise(SIZE, 0.6, 29, stretch=0.03), 0.02 * noise(SIZE, 1.5, 30))


def painted(base: Rgb) -> Image:
    """Return paint or plastic, slightly uneven and scratched."""
    scratches = np.clip(noise(64, 0.4, 31, stretch=0.1) - 2.0, 0.0, 1.0)
    return shade(base, 0.025 * noise(64, 1.3, 32), 0.12 * scratches)


def fabric(base: Rgb) -> Image:
    """Return woven cloth."""
    y, x = np.mgrid[0:128, 0:128]
    weave = np.sin(x * np.pi / 2.0) * np.sin(y * np.pi / 2.0)
    return shade(base, 0.10 * weave, 0.06 * noise(128, 0.8, 33))


def foliage() -> Image:
    """Return leaves in light and shade."""
    edge, own = stones(SIZE, 500, 34)
    depth = np.clip(noise(SIZE, 1.2, 35), -2.0, 2.0)
    light = 1.0 + 0.30 * own - 0.5 * (edge - 0.5) + 0.20 * depth
    hue = np.stack([0.20 + 0.06 * own, 0.38 + 0.03 * own, np.full_like(own, 0.13)], axis=-1)
    return pixels(hue * light[..., None])


def bark() -> Image:
    """Return furrowed bark, upright."""
    furrows = noise(SIZE, 0.8, 36, stretch=0.12)
    return shade((0.34, 0.26, 0.19), 0.28 * furrows, 0.08 * noise(SIZE, 0.2, 37))


def carton(base: Rgb = (0.68, 0.52, 0.34)) -> Image:
    """Return one face of a cardboard box: a strip of tape, worn edges, a label."""
    image = shade(base, 0.03 * noise(SIZE, 1.0, 38), 0.02 * noise(SIZE, 0.2, 39, stretch=0.1))
    image[:, SIZE // 2 - 9 : SIZE // 2 + 9] = (
        image[:, SIZE // 2 - 9 : SIZE // 2 + 9] * 0.82
    ).astype(np.uint8)
    for edge in (image[:3], image[-3:], image[:, :3], image[:, -3:]):
        edge[...] = (np.asarray(base) * 170.0).astype(np.uint8)
    image[150:200, 160:230] = (232, 230, 224)
    for row in (160, 170, 180, 188):
        image[row : row + 3, 168:222] = (60, 60, 64)
    return image


def wrapped_goods() -> Image:
    """Return cartons stacked on a pallet, 3 by 3 of them, under film."""
    joint = grid_lines(SIZE, 3, 3, 3, bond=True)
    tone = 0.10 * cell_values(SIZE, 3, 3, 40, bond=True) + 0.03 * noise(SIZE, 1.0, 41)
    image = shade((0.69, 0.54, 0.36), tone, -0.45 * joint)
    film = np.clip(noise(SIZE, 1.0, 42, stretch=0.2), 0.0, 2.0)[..., None]
    return pixels(image / 255.0 + 0.05 * film)


def books() -> Image:
    """Return a filled bookcase as seen from the front: five rows of spines."""
    rng = np.random.default_rng(43)
    image = np.full((SIZE, SIZE, 3), 0.16)
    rows = 5
    tall = SIZE // rows
    for row in range(rows):
        x, foot = 2, (row + 1) * tall - 3
        while x < SIZE - 4:
            wide = int(rng.integers(4, 12))
            if rng.random() < 0.12:
                x += int(rng.integers(4, 16))
                continue
            high = int(tall * rng.uniform(0.55, 0.88))
            grey, hue = rng.uniform(0.2, 0.75), rng.uniform(0.0, 0.75, 3)
            hue = 0.55 * grey + 0.45 * hue
            image[foot - high : foot, x : min(x + wide, SIZE - 2)] = hue
            image[foot - high : foot, x] *= 0.55
            label = foot - int(0.7 * high)
            image[label : label + 4, x + 1 : min(x + wide, SIZE - 2)] = np.minimum(hue + 0.35, 1.0)
            x += wide
        image[foot : foot + 3] = (0.50, 0.36, 0.22)
    return pixels(image)


def drawers() -> Image:
    """Return the front of a steel cabinet: four drawers with handles."""
    image = brushed_metal((0.62, 0.64, 0.66)) / 255.0
    for row in range(4):
        top = row * 64
        image[top : top + 2] *= 0.45
        image[top + 26 : top + 32, 100:156] = (0.22, 0.23, 0.25)
        image[top + 12 : top + 20, 112:144] = (0.90, 0.90, 0.86)
    image[:, :2] *= 0.5
    image[:, -2:] *= 0.5
    return pixels(image)


def door_leaf() -> Image:
    """Return a door: a frame, two panels, a handle on either side."""
    image = wood((0.50, 0.33, 0.20), 44) / 255.0
    for low, high in ((20, 120), (136, 240)):
        image[low:high, 40:216] *= 0.86
        image[low : low + 3, 40:216] *= 0.6
        image[low:high, 40:43] *= 0.6
    image[124:130, 226:248] = (0.80, 0.80, 0.78)
    image[124:130, 8:30] = (0.80, 0.80, 0.78)
    image[:2] *= 0.5
    image[:, :2] *= 0.5
    image[:, -2:] *= 0.5
    return pixels(image)


def shutter() -> Image:
    """Return a roller door's slats, 10 of them."""
    y = np.arange(SIZE)[:, None] / SIZE * 10.0 % 1.0
    slat = np.where(y < 0.08, -0.35, 0.10 * (0.5 - y)) * np.ones((1, SIZE))
    return shade((0.63, 0.66, 0.68), slat, 0.02 * noise(SIZE, 0.5, 46, stretch=0.05))


def control_panel() -> Image:
    """Return the face of a machine: a dark screen, buttons, louvres and a warning stripe."""
    image = painted((0.36, 0.47, 0.44)).repeat(4, axis=0).repeat(4, axis=1) / 255.0
    image[40:100, 40:130] = (0.08, 0.10, 0.12)
    image[46:94, 46:124] = (0.12, 0.26, 0.32)
    for i, colour in enumerate(((0.75, 0.15, 0.12), (0.15, 0.6, 0.2), (0.85, 0.7, 0.1))):
        image[60:74, 150 + 24 * i : 164 + 24 * i] = colour
    for row in range(130, 200, 10):
        image[row : row + 4, 40:216] *= 0.5
    y, x = np.mgrid[0:24, 0:SIZE]
    image[224:248] = np.where(
        ((x + y) // 16 % 2)[..., None] == 0, (0.85, 0.72, 0.1), (0.1, 0.1, 0.1)
    )
    return pixels(image)


def window() -> Image:
    """Return a window seen from the open: a white frame, dark rooms, a reflection of the sky."""
    y, x = np.mgrid[0:128, 0:128] / 127.0
    sheen = np.clip(1.2 - np.abs(x + 0.7 * y - 0.8) * 4.0, 0.0, 1.0)[..., None]
    sky = np.asarray((0.34, 0.42, 0.50)) * (1.15 - 0.5 * y)[..., None]
    image = sky + 0.18 * sheen
    for edge in (image[:6], image[-6:], image[:, :6], image[:, -6:], image[:, 61:67], image[40:44]):
        edge[...] = (0.88, 0.88, 0.86)
    return pixels(image)


def pane() -> Image:
    """Return glass: the sky's reflection, brighter at the top."""
    y = np.linspace(1.0, 0.0, 64)[:, None] * np.ones((1, 64))
    return shade((0.66, 0.76, 0.80), 0.25 * (y - 0.5), 0.02 * noise(64, 1.5, 47))


OBJECTS: Final[Mapping[str, Callable[[], Image]]] = {
    "plaster": plaster,
    "ceiling": ceiling,
    "steel_roof": steel_roof,
    "render": render,
    "cladding": cladding,
    "brick": brick,
    "wood": wood,
    "dark_wood": lambda: wood((0.36, 0.24, 0.15), 48),
    "pale_wood": lambda: wood((0.74, 0.62, 0.44), 50),
    "metal": brushed_metal,
    "fabric_blue": lambda: fabric((0.22, 0.31, 0.46)),
    "fabric_red": lambda: fabric((0.50, 0.18, 0.17)),
    "fabric_green": lambda: fabric((0.21, 0.38, 0.27)),
    "fabric_grey": lambda: fabric((0.36, 0.37, 0.40)),
    "fabric_dark": lambda: fabric((0.12, 0.13, 0.17)),
    "rubber": lambda: painted((0.08, 0.08, 0.08)),
    "leaves": foliage,
    "bark": bark,
    "carton": carton,
    "pale_carton": lambda: carton((0.76, 0.63, 0.45)),
    "goods": wrapped_goods,
    "plastic": lambda: painted((0.28, 0.42, 0.56)),
    "yellow": lambda: painted((0.86, 0.64, 0.10)),
    "orange": lambda: painted((0.85, 0.38, 0.10)),
    "blue": lambda: painted((0.13, 0.27, 0.52)),
    "red": lambda: painted((0.70, 0.12, 0.10)),
    "white": lambda: painted((0.90, 0.90, 0.88)),
    "terracotta": lambda: painted((0.66, 0.36, 0.24)),
    "skin": lambda: painted((0.84, 0.64, 0.52)),
    "books": books,
    "drawers": drawers,
    "door": door_leaf,
    "shutter": shutter,
    "machine": control_panel,
    "glass": pane,
    "window": window,
}
"""Makers of the textures by name."""
