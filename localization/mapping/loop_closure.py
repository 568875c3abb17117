"""Loop closure: the drift of odometry between two visits to the same place.

A closure is accepted only if the sweep lies well on the earlier submap, if no other pose within the possible
drift explains it about as well, and if other closures nearby are consistent with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from localization.geometry import FloatArray, wrap_angle
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.loop_closure_types import (
    Closure,
    ClosureConfig,
    RejectedClosures,
    Rejection,
)
from localization.mapping.planar_pose import between, compose
from localization.mapping.submap import Alignment, Submap, unambiguous


class LoopCloser:
    """Finds closures among key frames, and caches their submaps."""

    def __init__(
        self,
        sweeps: Sequence[FlatSweep],
        way: FloatArray,
        config: ClosureConfig = ClosureConfig(),  # noqa: B008  (frozen)
        patches: Sequence[FlatSweep] | None = None,
    ) -> None:
        """Begin with key frames.

        Args:
            sweeps: Sweep of each key frame.
            way: Distance driven (K,) up to each [m].
            config: All settings.
            patches: Points for the submaps, in each key frame's axes; by default the sweeps.
        """
        self.config = config
        self._sweeps, self._way = list(sweeps), way
        self._patches = self._sweeps if patches is None else list(patches)
        self._submaps: dict[int, Submap] = {}

    def find(
        self, poses: FloatArray, known: Sequence[Closure] = ()
    ) -> tuple[list[Closure], RejectedClosures]:
        """Return the accepted closures, and the numbers of rejected candidates.

        Args:
            poses: Present planar poses of the key frames (K, 3).
            known: Closures on which these poses rest; they limit the possible drift.
        """
        c = self.config
        gap = self._graph_distances(known)
        found: list[Closure] = []
        rejected: Counter[Rejection] = Counter()
        for later, earlier in self._candidates(poses, gap):
            closure = self.close(later, earlier, poses, float(gap[later, earlier]))
            if isinstance(closure, Rejection):
                rejected[closure] += 1
            else:
                found.append(closure)
        believed = [k for k in found if self._supported(k, found, poses) >= c.min_supporters]
        return believed, RejectedClosures(
            rejected[Rejection.UNEXPLAINED],
            rejected[Rejection.AMBIGUOUS],
            rejected[Rejection.IMPOSSIBLE],
            unsupported=len(found) - len(believed),
        )

    def close(self, later: int, earlier: int, poses: FloatArray, way: float) -> Closure | Rejection:
        """Return the closure of two key frames, or the reason for rejecting it.

        Args:
            later: Number of the key frame whose sweep is aligned.
            earlier: Number of the key frame whose submap it is aligned with.
            poses: Present planar poses of the key frames (K, 3).
            way: Distance along which drift has accumulated [m].
        """
        c = self.config
        prior = between(poses[earlier], poses[later])
        sigma, sigma_yaw = self._sigma(way)
        covariance = np.diag(np.square([sigma, sigma, sigma_yaw]))
        submap, sweep = self._submap(earlier, poses), self._sweeps[later]
        searched = sigma > c.search_beyond
        if searched:
            half_yaw = min(np.pi, 3.0 * sigma_yaw)
            places = submap.search(sweep, prior, min(3.0 * sigma, c.max_window), half_yaw)
            if not places or places[0].inlier_ratio < c.min_inlier_ratio:
                return Rejection.UNEXPLAINED
            if not unambiguous(places):
                return Rejection.AMBIGUOUS
            found = submap.align(sweep, places[0].pose, np.diag(np.square([0.1, 0.1, 0.05])))
        else:
            found = submap.align(sweep, prior, covariance)
        if found.inlier_ratio < c.min_inlier_ratio:
            return Rejection.UNEXPLAINED
        departure = found.pose - prior
        departure[2] = wrap_angle(float(departure[2]))
        if departure @ np.linalg.solve(covariance, departure) > c.gate:
            return Rejection.IMPOSSIBLE
        return Closure(
            later, earlier, found.pose, _covariance(found, c.floor), found.inlier_ratio, searched
        )

    def _sigma(self, way: float) -> tuple[float, float]:
        """Return the possible drift over a distance [m], one sigma [m, rad]."""
        c = self.config
        return c.floor[0] + c.drift * way, c.floor[1] + c.drift_yaw * way

    def _graph_distances(self, known: Sequence[Closure]) -> FloatArray:
        """Return the distances (K, K) between key frames [m], along the drive and along closures."""
        n = len(self._way)
        rows = [*range(n - 1), *(k.later for k in known)]
        columns = [*range(1, n), *(k.earlier for k in known)]
        # In a sparse graph a length of zero would mean no edge.
        lengths = [*np.maximum(np.diff(self._way), 1e-3), *([0.2] * len(known))]
        graph = csr_array((lengths, (rows, columns)), shape=(n, n))
        shortest: FloatArray = dijkstra(graph, directed=False)
        return shortest

    def _candidates(self, poses: FloatArray, gap: FloatArray) -> list[tuple[int, int]]:
        c = self.config
        pairs = []
        for later in range(len(poses)):
            earlier = np.flatnonzero(self._way[later] - self._way[:later] > c.min_distance)
            if not len(earlier):
                continue
            distance = np.hypot(*(poses[earlier, :2] - poses[later, :2]).T)
            sigma = c.floor[0] + c.drift * gap[later, earlier]
            open_ = 3.0 * sigma < c.max_window
            near = earlier[open_ & (distance < c.reach + sigma)]
            order = near[
                np.argsort(np.hypot(*(poses[near, :2] - poses[later, :2]).T), kind="stable")
            ]
            chosen: list[int] = []
            for k in order.tolist():
                # Neighbouring key frames have nearly the same submap.
                if all(abs(self._way[k] - self._way[other]) > 1.0 for other in chosen):
                    chosen.append(k)
                if len(chosen) == c.candidates_per_key:
                    break
            wide = [self._sigma(float(gap[later, k]))[0] > c.search_beyond for k in chosen]
            pairs += [(later, k) for k, w in zip(chosen, wide, strict=True) if not w]
            if any(wide) and later % c.search_every == 0:
                pairs.append((later, chosen[wide.index(True)]))
        return pairs

    def _submap(self, index: int, poses: FloatArray) -> Submap:
        # A submap covers so short a distance that closing loops does not change it: it is built once.
        if index not in self._submaps:
            near = np.flatnonzero(
                np.abs(self._way - self._way[index]) <= self.config.submap_distance
            )
            parts = [self._patches[k].moved(between(poses[index], poses[k])) for k in near.tolist()]
            self._submaps[index] = Submap.of(parts, self.config.submap)
        return self._submaps[index]

    def _supported(self, one: Closure, found: Sequence[Closure], poses: FloatArray) -> int:
        """Return the number of consistent closures nearby (pairwise consistency, Mangelson et al. 2018)."""
        c = self.config
        min_supporters = 0
        for other in found:
            if other is one or other.later == one.later:
                continue
            apart = abs(
                self._way[[one.later, one.earlier]] - self._way[[other.later, other.earlier]]
            )
            if apart.max() > c.support_distance:
                continue
            # The cycle earlier, later, other's later, other's earlier, earlier must be the identity.
            round_ = compose(one.motion, between(poses[one.later], poses[other.later]))
            direct = compose(between(poses[one.earlier], poses[other.earlier]), other.motion)
            off = between(direct, round_)
            way = float(apart.sum())
            sigma, sigma_yaw = self._sigma(way)
            if np.square(off / [sigma, sigma, sigma_yaw]).sum() < 2.0 * c.gate:
                min_supporters += 1
        return min_supporters


def _covariance(found: Alignment, floor: tuple[float, float]) -> FloatArray:
    """Return the covariance (3, 3) in the axes of the aligned sweep's robot."""
    turn = np.eye(3)
    c, s = np.cos(found.pose[2]), np.sin(found.pose[2])
    turn[:2, :2] = [[c, s], [-s, c]]
    information = turn @ found.information @ turn.T + 1e-2 * np.eye(3)
    # Deformation of the submap itself; the floor of the drift is four times as wide for safety.
    least = np.diag(np.square([0.25 * floor[0], 0.25 * floor[0], 0.25 * floor[1]]))
    covariance: FloatArray = np.linalg.inv(information) + least
    return covariance
