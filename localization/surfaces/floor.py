"""The floor: its image, of what was seen of it, and its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from localization.geometry import FloatArray
from localization.maps.ground_height import Ground

_CELL: Final = 0.1
"""Side of a pixel of the floor [m]."""
_HOLE: Final = 0.4
"""Half the width of holes that are closed [m]: where the robot that surveyed drove, it did not see the floor."""
_MESH: Final = 0.5
"""Side of the squares of a floor that is not level [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """The floor seen from above."""

    known: npt.NDArray[np.bool_]
    """(nx, ny) where it was seen, in pixels of ``cell``."""
    origin: FloatArray
    """(2,) outer corner of the first pixel [m]."""
    cell: float
    """Side of a pixel [m]."""
    ground: Ground
    """Its height."""

    def mesh(self) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int64]]:
        """Return vertices (V, 3) [m], their places in the image (V, 2) from 0 to 1, and triangles (T, 3)."""
        size = np.array(self.known.shape) * self.cell
        squares = np.array([1, 1]) if self.ground.level else np.ceil(size / _MESH).astype(int)
        x, y = (np.linspace(0.0, size[i], squares[i] + 1) for i in (0, 1))
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        at = places + self.origin
        vertices = np.column_stack([at, self.ground.heights(at)])
        number = np.arange(len(at)).reshape(len(x), len(y))
        a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        return vertices, places / size, triangles


def floor_of(points: FloatArray, ground: Ground, spacing: float) -> Floor | None:
    """Return the floor from its points (N, 3) [m]; None if there are none."""
    if len(points) == 0:
        return None
    cell = max(_CELL, 1.5 * spacing)
    origin = points[:, :2].min(axis=0)
    i, j = np.floor((points[:, :2] - origin) / cell).astype(np.int64).T
    pixels = int(np.ceil(_HOLE / cell))
    known = np.zeros((i.max() + 2 * pixels + 1, j.max() + 2 * pixels + 1), dtype=bool)
    known[i + pixels, j + pixels] = True
    across = np.arange(-pixels, pixels + 1)
    disc = np.hypot(across[:, None], across[None, :]) <= pixels
    closed = ndimage.binary_closing(known, disc)
    return Floor(closed, origin - pixels * cell, cell, ground)
