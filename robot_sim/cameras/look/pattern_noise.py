"""Tileable noise and small tools of which textures are made; everything from seeds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from robot_sim.array_types import FloatArray

Image = npt.NDArray[np.uint8]
"""A texture, (rows, columns, 3)."""
Rgb = tuple[float, float, float]
"""A colour, each part 0 to 1."""


def noise(size: int, coarse: float, seed: int, stretch: float = 1.0) -> FloatArray:
    """Return tileable noise (size, size) with mean 0 and standard deviation 1.

    Args:
        size: Pixels along a side.
        coarse: Exponent of the spectrum: 0 for white noise, 1 to 2 for clouds.
        seed: Seed of the noise.
        stretch: Ratio of the grain's length along x to that along y.
    """
    rng = np.random.default_rng(seed)
    waves = np.fft.rfft2(rng.standard_normal((size, size)))
    fy = np.fft.fftfreq(size)[:, None]
    fx = np.fft.rfftfreq(size)[None, :] * stretch
    scale = np.hypot(fx, fy)
    scale[0, 0] = np.inf
    field: FloatArray = np.fft.irfft2(waves * scale**-coarse, s=(size, size))
    field -= field.mean()
    field /= field.std()
    return field


def shade(base: Rgb, *fields: FloatArray) -> Image:
    """Return a colour whose brightness is varied by the sum of fields (0.1 is a tenth)."""
    total = 1.0 + sum(fields, np.zeros((1, 1)))
    return pixels(np.asarray(base) * total[..., None])


def pixels(colours: FloatArray) -> Image:
    """Return colours 0 to 1 as bytes."""
    image: Image = (np.clip(colours, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return image


def grid_lines(size: int, columns: int, rows: int, width: int, *, bond: bool = False) -> FloatArray:
    """Return 1 on the joints between tiles and 0 elsewhere; in a bond every second row is set off by half."""
    y, x = np.mgrid[0:size, 0:size]
    row = y * rows // size
    shift = (row % 2) * (size // columns // 2) if bond else 0
    along = (x + shift) % (size // columns) < width
    across = y % (size // rows) < width
    lines: FloatArray = (along | across).astype(float)
    return lines


def cell_values(size: int, columns: int, rows: int, seed: int, *, bond: bool = False) -> FloatArray:
    """Return a random number -1 to 1 for each tile, constant within it."""
    values = np.random.default_rng(seed).uniform(-1.0, 1.0, (rows, columns))
    y, x = np.mgrid[0:size, 0:size]
    row = y * rows // size
    shift = (row % 2) * (size // columns // 2) if bond else 0
    column = ((x + shift) % size) * columns // size
    cells: FloatArray = values[np.minimum(row, rows - 1), np.minimum(column, columns - 1)]
    return cells


def stones(size: int, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return for a tileable bed of stones the share of the way to each one's edge, and its own random number."""
    rng = np.random.default_rng(seed)
    cells = max(2, round(count**0.5))
    spots = rng.uniform(0.1, 0.9, (cells, cells, 2))
    own = rng.uniform(-1.0, 1.0, (cells, cells))
    y, x = np.mgrid[0:size, 0:size] / size * cells
    best, second = np.full((size, size), np.inf), np.full((size, size), np.inf)
    value = np.zeros((size, size))
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            i, j = y.astype(int) + dy, x.astype(int) + dx
            spot = spots[i % cells, j % cells]
            far = np.hypot(y - i - spot[..., 0], x - j - spot[..., 1])
            nearer = far < best
            second = np.where(nearer, best, np.minimum(second, far))
            value = np.where(nearer, own[i % cells, j % cells], value)
            best = np.where(nearer, far, best)
    return best / np.maximum(second, 1e-6), value
