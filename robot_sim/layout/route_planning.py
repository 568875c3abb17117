"""Where a robot has room, and the ways between: clearance on a grid, shortest paths, round trips.

A way is shortest in a length that counts more where it is narrow, so that it keeps to the middle of
doors and corridors without being told of either.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.floorplan.plan import Waypoint

COMFORT: Final = 0.9
"""Clearance of the robot's centre beyond which more is worth nothing [m]."""
TOUR_LIMIT: Final = 240.0
"""Longest tour [m]: what can be driven in the ten minutes that a mission takes at most."""
MARGIN: Final = 0.08
"""Clearance kept along all routes beyond the circle in which the robot turns [m]."""
_NARROWNESS: Final = 4.0
"""How many times longer a way counts where it is as narrow as allowed."""
_BEND: Final = 0.1
"""What one way-point more must save [m]."""
_REACH: Final = 48
"""Bends of a grid path that one straight leg may skip."""


@dataclass(frozen=True, slots=True)
class Footprint:
    """What an obstacle covers of the floor: a rectangle, its corners rounded outward."""

    x: float
    """Centre [m]."""
    y: float
    half: tuple[float, float]
    """Half extents before rounding [m]."""
    yaw: float = 0.0
    """[rad]."""
    rounding: float = 0.0
    """Radius added all round [m]; a disc has no extents and its radius here."""

    def distance(self, points: FloatArray) -> FloatArray:
        """Return distances (...,) [m] of points (..., 2) from the edge; negative inside a rounding."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        offset = points - (self.x, self.y)
        along = np.abs(offset[..., 0] * c + offset[..., 1] * s) - self.half[0]
        across = np.abs(offset[..., 1] * c - offset[..., 0] * s) - self.half[1]
        gap: FloatArray = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0)) - self.rounding
        return gap


@dataclass(frozen=True, slots=True, eq=False)
class FreeSpace:
    """Clearance at the nodes of a grid."""

    corner: Waypoint
    """The node in row 0 and column 0 [m]."""
    spacing: float
    """Between nodes [m]."""
    clearance: FloatArray
    """(rows along y, columns along x): distance to the nearest obstacle [m], perhaps cut off."""

    @classmethod
    def around(
        cls,
        bounds: tuple[float, float, float, float],
        footprints: Iterable[Footprint],
        *,
        spacing: float = 0.1,
        horizon: float = 1.6,
    ) -> FreeSpace:
        """Return the exact clearance at each node.

        Args:
            bounds: smallest x, y and largest x, y [m]; the first node is at the smallest.
            footprints: the obstacles.
            spacing: between nodes [m].
            horizon: clearance is cut off here [m].
        """
        x0, y0, x1, y1 = bounds
        xs = x0 + spacing * np.arange(math.floor((x1 - x0) / spacing + 1e-6) + 1)
        ys = y0 + spacing * np.arange(math.floor((y1 - y0) / spacing + 1e-6) + 1)
        clearance = np.full((len(ys), len(xs)), horizon)
        for f in footprints:
            c, s = abs(math.cos(f.yaw)), abs(math.sin(f.yaw))
            reach_x = c * f.half[0] + s * f.half[1] + f.rounding + horizon
            reach_y = s * f.half[0] + c * f.half[1] + f.rounding + horizon
            columns = slice(*np.searchsorted(xs, (f.x - reach_x, f.x + reach_x)))
            rows = slice(*np.searchsorted(ys, (f.y - reach_y, f.y + reach_y)))
            points = np.stack(np.meshgrid(xs[columns], ys[rows]), axis=-1)
            window = clearance[rows, columns]
            np.minimum(window, f.distance(points), out=window)
        clearance.flags.writeable = False
        return cls((x0, y0), spacing, clearance)

    def points(self, nodes: IntArray) -> FloatArray:
        """Return where nodes (N,), numbered row by row, lie: (N, 2) [m]."""
        row, column = np.divmod(nodes, self.clearance.shape[1])
        points: FloatArray = np.stack([column, row], axis=1) * self.spacing + np.array(self.corner)
        return points

    def node(self, point: Waypoint) -> int:
        """Return the node nearest to a point."""
        rows, columns = self.clearance.shape
        column = round((point[0] - self.corner[0]) / self.spacing)
        row = round((point[1] - self.corner[1]) / self.spacing)
        return int(min(max(row, 0), rows - 1) * columns + min(max(column, 0), columns - 1))

    def at(self, points: FloatArray) -> FloatArray:
        """Return the clearance (...,) at points (..., 2) [m], interpolated between four nodes."""
        rows, columns = self.clearance.shape
        u = np.clip((points[..., 0] - self.corner[0]) / self.spacing, 0.0, columns - 1.000001)
        v = np.clip((points[..., 1] - self.corner[1]) / self.spacing, 0.0, rows - 1.000001)
        i, j = v.astype(int), u.astype(int)
        fv, fu = v - i, u - j
        c = self.clearance
        low = c[i, j] * (1.0 - fu) + c[i, j + 1] * fu
        high = c[i + 1, j] * (1.0 - fu) + c[i + 1, j + 1] * fu
        between: FloatArray = low * (1.0 - fv) + high * fv
        return between


class RoutePlanner:
    """The best way from one point to every other that a robot can reach from it."""

    def __init__(self, space: FreeSpace, start: Waypoint, *, least: float) -> None:
        """Find them.

        Args:
            space: the clearance.
            start: where all ways begin [m].
            least: clearance of every node of a way [m].
        """
        self.space = space
        self.start = space.node(start)
        self._least = least
        open_ = space.clearance >= least
        self._cost, self._before = dijkstra(
            _graph(space, open_, self._penalty(space.clearance)),
            indices=self.start,
            return_predecessors=True,
        )
        if not open_.flat[self.start]:
            self._cost[self.start] = np.inf

    @property
    def reached(self) -> BoolArray:
        """Which nodes (rows, columns) can be reached."""
        reached: BoolArray = np.isfinite(self._cost).reshape(self.space.clearance.shape)
        return reached

    def cost(self, point: Waypoint) -> float:
        """Return how far it is to a point [m], narrow stretches counting more; inf if unreachable."""
        return float(self._cost[self.space.node(point)])

    def round_trip(self, stops: Sequence[Waypoint]) -> tuple[Waypoint, ...]:
        """Return way-points from the start past all stops and back.

        The stops are taken in the order in which a walk around the tree of best ways meets them, which
        is at most twice as long as that tree. Stops that cannot be reached are left out.
        """
        nodes = [n for n in map(self.space.node, stops) if np.isfinite(self._cost[n])]
        order = self._walk([n for n in nodes if n != self.start])
        trip = [self.start, *order, self.start]
        line = [self.space.points(np.array([self.start]))[0]]
        for a, b in pairwise(trip):
            line.extend(self._straightened(self._between(a, b))[1:])
        return tuple((round(float(x), 3), round(float(y), 3)) for x, y in line)

    def bounded_trip(self, stops: Sequence[Waypoint], limit: float) -> tuple[Waypoint, ...]:
        """Return a round trip past the nearest stops, as many as its length's limit [m] allows."""
        near_first = sorted(stops, key=self.cost)
        trip = self.round_trip(near_first)
        few, many = min(1, len(stops)), len(stops)
        if length(trip) <= limit:
            return trip
        while many - few > 1:
            middle = (few + many) // 2
            if length(self.round_trip(near_first[:middle])) <= limit:
                few = middle
            else:
                many = middle
        return self.round_trip(near_first[:few])

    def _penalty(self, clearance: FloatArray) -> FloatArray:
        """Return how much longer a metre counts, for its clearance [m]."""
        tight = np.clip((COMFORT - clearance) / (COMFORT - self._least), 0.0, None)
        penalty: FloatArray = 1.0 + (_NARROWNESS - 1.0) * tight**2
        return penalty

    def _chain(self, node: int) -> list[int]:
        """The nodes from one back to the start."""
        chain = [node]
        while chain[-1] != self.start:
            chain.append(int(self._before[chain[-1]]))
        return chain

    def _walk(self, stops: Sequence[int]) -> list[int]:
        """Order stops as a depth-first walk around their tree meets them, short branches first."""
        children: dict[int, list[int]] = {}
        deepest: dict[int, float] = {}
        for stop in stops:
            chain = self._chain(stop)
            for child, parent in pairwise(chain):
                if child not in (known := children.setdefault(parent, [])):
                    known.append(child)
            for node in chain:
                deepest[node] = max(deepest.get(node, 0.0), float(self._cost[stop]))
        wanted = set(stops)
        order: list[int] = []
        stack = [self.start]
        while stack:
            node = stack.pop()
            if node in wanted:
                order.append(node)
            ways_on = sorted(children.get(node, ()), key=lambda n: (-deepest[n], n))
            stack.extend(ways_on)
        return order

    def _between(self, a: int, b: int) -> FloatArray:
        """The points (N, 2) of the way along the tree from one node to another [m]."""
        up, down = self._chain(a), self._chain(b)
        shared = 0
        while shared < min(len(up), len(down)) and up[-1 - shared] == down[-1 - shared]:
            shared += 1
        nodes = up[: len(up) - shared + 1] + down[: len(down) - shared][::-1]
        return self.space.points(np.array(nodes))

    def _straightened(self, path: FloatArray) -> FloatArray:
        """Return few of a path's points (N, 2) such that the straight legs between are no worse."""
        steps = np.diff(path, axis=0)
        turns = np.abs(np.diff(steps, axis=0)).max(axis=1) > 1e-9
        corners = path[np.concatenate([[True], turns, [True]])] if len(path) > 2 else path
        n = len(corners)
        best = np.full(n, np.inf)
        best[0] = 0.0
        before = np.zeros(n, dtype=int)
        for j in range(1, n):
            first = max(0, j - _REACH)
            total = best[first:j] + _BEND + self._leg_costs(corners[first:j], corners[j])
            # A grid step is always allowed, though between its nodes it may be a hair too narrow.
            if not np.isfinite(total[-1]):
                total[-1] = best[j - 1] + _BEND + np.linalg.norm(corners[j] - corners[j - 1]) * 9.0
            k = int(np.argmin(total))
            best[j], before[j] = total[k], first + k
        kept = [n - 1]
        while kept[-1] != 0:
            kept.append(int(before[kept[-1]]))
        return corners[kept[::-1]]

    def _leg_costs(self, starts: FloatArray, end: FloatArray) -> FloatArray:
        """Return the weighted lengths (N,) of straight legs from starts (N, 2) to an end (2,)."""
        lengths = np.linalg.norm(end - starts, axis=1)
        count = max(3, math.ceil(float(lengths.max()) / 0.05))
        share = (np.arange(count) + 0.5) / count
        samples = starts[:, None, :] + share[:, None] * (end - starts)[:, None, :]
        clearance = self.space.at(samples)
        costs = np.asarray(lengths * self._penalty(clearance).mean(axis=1), dtype=float)
        costs[clearance.min(axis=1) < self._least - 0.01] = np.inf
        return costs


def _graph(space: FreeSpace, open_: BoolArray, penalty: FloatArray) -> csr_array:
    """Return the costs of the steps between neighbouring open nodes, eight ways each."""
    weight = np.where(open_, penalty, 0.0)
    number = np.arange(open_.size).reshape(open_.shape)
    tails, heads, costs = [], [], []
    whole, ahead, behind = slice(None), slice(1, None), slice(None, -1)
    for (here, there), step in (
        (((whole, behind), (whole, ahead)), 1.0),
        (((behind, whole), (ahead, whole)), 1.0),
        (((behind, behind), (ahead, ahead)), math.sqrt(2.0)),
        (((behind, ahead), (ahead, behind)), math.sqrt(2.0)),
    ):
        both = open_[here] & open_[there]
        tails.append(number[here][both])
        heads.append(number[there][both])
        costs.append(0.5 * step * space.spacing * (weight[here] + weight[there])[both])
    tail, head, cost = (np.concatenate(parts) for parts in (tails, heads, costs))
    size = open_.size
    return csr_array(
        (
            np.concatenate([cost, cost]),
            (np.concatenate([tail, head]), np.concatenate([head, tail])),
        ),
        shape=(size, size),
    )


def length(line: Sequence[Waypoint]) -> float:
    """Return the length of a polyline [m]."""
    points = np.array(line, dtype=float).reshape(-1, 2)
    return float(np.hypot(*np.diff(points, axis=0).T).sum())
