"""Route planning on a clearance grid: shortest paths that keep to the middle, and round trips.

Path length counts more where it is narrow, so that a path keeps to the middle of doors and
corridors without knowing of either. Passages in which the robot cannot turn are passed in a straight leg.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.floorplan.plan import Waypoint
from robot_sim.layout.clearance_grid import ClearanceGrid
from robot_sim.layout.narrow_passages import narrow_legs
from robot_sim.robot.skid_steer_parameters import SkidSteer

COMFORT: Final = 0.9
"""Clearance of the robot's centre beyond which more has no advantage [m]."""
TOUR_LIMIT: Final = 240.0
"""Longest tour [m], which can be driven within the ten minutes of a mission."""
MARGIN: Final = 0.08
"""Clearance kept along all routes beyond what the robot covers: the circle in which it turns, or its width in
a straight passage [m]."""
_NARROWNESS: Final = 4.0
"""Factor by which the length counts more where it is as narrow as allowed."""
_BEND: Final = 0.1
"""Length that one more way-point must save [m]."""
_REACH: Final = 48
"""Number of bends of a grid path that one straight leg may skip."""


def turning_clearance(robot: SkidSteer) -> float:
    """Return the clearance that a robot needs where it turns [m]."""
    return robot.swing_radius + MARGIN


def straight_clearance(robot: SkidSteer) -> float:
    """Return the clearance that a robot needs straight ahead [m]."""
    return robot.half_width + MARGIN


class RoutePlanner:
    """Shortest paths from one point to all that a robot can reach from it."""

    def __init__(
        self,
        space: ClearanceGrid,
        start: Waypoint,
        *,
        least: float,
        straight: float | None = None,
        fine: ClearanceGrid | None = None,
    ) -> None:
        """Compute all paths from a point.

        Args:
            space: Clearance of the nodes.
            start: Point at which all paths begin [m].
            least: Least clearance of every node of a path [m]: the robot may turn there.
            straight: Least clearance along straight legs between nodes [m]; that of nodes by default.
            fine: Clearance at closer nodes, for legs through narrow passages; ``space`` by default.
        """
        self.space = space
        self.start = space.node(start)
        self._least = least
        self._straight = least if straight is None else straight
        self._fine = fine or space
        open_ = space.clearance >= least
        graph = grid_graph(space, open_, self._penalty(space.clearance))
        if self._straight < least:
            graph = graph + self._passages(open_)
        self._graph, self._open = graph, open_
        self._search()

    def _search(self) -> None:
        self._cost, self._before = dijkstra(
            self._graph,
            indices=self.start,
            return_predecessors=True,
        )
        if not self._open.flat[self.start]:
            self._cost[self.start] = np.inf

    def begun_at(self, start: Waypoint) -> RoutePlanner:
        """Return the paths from another point, in a fraction of the time."""
        other = copy.copy(self)
        other.start = self.space.node(start)
        other._search()
        return other

    @property
    def reached(self) -> BoolArray:
        """Which nodes (rows, columns) can be reached."""
        reached: BoolArray = np.isfinite(self._cost).reshape(self.space.clearance.shape)
        return reached

    def cost(self, point: Waypoint) -> float:
        """Return the weighted distance to a point [m]; inf if unreachable."""
        return float(self._cost[self.space.node(point)])

    def way(self, end: Waypoint) -> tuple[Waypoint, ...]:
        """Return few way-points from the start to a point that can be reached, both included."""
        path = self._between(self.start, self.space.node(end))
        line = self._straightened(path) if len(path) > 1 else path
        return tuple((round(float(x), 3), round(float(y), 3)) for x, y in line)

    def round_trip(self, stops: Sequence[Waypoint]) -> tuple[Waypoint, ...]:
        """Return way-points from the start past all stops and back.

        The stops are visited in the order of a depth-first walk around the tree of shortest paths, which
        is at most twice as long as that tree. Unreachable stops are left out.
        """
        nodes = [n for n in map(self.space.node, stops) if np.isfinite(self._cost[n])]
        order = self._walk([n for n in nodes if n != self.start])
        trip = [self.start, *order, self.start]
        line = [self.space.points(np.array([self.start]))[0]]
        for a, b in pairwise(trip):
            line.extend(self._straightened(self._between(a, b))[1:])
        return tuple((round(float(x), 3), round(float(y), 3)) for x, y in line)

    def bounded_trip(self, stops: Sequence[Waypoint], limit: float) -> tuple[Waypoint, ...]:
        """Return a round trip past as many of the nearest stops as ``limit`` [m] allows."""
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

    def _penalty(self, clearance: npt.NDArray[np.floating]) -> FloatArray:
        """Return the factor by which a metre counts more, for its clearance [m]."""
        tight = np.clip((COMFORT - clearance) / (COMFORT - self._least), 0.0, None)
        penalty: FloatArray = 1.0 + (_NARROWNESS - 1.0) * tight**2
        return penalty

    def _passages(self, open_: BoolArray) -> csr_array:
        """Return the costs of straight legs through passages that are too narrow to turn in."""
        legs = narrow_legs(self.space, open_, self._fine, self._straight)
        at = self.space.points
        costs = [
            float(self._leg_costs(at(np.array([a])), at(np.array([b]))[0])[0]) for a, b in legs
        ]
        kept = [(a, b, cost) for (a, b), cost in zip(legs, costs, strict=True) if np.isfinite(cost)]
        tail, head, cost = (np.array(v) for v in zip(*kept, strict=True)) if kept else ([], [], [])
        size = open_.size
        return csr_array(
            (
                np.concatenate([cost, cost]),
                (np.concatenate([tail, head]), np.concatenate([head, tail])),
            ),
            shape=(size, size),
        )

    def _walk(self, stops: Sequence[int]) -> list[int]:
        """Order stops as a depth-first walk around their tree, short branches first."""
        children: dict[int, list[int]] = {}
        deepest: dict[int, float] = {}
        # The farthest first: from a node that is known, all nodes back to the start are.
        for stop in sorted(stops, key=lambda n: (-self._cost[n], n)):
            node = stop
            while node not in deepest:
                deepest[node] = float(self._cost[stop])
                if node == self.start:
                    break
                parent = int(self._before[node])
                children.setdefault(parent, []).append(node)
                node = parent
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
        """Return the points (N, 2) of the path along the tree from one node to another [m]."""
        up, down = [a], [b]
        # The costlier node is not on the way back from the other one.
        while up[-1] != down[-1]:
            way = up if self._cost[up[-1]] >= self._cost[down[-1]] else down
            way.append(int(self._before[way[-1]]))
        nodes = up + down[-2::-1]
        return self.space.points(np.array(nodes))

    def _straightened(self, path: FloatArray) -> FloatArray:
        """Return few of a path's points (N, 2) such that the straight legs between cost no more."""
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
            # A grid step is always allowed, though between its nodes it may be slightly too narrow.
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
        clearance = self._fine.at(samples)
        costs = np.asarray(lengths * self._penalty(clearance).mean(axis=1), dtype=float)
        costs[clearance.min(axis=1) < self._straight - 0.01] = np.inf
        return costs


def grid_graph(space: ClearanceGrid, open_: BoolArray, penalty: FloatArray) -> csr_array:
    """Return the costs of the steps between neighbouring open nodes in eight directions."""
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
