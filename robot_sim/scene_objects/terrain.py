"""Terrain: a heightfield from a seed and a few parameters.

The field covers a rectangle and descends below the floor at its rim, so that it joins without a step.
Its heights are those of the triangles into which MuJoCo splits every cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError
from robot_sim.number_checks import check_bounds, check_finite, check_positive
from robot_sim.scene_objects.plan_elements import Bounds

MOST_CELLS: Final = 256
"""Greatest number of cells along one side: more cost memory without showing more relief."""
_RIM: Final = -0.03
"""Height at the rim [m]: under the floor, whose plane carries the wheels before they reach it."""
_BASE: Final = 0.1
"""Thickness of the ground under the lowest point [m]."""


@dataclass(frozen=True, slots=True)
class Hill:
    """A round hill, or a hollow if its height is negative."""

    x: float
    """x of the centre [m]."""
    y: float
    """y of the centre [m]."""
    height: float
    """Height of the top [m]."""
    radius: float
    """Radius at which it ends [m]."""

    def __post_init__(self) -> None:
        check_finite("a hill", x=self.x, y=self.y, height=self.height)
        check_positive("a hill", radius=self.radius)


@dataclass(frozen=True, slots=True)
class Rut:
    """A track worn into the ground along a line."""

    path: tuple[tuple[float, float], ...]
    """Way-points (x, y) [m], at least two."""
    width: float = 0.3
    """Distance between its edges [m]."""
    depth: float = 0.05
    """Depth of its middle [m]."""

    def __post_init__(self) -> None:
        check_positive("a rut", width=self.width, depth=self.depth)
        if len(self.path) < 2:
            raise WorldError(f"a rut: path must have at least two points, got {len(self.path)}")


@dataclass(frozen=True, slots=True)
class LevelDisc:
    """A disc that is levelled, such as a place to stand."""

    x: float
    """x of the centre [m]."""
    y: float
    """y of the centre [m]."""
    radius: float
    """Radius of the level part [m]; it blends into the relief over the same width again."""
    height: float
    """Height of the level part [m]."""

    def __post_init__(self) -> None:
        check_finite("a level part", x=self.x, y=self.y, height=self.height)
        check_positive("a level part", radius=self.radius)


@dataclass(frozen=True, slots=True)
class Terrain:
    """A heightfield: swell and roughness by seed, hills, ruts and level discs by hand."""

    name: str
    """Name of the terrain."""
    bounds: Bounds
    """Smallest x, y and largest x, y [m]."""
    cell: float = 0.25
    """Side of a cell [m]; adjusted to fit."""
    height: float = 0.05
    """Height of the ground within the rim, before anything else [m]."""
    skirt: float = 1.0
    """Width of the rim over which it rises from under the floor [m]."""
    roughness: float = 0.05
    """Standard deviation of the fractal noise [m]."""
    wavelength: float = 4.0
    """Wavelength of the longest waves [m]; four octaves, each half as long and half as high as the
    last."""
    seed: int = 0
    """Seed of the noise."""
    surface: str = "grass"
    """Surface and material, a key of ``floor_surfaces.SURFACES``."""
    hills: tuple[Hill, ...] = ()
    """Hills and hollows."""
    ruts: tuple[Rut, ...] = ()
    """Tracks worn into the ground."""
    levels: tuple[LevelDisc, ...] = ()
    """Level discs."""

    def __post_init__(self) -> None:
        what = f"terrain {self.name!r}"
        x0, y0, x1, y1 = self.bounds
        check_bounds(what, self.bounds)
        check_finite(what, height=self.height)
        check_positive(what, cell=self.cell, skirt=self.skirt, wavelength=self.wavelength)
        if not (math.isfinite(self.roughness) and self.roughness >= 0.0):
            raise WorldError(f"{what}: roughness must be >= 0 m, got {self.roughness}")
        if self.seed < 0:
            raise WorldError(f"{what}: seed must be >= 0, got {self.seed}")
        rows, columns = self.shape
        if max(rows, columns) - 1 > MOST_CELLS:
            raise WorldError(
                f"{what}: {columns - 1} by {rows - 1} cells are too many; with at most {MOST_CELLS}"
                f" along a side, cell must be >= {max(x1 - x0, y1 - y0) / MOST_CELLS:.3g} m"
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows (along y) and columns (along x) of its grid points."""
        x0, y0, x1, y1 = self.bounds
        return (
            max(2, 1 + round((y1 - y0) / self.cell)),
            max(2, 1 + round((x1 - x0) / self.cell)),
        )

    def grid(self) -> FloatArray:
        """Return the heights of its grid points [m], one row per y, from the smallest x and y."""
        x0, y0, x1, y1 = self.bounds
        rows, columns = self.shape
        x, y = np.meshgrid(np.linspace(x0, x1, columns), np.linspace(y0, y1, rows))
        height = self.height + self._noise(x, y)
        for hill in self.hills:
            far = np.clip(np.hypot(x - hill.x, y - hill.y) / hill.radius, 0.0, 1.0)
            height += hill.height * 0.5 * (1.0 + np.cos(np.pi * far))
        for rut in self.ruts:
            far = np.clip(2.0 * _distance(x, y, rut.path) / rut.width, 0.0, 1.0)
            height -= rut.depth * 0.5 * (1.0 + np.cos(np.pi * far))
        for level in self.levels:
            far = np.hypot(x - level.x, y - level.y) / level.radius
            height += _ease(2.0 - far) * (level.height - height)
        rim = np.minimum(np.minimum(x - x0, x1 - x), np.minimum(y - y0, y1 - y)) / self.skirt
        result: FloatArray = _RIM + _ease(rim) * (height - _RIM)
        return result

    def _noise(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return fractal value noise, scaled to the roughness."""
        total = np.zeros_like(x)
        if self.roughness == 0.0:
            return total
        rng = np.random.default_rng(self.seed)
        for octave in range(4):
            step = self.wavelength / 2.0 * 0.5**octave
            u, v = (x - x.min()) / step, (y - y.min()) / step
            knots = rng.normal(size=(int(v.max()) + 2, int(u.max()) + 2))
            i, j = v.astype(int), u.astype(int)
            a, b = _ease(v - i), _ease(u - j)
            total += 0.5**octave * (
                (1 - a) * ((1 - b) * knots[i, j] + b * knots[i, j + 1])
                + a * ((1 - b) * knots[i + 1, j] + b * knots[i + 1, j + 1])
            )
        result: FloatArray = total * (self.roughness / total.std())
        return result


def add_terrain(spec: mujoco.MjSpec, terrain: Terrain, grid: FloatArray) -> mujoco.MjsGeom:
    """Add a terrain with these heights to a specification, and return its geom."""
    x0, y0, x1, y1 = terrain.bounds
    low, high = float(grid.min()), float(grid.max())
    # MuJoCo scales the lowest point to 0 and the highest to 1.
    spec.add_hfield(
        name=terrain.name,
        nrow=grid.shape[0],
        ncol=grid.shape[1],
        size=(0.5 * (x1 - x0), 0.5 * (y1 - y0), max(high - low, 1e-6), _BASE),
        userdata=grid.ravel(),
    )
    return spec.worldbody.add_geom(
        name=terrain.name,
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname=terrain.name,
        pos=(0.5 * (x0 + x1), 0.5 * (y0 + y1), low),
    )


def grid_heights(terrain: Terrain, grid: FloatArray, points: FloatArray) -> FloatArray:
    """Return the terrain's height (N,) [m] at (N, 2) ``points``; -inf beside it.

    Every cell is two triangles, split along the diagonal from its first corner to the opposite one,
    as MuJoCo's rays see it.
    """
    x0, y0, x1, y1 = terrain.bounds
    rows, columns = grid.shape
    u = (points[:, 0] - x0) / (x1 - x0) * (columns - 1)
    v = (points[:, 1] - y0) / (y1 - y0) * (rows - 1)
    inside = (u >= 0.0) & (u <= columns - 1) & (v >= 0.0) & (v <= rows - 1)
    j = np.clip(np.where(inside, u, 0.0).astype(int), 0, columns - 2)
    i = np.clip(np.where(inside, v, 0.0).astype(int), 0, rows - 2)
    b, a = u - j, v - i
    h00, h01 = grid[i, j], grid[i, j + 1]
    h10, h11 = grid[i + 1, j], grid[i + 1, j + 1]
    right = h00 + b * (h01 - h00) + a * (h11 - h01)
    left = h00 + a * (h10 - h00) + b * (h11 - h10)
    result: FloatArray = np.where(inside, np.where(b >= a, right, left), -np.inf)
    return result


def _ease(t: FloatArray) -> FloatArray:
    """Return a smooth step from 0 to 1."""
    t = np.clip(t, 0.0, 1.0)
    result: FloatArray = t * t * (3.0 - 2.0 * t)
    return result


def _distance(x: FloatArray, y: FloatArray, path: tuple[tuple[float, float], ...]) -> FloatArray:
    """Return the distance of each grid point from a polyline [m]."""
    least = np.full_like(x, np.inf)
    for (ax, ay), (bx, by) in pairwise(path):
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        t = np.clip(((x - ax) * dx + (y - ay) * dy) / max(square, 1e-12), 0.0, 1.0)
        least = np.minimum(least, np.hypot(x - ax - t * dx, y - ay - t * dy))
    return least
