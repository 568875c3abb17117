"""Closing loops: when the robot comes by where it has been, how far has odometry strayed?

A closure is believed only if the sweep lies well on the earlier floor plan, if no other place of the
window that drift allows explains it about as well, and if other closures nearby tell the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from localization.geometry import FloatArray, wrap_angle
from localization.mapping.submap import (
    Alignment,
    FlatSweep,
    Submap,
    SubmapConfig,
    between,
    compose,
    unambiguous,
)


@dataclass(frozen=True, slots=True)
class ClosureConfig:
    """Where closures are looked for, and which are believed."""

    submap: SubmapConfig = field(default_factory=SubmapConfig)
    submap_way: float = 1.5
    """A floor plan holds the sweeps of so much way before and after [m]."""
    least_way: float = 5.0
    """Way that must lie between two visits [m]."""
    reach: float = 2.0
    """Visits farther apart than this see too little alike [m]."""
    drift: float = 0.01
    """Of odometry, one sigma, as a share of the way: the best that KISS-ICP is known for is half that."""
    drift_yaw: float = np.deg2rad(0.1)
    """[rad/m]."""
    floor: tuple[float, float] = (0.02, np.deg2rad(0.5))
    """Added to drift: what two floor plans differ by anyway [m, rad]."""
    search_beyond: float = 0.10
    """Where drift may be more than this [m], the window is searched; within, aligning finds the place."""
    search_every: int = 3
    """Of key frames that must be searched for, this one is, with its nearest visit only: windows cost
    hundreds of times what aligning does, and once a loop is closed its neighbours need none."""
    largest_window: float = 4.0
    """Half width of a search at most [m]: where drift may be more, nothing is closed."""
    per_visit: int = 4
    """Earlier visits that each key frame is compared with."""
    least_fit: float = 0.65
    """Share of a sweep that must lie on the floor plan."""
    gate: float = 16.3
    """Squared, normalised departure from what drift allows (chi-square of 3, 99.9 %)."""
    supporters: int = 2
    """Closures nearby that must tell the same before one is believed."""
    support_way: float = 4.0
    """How near these must be on either visit [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """Key frame ``later`` as it was seen from ``earlier``."""

    later: int
    earlier: int
    motion: FloatArray
    """(3,) planar pose of the later in the earlier."""
    covariance: FloatArray
    """(3, 3) of x, y (the later's axes) and yaw."""
    fit: float
    searched: bool
    """Whether a window was searched."""


@dataclass(frozen=True, slots=True)
class Refusals:
    """How many candidates were not believed, and why."""

    unexplained: int = 0
    """The sweep did not lie on the floor plan anywhere."""
    ambiguous: int = 0
    """Several places explain it alike."""
    impossible: int = 0
    """It lies where drift cannot have led."""
    alone: int = 0
    """No closure nearby tells the same."""


class LoopCloser:
    """Looks for closures among key frames; holds their floor plans."""

    def __init__(
        self,
        sweeps: Sequence[FlatSweep],
        way: FloatArray,
        config: ClosureConfig = ClosureConfig(),
        patches: Sequence[FlatSweep] | None = None,
    ) -> None:
        """Take key frames.

        Args:
            sweeps: of each.
            way: since the start (K,) [m].
            config: all settings.
            patches: what floor plans are made of, as seen from each; their sweeps unless given.
        """
        self.config = config
        self._sweeps, self._way = list(sweeps), way
        self._patches = self._sweeps if patches is None else list(patches)
        self._submaps: dict[int, Submap] = {}

    def find(
        self, poses: FloatArray, known: Sequence[Closure] = ()
    ) -> tuple[list[Closure], Refusals]:
        """Return the closures that are believed, given planar poses (K, 3), and what was refused.

        Args:
            poses: of the key frames, as they are known now.
            known: closures that these poses rest on; drift counts from them.
        """
        c = self.config
        gap = self._graph_way(known)
        found: list[Closure] = []
        counts = {"unexplained": 0, "ambiguous": 0, "impossible": 0}
        for later, earlier in self._candidates(poses, gap):
            closure = self.close(later, earlier, poses, float(gap[later, earlier]))
            if isinstance(closure, str):
                counts[closure] += 1
            else:
                found.append(closure)
        believed = [k for k in found if self._supported(k, found, poses) >= c.supporters]
        return believed, Refusals(**counts, alone=len(found) - len(believed))

    def close(self, later: int, earlier: int, poses: FloatArray, way: float) -> Closure | str:
        """Try one closure; return it, or the name of the count of ``Refusals`` that it belongs to.

        Args:
            later: key frame whose sweep is laid over
            earlier: key frame's floor plan.
            poses: (K, 3) planar poses as they are known now.
            way: along which drift has added up [m].
        """
        c = self.config
        prior = between(poses[earlier], poses[later])
        sigma, sigma_yaw = self._sigma(way)
        covariance = np.diag(np.square([sigma, sigma, sigma_yaw]))
        submap, sweep = self._submap(earlier, poses), self._sweeps[later]
        searched = sigma > c.search_beyond
        if searched:
            half_yaw = min(np.pi, 3.0 * sigma_yaw)
            places = submap.search(sweep, prior, min(3.0 * sigma, c.largest_window), half_yaw)
            if not places or places[0].fit < c.least_fit:
                return "unexplained"
            if not unambiguous(places):
                return "ambiguous"
            found = submap.align(sweep, places[0].pose, np.diag(np.square([0.1, 0.1, 0.05])))
        else:
            found = submap.align(sweep, prior, covariance)
        if found.fit < c.least_fit:
            return "unexplained"
        departure = found.pose - prior
        departure[2] = wrap_angle(float(departure[2]))
        if departure @ np.linalg.solve(covariance, departure) > c.gate:
            return "impossible"
        return Closure(later, earlier, found.pose, _covariance(found, c.floor), found.fit, searched)

    def _sigma(self, way: float) -> tuple[float, float]:
        """Return what drift may come to over so much way, one sigma [m, rad]."""
        c = self.config
        return c.floor[0] + c.drift * way, c.floor[1] + c.drift_yaw * way

    def _graph_way(self, known: Sequence[Closure]) -> FloatArray:
        """Return the way (K, K) between key frames, closures taken as short cuts [m]."""
        n = len(self._way)
        rows = [*range(n - 1), *(k.later for k in known)]
        columns = [*range(1, n), *(k.earlier for k in known)]
        # A sparse graph takes nothing for no edge.
        lengths = [*np.maximum(np.diff(self._way), 1e-3), *([0.2] * len(known))]
        graph = csr_array((lengths, (rows, columns)), shape=(n, n))
        shortest: FloatArray = dijkstra(graph, directed=False)
        return shortest

    def _candidates(self, poses: FloatArray, gap: FloatArray) -> list[tuple[int, int]]:
        c = self.config
        pairs = []
        for later in range(len(poses)):
            earlier = np.flatnonzero(self._way[later] - self._way[:later] > c.least_way)
            if not len(earlier):
                continue
            distance = np.hypot(*(poses[earlier, :2] - poses[later, :2]).T)
            sigma = c.floor[0] + c.drift * gap[later, earlier]
            open_ = 3.0 * sigma < c.largest_window
            near = earlier[open_ & (distance < c.reach + sigma)]
            order = near[
                np.argsort(np.hypot(*(poses[near, :2] - poses[later, :2]).T), kind="stable")
            ]
            chosen: list[int] = []
            for k in order.tolist():
                # Neighbours' floor plans are nearly the same.
                if all(abs(self._way[k] - self._way[other]) > 1.0 for other in chosen):
                    chosen.append(k)
                if len(chosen) == c.per_visit:
                    break
            wide = [self._sigma(float(gap[later, k]))[0] > c.search_beyond for k in chosen]
            pairs += [(later, k) for k, w in zip(chosen, wide, strict=True) if not w]
            if any(wide) and later % c.search_every == 0:
                pairs.append((later, chosen[wide.index(True)]))
        return pairs

    def _submap(self, index: int, poses: FloatArray) -> Submap:
        # A floor plan is of a stretch of way so short that loops do not bend it: once is enough.
        if index not in self._submaps:
            near = np.flatnonzero(np.abs(self._way - self._way[index]) <= self.config.submap_way)
            parts = [self._patches[k].moved(between(poses[index], poses[k])) for k in near.tolist()]
            self._submaps[index] = Submap.of(parts, self.config.submap)
        return self._submaps[index]

    def _supported(self, one: Closure, found: Sequence[Closure], poses: FloatArray) -> int:
        """Return how many others nearby tell the same (pairwise consistency, Mangelson et al. 2018)."""
        c = self.config
        supporters = 0
        for other in found:
            if other is one or other.later == one.later:
                continue
            apart = abs(
                self._way[[one.later, one.earlier]] - self._way[[other.later, other.earlier]]
            )
            if apart.max() > c.support_way:
                continue
            # earlier -> later -> other's later -> other's earlier -> earlier again: nothing moved.
            round_ = compose(one.motion, between(poses[one.later], poses[other.later]))
            direct = compose(between(poses[one.earlier], poses[other.earlier]), other.motion)
            off = between(direct, round_)
            way = float(apart.sum())
            sigma, sigma_yaw = self._sigma(way)
            if np.square(off / [sigma, sigma, sigma_yaw]).sum() < 2.0 * c.gate:
                supporters += 1
        return supporters


def _covariance(found: Alignment, floor: tuple[float, float]) -> FloatArray:
    """Return the covariance (3, 3) in the axes of the aligned sweep's robot."""
    turn = np.eye(3)
    c, s = np.cos(found.pose[2]), np.sin(found.pose[2])
    turn[:2, :2] = [[c, s], [-s, c]]
    information = turn @ found.information @ turn.T + 1e-2 * np.eye(3)
    # What the floor plan is bent by itself; drift's floor is four times as wide, to be on the safe side.
    least = np.diag(np.square([0.25 * floor[0], 0.25 * floor[0], 0.25 * floor[1]]))
    covariance: FloatArray = np.linalg.inv(information) + least
    return covariance
