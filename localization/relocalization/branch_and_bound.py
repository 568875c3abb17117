"""Branch and bound: search of a window or of the whole map over a pyramid of floor plans.

Each level of the pyramid holds, for every cell, the maximum over the block of cells that begins there: laying
the horizontal scanner's points over it gives a bound for all places of the block at once (Olson 2009; Hess et
al. 2016, whose precomputed grids these are). Blocks whose bound is clearly below the best place found are
never opened. The work is a generator that yields after a fixed amount of work, so that it costs each tick the
same and the result never depends on the clock.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.relocalization.floor_plan import FloorPlan, level_points
from localization.relocalization.refinement import best_places, refined_places
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.types import Candidate, Pose, Sweep

ByteArray = npt.NDArray[np.uint8]
IndexArray = npt.NDArray[np.int64]

_FULL = 255
"""Score of a point on a surface."""


@dataclass(frozen=True, slots=True)
class MapSearchConfig:
    """How the whole map is searched."""

    levels: int = 3
    """The coarsest blocks have 2 to this power cells along their edge; larger ones contain surfaces everywhere."""
    finest: int = 1
    """The finest blocks have 2 to this power cells along their edge."""
    beams: int = 72
    """Number of points of the horizontal scanner that are laid over the plan."""
    reach: float = 30.0
    """Points farther from the robot than this are not used [m]."""
    slack: float = 0.10
    """Places that score less than the best one by up to this share of the full score are still examined."""
    budget: int = 1_000_000
    """Number of points that are laid over the plan per tick."""
    refine: int = 12
    """Number of the best places that are refined against the cloud."""


class Pyramid:
    """Floor plans of a map, each the maximum over larger blocks than the one before."""

    def __init__(self, plan: FloorPlan, config: MapSearchConfig = MapSearchConfig()) -> None:
        self.config, self.cell, self.origin = config, plan.cell, plan.origin
        self._pad = int(np.ceil(config.reach / plan.cell)) + (1 << config.levels)
        exact = np.pad(np.rint(plan.likelihood * _FULL).astype(np.uint8), self._pad)
        self._shape = exact.shape
        self._levels: list[ByteArray] = []
        self._free: list[npt.NDArray[np.bool_]] = []
        for level in range(config.levels + 1):
            size = 1 << level
            # A block begins at its cell and reaches towards larger indices.
            ahead = -(size // 2) if size > 1 else 0
            pooled = ndimage.maximum_filter(exact, size=size, origin=ahead, mode="constant")
            self._levels.append(pooled.ravel())
            free = ndimage.maximum_filter(plan.free, size=size, origin=ahead, mode="constant")
            self._free.append(np.asarray(free, dtype=bool))

    def roots(self) -> IndexArray:
        """Return the first cells (N, 2) of the coarsest blocks that contain a place to stand on."""
        size = 1 << self.config.levels
        free = self._free[-1][::size, ::size]
        return np.argwhere(free) * size

    def children(self, blocks: IndexArray, level: int) -> IndexArray:
        """Return the blocks (4 N, 2) of ``level`` within those of the level above."""
        half = 1 << level
        corners = np.array([[0, 0], [0, half], [half, 0], [half, half]])
        inner: IndexArray = blocks[:, None, :] + corners
        return inner.reshape(-1, 2)

    def stands(self, blocks: IndexArray, level: int) -> npt.NDArray[np.bool_]:
        """Return for blocks (N, 2) whether there is a place to stand on in each."""
        free = self._free[level]
        inside = (blocks[:, 0] < free.shape[0]) & (blocks[:, 1] < free.shape[1])
        at = np.where(inside[:, None], blocks, 0)
        stands: npt.NDArray[np.bool_] = inside & free[at[:, 0], at[:, 1]]
        return stands

    def bounds(self, blocks: IndexArray, offsets: IndexArray, level: int) -> FloatArray:
        """Return an upper bound of the score of points anywhere in each block.

        Args:
            blocks: (N, 2) first cells.
            offsets: (N, B) of the points, as ``offsets_of`` gives them.
            level: level of the blocks.
        """
        width = self._shape[1]
        base = (blocks[:, 0] + self._pad) * width + blocks[:, 1] + self._pad
        scores = self._levels[level].take(base[:, None] + offsets)
        total: FloatArray = scores.mean(axis=1, dtype=np.float64) / _FULL
        return total

    def offsets_of(self, points: FloatArray) -> IndexArray:
        """Return the offsets of points (B, 2) [m] from the robot's cell, in cells of the flattened plan."""
        cells = np.floor(points / self.cell + 0.5).astype(np.int64)
        offsets: IndexArray = cells[:, 0] * self._shape[1] + cells[:, 1]
        return offsets

    def overlap(self, blocks: IndexArray, level: int, window: Window) -> npt.NDArray[np.bool_]:
        """Return for blocks (N, 2) whether each overlaps a window."""
        low = self.origin + blocks * self.cell
        high = low + (1 << level) * self.cell
        middle = np.array([window.x, window.y])
        near = (low <= middle + window.half_width) & (high >= middle - window.half_width)
        inside: npt.NDArray[np.bool_] = near[:, 0] & near[:, 1]
        return inside

    def positions(self, blocks: IndexArray, level: int) -> FloatArray:
        """Return the middles (N, 2) of blocks [m]."""
        return self.origin + (blocks + 0.5 * (1 << level)) * self.cell


def search_map(
    sweep: Sweep,
    world: PreparedMap,
    pyramid: Pyramid,
    level: Pose,
    config: SearchConfig = SearchConfig(),  # noqa: B008  (frozen)
    window: Window | None = None,
) -> Generator[None, None, tuple[Candidate, ...]]:
    """Search the whole map or a window; yields after each budget's worth of work and returns the places found.

    Args:
        sweep: points in ``base_link`` at one instant.
        world: the prepared cloud.
        pyramid: pyramid of its floor plan.
        level: a pose whose height, roll and pitch the robot has.
        config: steps and thresholds.
        window: if given, only places in it are examined, and fewer of them refined.

    Returns:
        Distinct places, best first, each with the share of the sweep that it explains.
    """
    c = pyramid.config
    points = level_points(sweep, level)
    points = points[np.hypot(*points.T) < c.reach]
    if len(points) < 10:
        return ()
    points = points[np.linspace(0, len(points) - 1, min(c.beams, len(points))).astype(int)]
    yaws = _yaws(window, config)
    turned = np.stack(
        [pyramid.offsets_of(points @ np.array([[k, s], [-s, k]]))
         for k, s in zip(np.cos(yaws), np.sin(yaws), strict=True)]
    )  # fmt: skip
    roots = pyramid.roots()
    if window is not None:
        roots = roots[pyramid.overlap(roots, c.levels, window)]
    blocks, which, bounds = yield from _roots(pyramid, roots, turned, c)
    for finer in range(c.levels - 1, c.finest - 1, -1):
        blocks, which, bounds = yield from _open(pyramid, turned, blocks, which, bounds, finer, c)
    if window is not None:
        inside = pyramid.overlap(blocks, c.finest, window)
        blocks, which, bounds = blocks[inside], which[inside], bounds[inside]
    places = pyramid.positions(blocks, c.finest)
    most = c.refine if window is None else config.refine
    peaks = best_places(bounds, places, yaws[which], config, most=most)
    return (yield from refined_places(sweep, world, peaks, level, config))


def _yaws(window: Window | None, config: SearchConfig) -> FloatArray:
    """Return the headings to try (N,) [rad]: those of a window, or a full turn if that is less."""
    turns = np.inf if window is None else np.ceil(window.half_yaw / config.step_yaw)
    if window is None or (2.0 * turns + 1.0) * config.step_yaw >= 2.0 * np.pi:
        return np.arange(0.0, 2.0 * np.pi - 1e-9, config.step_yaw)
    yaws: FloatArray = window.yaw + config.step_yaw * np.arange(-turns, turns + 1.0)
    return yaws


Nodes = tuple[IndexArray, IndexArray, FloatArray]
"""Blocks (N, 2), headings (N,) by number, and the bound of each (N,)."""


def _roots(
    pyramid: Pyramid, roots: IndexArray, turned: IndexArray, c: MapSearchConfig
) -> Generator[None, None, Nodes]:
    """Bound the coarsest blocks at every heading."""
    bounds = np.empty((len(turned), len(roots)))
    spent = 0
    for i, offsets in enumerate(turned):
        bounds[i] = pyramid.bounds(roots, offsets[None, :], c.levels)
        spent += len(roots) * turned.shape[1]
        if spent >= c.budget:
            spent = 0
            yield
    which, block = np.divmod(np.arange(bounds.size), max(len(roots), 1))
    return roots[block], which, bounds.ravel()


def _open(
    pyramid: Pyramid,
    turned: IndexArray,
    blocks: IndexArray,
    which: IndexArray,
    bounds: FloatArray,
    level: int,
    c: MapSearchConfig,
) -> Generator[None, None, Nodes]:
    """Open blocks, the most promising first, until no block is left that could contain one of the best places.

    The score of the best is estimated first, by following the most promising blocks down.
    """
    order = np.argsort(-bounds, kind="stable")
    batch = max(1, c.budget // (4 * turned.shape[1]))
    floor = _descend(pyramid, turned, blocks[order[:64]], which[order[:64]], level, c) - c.slack
    kept: list[Nodes] = []
    for first in range(0, len(order), batch):
        chosen = order[first : first + batch]
        chosen = chosen[bounds[chosen] >= floor]
        if len(chosen) == 0:
            break
        kept.append(_children(pyramid, turned, blocks[chosen], which[chosen], level, floor))
        yield
    if not kept:
        return blocks[:0], which[:0], bounds[:0]
    return (
        np.concatenate([nodes[0] for nodes in kept]),
        np.concatenate([nodes[1] for nodes in kept]),
        np.concatenate([nodes[2] for nodes in kept]),
    )


def _children(
    pyramid: Pyramid,
    turned: IndexArray,
    blocks: IndexArray,
    which: IndexArray,
    level: int,
    floor: float,
) -> Nodes:
    inner = pyramid.children(blocks, level)
    heading = np.repeat(which, 4)
    stands = pyramid.stands(inner, level)
    inner, heading = inner[stands], heading[stands]
    bounds = pyramid.bounds(inner, turned[heading], level)
    good = bounds >= floor
    return inner[good], heading[good], bounds[good]


def _descend(
    pyramid: Pyramid,
    turned: IndexArray,
    blocks: IndexArray,
    which: IndexArray,
    level: int,
    c: MapSearchConfig,
) -> float:
    """Return the score of the best place that a greedy search from some blocks finds."""
    best = 0.0
    for finer in range(level, c.finest - 1, -1):
        blocks, which, bounds = _children(pyramid, turned, blocks, which, finer, 0.0)
        if len(bounds) == 0:
            return 0.0
        order = np.argsort(-bounds, kind="stable")[:64]
        blocks, which, best = blocks[order], which[order], float(bounds[order[0]])
    return best
