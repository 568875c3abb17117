"""Branch and bound: search of a window or of the whole map over a pyramid of floor plans.

Each level of the pyramid holds, for every cell, the maximum over the block of cells that begins there: laying
the horizontal scanner's points over it gives a bound for all places of the block at once (Olson 2009; Hess et
al. 2016, whose precomputed grids these are). Blocks whose bound is clearly below the best place found are
never opened. The work is a generator of small pieces that yields the amount of each, so that every reading can be
granted the same amount, and the result never depends on the clock.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from localization.compiled.blocks import lay
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.relocalization.floor_plan import FloorPlan, level_points
from localization.relocalization.refinement import best_places, refined_places
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.relocalization.search_work import PIECE, SearchWork, Work
from localization.relocalization.verification import Weighing
from localization.types import Pose, Sweep

ByteArray = npt.NDArray[np.uint8]
IndexArray = npt.NDArray[np.int64]

_FULL = 255
"""Score of a point on a surface."""
_FINEST = 1
"""Level of the blocks that are places: two cells along their edge, the step of the search."""
COARSEST = 4
"""Level of the first blocks: 16 cells along their edge, 0.8 m. Of larger ones fewer can be left out, of smaller ones there
are more; what is found is the same."""
_FOLLOWED = 64
"""Number of the most promising blocks that are followed down to estimate the best score."""
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Multiples of it, less their whole part, never come near each other: the golden ratio."""
FEWEST_POINTS = 10
"""Number of horizontal points without which nothing is searched."""


@dataclass(frozen=True, slots=True)
class MapSearchConfig:
    """How the whole map is searched."""

    beams: int = 72
    """Number of points of the horizontal scanner that are laid over the plan."""
    reach: float = 30.0
    """Points farther from the robot than this are not used [m]."""
    slack: float = 0.10
    """Places that score less than the best one by up to this share of the full score are still examined."""
    work_per_tick: int = 3_000_000
    """Number of points that are laid over the plan in 20 ms of the readings' time; a refinement counts as
    many (``REFINEMENT``)."""
    max_work: int = 15_000_000
    """Largest number of points that are laid over the plan with one reading: some 40 ms of work. Where readings come
    less often than every 0.1 s, a search takes longer for it."""
    max_blocks: int = 400_000
    """Largest number of blocks that are kept of a level, the best ones: in a map where many places look
    alike, more would hold the search up and decide nothing."""
    refine: int = 12
    """Number of the best places that are refined against the cloud, and then tracked if they are distinct."""


class Pyramid:
    """Floor plans of a map, each the maximum over larger blocks than the one before."""

    def __init__(self, plan: FloorPlan, config: MapSearchConfig = MapSearchConfig()) -> None:
        self.config, self.cell, self.origin = config, plan.cell, plan.origin
        # Wide enough for every beam from every block, so that no index is ever checked.
        self._pad = int(np.ceil(config.reach / plan.cell)) + (1 << COARSEST)
        exact = np.pad(np.rint(plan.likelihood * _FULL).astype(np.uint8), self._pad)
        self._shape = exact.shape
        levels, free = [exact], [plan.free]
        for level in range(COARSEST):
            # A block begins at its cell and reaches towards larger indices.
            # The maximum over 4^n cells from four maxima of the level below, whatever n.
            levels.append(_pooled(levels[-1], 1 << level))
            free.append(_pooled(free[-1], 1 << level))
        self._levels: list[ByteArray] = [level.ravel() for level in levels]
        self._free: list[npt.NDArray[np.bool_]] = free

    def roots(self) -> IndexArray:
        """Return the first cells (N, 2) of the coarsest blocks that contain a place to stand on."""
        size = 1 << COARSEST
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

    def bounds(
        self,
        blocks: IndexArray,
        offsets: IndexArray,
        which: IndexArray,
        level: int,
        least: float = 0.0,
    ) -> tuple[FloatArray, int]:
        """Return an upper bound of the score of points anywhere in each block, and the number of points laid.

        Args:
            blocks: (N, 2) first cells.
            offsets: (H, B) of the points at each heading, as ``offsets_of`` gives them.
            which: (N,) heading of each block.
            level: level of the blocks.
            least: a block with a smaller bound may get a negative one, for less work.
        """
        width, full = self._shape[1], _FULL * offsets.shape[1]
        firsts = (blocks[:, 0] + self._pad) * width + blocks[:, 1] + self._pad
        sums = np.empty(len(firsts), dtype=np.int64)
        missing = full - math.ceil(least * full)
        laid = lay(self._levels[level], firsts, offsets, which, missing, sums)
        return sums / full, laid

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


def _pooled(cells: npt.NDArray[Any], step: int) -> npt.NDArray[Any]:
    """Return for each cell the maximum of it and those ``step`` farther on along x, y and both."""
    along = cells.copy()
    np.maximum(along[:-step], cells[step:], out=along[:-step])
    both = along.copy()
    np.maximum(both[:, :-step], along[:, step:], out=both[:, :-step])
    return both


def search_map(
    sweep: Sweep,
    world: PreparedMap,
    pyramid: Pyramid,
    level: Pose,
    config: SearchConfig = SearchConfig(),  # noqa: B008  (frozen)
    window: Window | None = None,
    registration: RegistrationConfig = RegistrationConfig(),  # noqa: B008  (frozen)
    *,
    weighing: Weighing,
) -> SearchWork:
    """Search the whole map or a window; yields the amount of each piece of work and returns the places found.

    Args:
        sweep: points in ``base_link`` at one instant.
        world: the prepared cloud.
        pyramid: pyramid of its floor plan.
        level: a pose whose height, roll and pitch the robot has.
        config: steps and thresholds.
        window: if given, only places in it are examined.
        registration: how places are registered.
        weighing: what weighs the places found.

    Returns:
        Distinct places, best first, each with the share of the sweep that it explains and the evidence of that.
    """
    c = pyramid.config
    points = level_points(sweep, level)
    points = points[np.hypot(*points.T) < c.reach]
    if len(points) < FEWEST_POINTS:
        return ()
    points = points[np.linspace(0, len(points) - 1, min(c.beams, len(points))).astype(int)]
    # Neighbours fall on the same wall, or off it. Far from each other they show early that a block is not one of the best.
    points = points[_apart(len(points))]
    yaws = _yaws(window, config)
    turned = np.stack(
        [pyramid.offsets_of(points @ np.array([[k, s], [-s, k]]))
         for k, s in zip(np.cos(yaws), np.sin(yaws), strict=True)]
    )  # fmt: skip
    roots = pyramid.roots()
    if window is not None:
        roots = roots[pyramid.overlap(roots, COARSEST, window)]
    nodes = yield from _roots(pyramid, roots, turned)
    for finer in range(COARSEST - 1, _FINEST - 1, -1):
        nodes = yield from _open(pyramid, turned, nodes, finer)
    blocks, which, bounds = nodes
    if window is not None:
        inside = pyramid.overlap(blocks, _FINEST, window)
        blocks, which, bounds = blocks[inside], which[inside], bounds[inside]
    places = pyramid.positions(blocks, _FINEST)
    peaks = best_places(bounds, places, yaws[which], config, most=c.refine)
    yield len(bounds)
    return (
        yield from refined_places(
            sweep, world, peaks, level, config, registration, weighing, window
        )
    )


def _apart(count: int) -> IndexArray:
    """Return the numbers (N,) from 0 to ``count`` in an order in which those near each other come long after each other."""
    return np.argsort(np.arange(count) * _GOLDEN % 1.0)


def _yaws(window: Window | None, config: SearchConfig) -> FloatArray:
    """Return the headings to try (N,) [rad]: those of a window, or a full turn if that is less."""
    turns = np.inf if window is None else np.ceil(window.half_yaw / config.step_yaw)
    if window is None or (2.0 * turns + 1.0) * config.step_yaw >= 2.0 * np.pi:
        return np.arange(0.0, 2.0 * np.pi - 1e-9, config.step_yaw)
    yaws: FloatArray = window.yaw + config.step_yaw * np.arange(-turns, turns + 1.0)
    return yaws


Nodes = tuple[IndexArray, IndexArray, FloatArray]
"""Blocks (N, 2), headings (N,) by number, and the bound of each (N,)."""


def _roots(pyramid: Pyramid, roots: IndexArray, turned: IndexArray) -> Work[Nodes]:
    """Bound the coarsest blocks at every heading; return those that could contain one of the best places.

    The best place that was found at the headings before says which blocks need not be laid to the end.
    """
    c = pyramid.config
    batch = max(1, PIECE // turned.shape[1])
    kept, here, floor, spent = [_none()], [_none()], 0.0, 0
    for i in _apart(len(turned)):
        for first in range(0, len(roots), batch):
            blocks = roots[first : first + batch]
            which = np.full(len(blocks), i)
            bounds, laid = pyramid.bounds(blocks, turned, which, COARSEST, floor)
            good = bounds >= floor
            here.append((blocks[good], which[good], bounds[good]))
            spent += laid
            if spent >= PIECE:
                best, laid = _descend(pyramid, turned, _best_of(here, _FOLLOWED), COARSEST - 1)
                yield spent + laid
                floor, spent = max(floor, best - c.slack), 0
                kept, here = [*kept, *here], [_none()]
    yield spent
    blocks, which, bounds = _best_of([*kept, *here], c.max_blocks)
    good = bounds >= floor
    return blocks[good], which[good], bounds[good]


def _open(pyramid: Pyramid, turned: IndexArray, nodes: Nodes, level: int) -> Work[Nodes]:
    """Open blocks; return the blocks within them that could contain one of the best places.

    The score of the best is estimated first, by following the most promising blocks down.
    """
    c = pyramid.config
    batch = max(1, PIECE // (4 * turned.shape[1]))
    best, laid = _descend(pyramid, turned, _best_of((nodes,), _FOLLOWED), level)
    floor = best - c.slack
    promising = np.flatnonzero(nodes[2] >= floor)
    yield len(nodes[2]) + laid
    kept = [_none()]
    for first in range(0, len(promising), batch):
        chosen = promising[first : first + batch]
        inner, laid = _children(pyramid, turned, nodes[0][chosen], nodes[1][chosen], level, floor)
        kept.append(inner)
        yield laid
    return _best_of(kept, c.max_blocks)


def _none() -> Nodes:
    return np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)


def _largest(values: npt.NDArray[Any], most: int) -> IndexArray:
    """Return the indices of the largest values, at most so many, in their order."""
    if len(values) <= most:
        return np.arange(len(values))
    return np.sort(np.argpartition(-values, most - 1)[:most])


def _best_of(parts: Sequence[Nodes], most: int) -> Nodes:
    """Join nodes, and keep those with the largest bounds, at most so many."""
    blocks, which, bounds = (np.concatenate([part[k] for part in parts]) for k in range(3))
    best = _largest(bounds, most)
    return (
        (blocks, which, bounds)
        if len(best) == len(bounds)
        else (blocks[best], which[best], bounds[best])
    )


def _children(
    pyramid: Pyramid,
    turned: IndexArray,
    blocks: IndexArray,
    which: IndexArray,
    level: int,
    floor: float,
) -> tuple[Nodes, int]:
    inner = pyramid.children(blocks, level)
    heading = np.repeat(which, 4)
    stands = pyramid.stands(inner, level)
    inner, heading = inner[stands], heading[stands]
    bounds, laid = pyramid.bounds(inner, turned, heading, level, floor)
    good = bounds >= floor
    return (inner[good], heading[good], bounds[good]), laid


def _descend(pyramid: Pyramid, turned: IndexArray, nodes: Nodes, level: int) -> tuple[float, int]:
    """Return the score of the best place that a greedy search from some blocks finds, and the number of points laid."""
    best, spent = 0.0, 0
    for finer in range(level, _FINEST - 1, -1):
        nodes, laid = _children(pyramid, turned, nodes[0], nodes[1], finer, 0.0)
        spent += laid
        if len(nodes[2]) == 0:
            return 0.0, spent
        nodes = _best_of((nodes,), _FOLLOWED)
        best = float(nodes[2].max())
    return best, spent
