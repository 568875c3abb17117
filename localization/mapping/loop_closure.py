"""Loop closure: the drift of odometry between two visits to the same place.

A closure is accepted only if the sweep lies well on the earlier submap, if no other pose within the possible
drift explains it about as well, and if other closures nearby are consistent with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from localization.geometry import FloatArray, wrap_angle
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.free_space import FreeSpace
from localization.mapping.loop_closure_types import (
    Closure,
    ClosureConfig,
    RejectedClosures,
    Rejection,
)
from localization.mapping.planar_pose import between, compose, moved
from localization.mapping.submap import Alignment, Submap, unambiguous

_SAME_PRIOR = (0.05, np.deg2rad(1.0))
"""A candidate whose prior has moved less than this is not examined again [m, rad]."""


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
        self._submaps: dict[tuple[int, bool], Submap] = {}
        self._spaces: dict[int, tuple[FlatSweep, FreeSpace]] = {}
        self._closed: dict[tuple[int, int], tuple[FloatArray, float, Closure | Rejection]] = {}

    def find(
        self,
        poses: FloatArray,
        known: Sequence[Closure] = (),
        progress: Callable[[float], None] = lambda share: None,
    ) -> tuple[list[Closure], RejectedClosures]:
        """Return the accepted closures, and the numbers of rejected candidates.

        Args:
            poses: Present planar poses of the key frames (K, 3).
            known: Closures on which these poses rest; they limit the possible drift.
            progress: Called with the fraction done.
        """
        drift = self._drift(poses, known)
        found: list[Closure] = []
        rejected: Counter[Rejection] = Counter()
        candidates = self._candidates(poses, drift)
        for i, (later, earlier) in enumerate(candidates):
            if i % 20 == 0:
                progress(i / len(candidates))
            closure = self._closed_again(later, earlier, poses, drift)
            if isinstance(closure, Rejection):
                rejected[closure] += 1
            else:
                found.append(closure)
        believed = self._believed(found, poses)
        return believed, RejectedClosures(
            rejected[Rejection.UNEXPLAINED],
            rejected[Rejection.AMBIGUOUS],
            rejected[Rejection.IMPOSSIBLE],
            rejected[Rejection.CONTRADICTED],
            unsupported=len(found) - len(believed),
        )

    def close(
        self, later: int, earlier: int, poses: FloatArray, way: float, extent: float = 0.0
    ) -> Closure | Rejection:
        """Return the closure of two key frames, or the reason for rejecting it.

        Args:
            later: Number of the key frame whose sweep is aligned.
            earlier: Number of the key frame whose submap it is aligned with.
            poses: Present planar poses of the key frames (K, 3).
            way: Distance along which drift has accumulated [m].
            extent: Distance from the later key frame to the places of that way, rms [m].
        """
        c = self.config
        prior = between(poses[earlier], poses[later])
        sigma, sigma_yaw = self._sigma(way, extent)
        covariance = np.diag(np.square([sigma, sigma, sigma_yaw]))
        wide, searched = sigma > c.wide, sigma > c.search_beyond
        submap, sweep = self._submap(earlier, poses, wide), self._sweeps[later]
        start, spread = prior, covariance
        least = c.min_wide_inlier_ratio if wide else c.min_inlier_ratio
        if searched:
            seen = self._around(later, poses) if wide else sweep
            half_yaw = min(np.pi, 3.0 * sigma_yaw)
            places = submap.search(seen, prior, min(3.0 * sigma, c.max_window), half_yaw)
            if not places or places[0].inlier_ratio < least:
                return Rejection.UNEXPLAINED
            if not unambiguous(places):
                return Rejection.AMBIGUOUS
            start, spread = places[0].pose, np.diag(np.square([0.1, 0.1, 0.05]))
        found = submap.align(sweep, start, spread)
        if found.inlier_ratio < least:
            return Rejection.UNEXPLAINED
        departure = found.pose - prior
        departure[2] = wrap_angle(float(departure[2]))
        if departure @ np.linalg.solve(covariance, departure) > c.gate:
            return Rejection.IMPOSSIBLE
        if searched and self._contradicted(later, earlier, poses, found.pose) > c.max_contradicted:
            return Rejection.CONTRADICTED
        return Closure(
            later, earlier, found.pose, _covariance(found, c.floor), found.inlier_ratio, searched
        )

    def _closed_again(
        self, later: int, earlier: int, poses: FloatArray, drift: tuple[FloatArray, FloatArray]
    ) -> Closure | Rejection:
        """Return what ``close`` returns, from memory if the prior is about that of the last time."""
        prior = between(poses[earlier], poses[later])
        way, extent = float(drift[0][later, earlier]), float(drift[1][later, earlier])
        sigma = self._sigma(way, extent)[0]
        last = self._closed.get((later, earlier))
        if last is not None:
            off = prior - last[0]
            near = float(np.hypot(off[0], off[1])) < _SAME_PRIOR[0] + 0.3 * sigma
            turned = abs(wrap_angle(float(off[2]))) < _SAME_PRIOR[1]
            if near and turned and (isinstance(last[2], Closure) or sigma > 0.5 * last[1]):
                return last[2]
        closure = self.close(later, earlier, poses, way, extent)
        self._closed[later, earlier] = (prior, sigma, closure)
        return closure

    def _sigma(self, way: float, extent: float = 0.0) -> tuple[float, float]:
        """Return the possible drift over a distance [m], one sigma [m, rad]."""
        c = self.config
        yaw = c.floor[1] + c.drift_yaw * way + c.walk_yaw * np.sqrt(way)
        swung = c.walk_yaw * np.sqrt(way) * extent
        far = c.floor[0] + c.drift * way + float(np.hypot(c.walk * np.sqrt(way), swung))
        return far, float(yaw)

    def _drift(self, poses: FloatArray, known: Sequence[Closure]) -> tuple[FloatArray, FloatArray]:
        """Return distances (K, K) between key frames along the drive and along closures [m], and extents (K, K).

        The extent is the rms distance of a later key frame (row) from the places driven since an earlier one.
        """
        n = len(self._way)
        rows = [*range(n - 1), *(k.later for k in known)]
        columns = [*range(1, n), *(k.earlier for k in known)]
        # In a sparse graph a length of zero would mean no edge.
        lengths = [*np.maximum(np.diff(self._way), 1e-3), *([0.2] * len(known))]
        graph = csr_array((lengths, (rows, columns)), shape=(n, n))
        shortest: FloatArray = dijkstra(graph, directed=False)
        places = poses[:, :2]
        sums = np.concatenate([np.zeros((1, 2)), np.cumsum(places, axis=0)])
        squares = np.concatenate([[0.0], np.cumsum(np.square(places).sum(axis=1))])
        index = np.arange(n)
        count = np.maximum(index[:, None] - index[None, :] + 1, 1)
        mean = (sums[1:][:, None, :] - sums[:-1][None, :, :]) / count[:, :, None]
        square = (squares[1:][:, None] - squares[:-1][None, :]) / count
        far = square - 2.0 * np.einsum("jki,ji->jk", mean, places)
        far += np.square(places).sum(axis=1)[:, None]
        extent = np.sqrt(np.maximum(far, 0.0))
        # A way closed in between is shorter, and so is what it can reach.
        return shortest, np.minimum(extent, 0.5 * shortest)

    def _candidates(
        self, poses: FloatArray, drift: tuple[FloatArray, FloatArray]
    ) -> list[tuple[int, int]]:
        c = self.config
        gap, extent = drift
        pairs = []
        for later in range(len(poses)):
            earlier = np.flatnonzero(self._way[later] - self._way[:later] > c.min_distance)
            if not len(earlier):
                continue
            distance = np.hypot(*(poses[earlier, :2] - poses[later, :2]).T)
            sigma = np.array(
                [
                    self._sigma(w, e)[0]
                    for w, e in zip(gap[later, earlier], extent[later, earlier], strict=True)
                ]
            )
            open_ = 3.0 * sigma < c.max_window
            near = np.flatnonzero(open_ & (distance < c.reach + sigma))
            order = near[np.argsort(distance[near], kind="stable")]
            chosen: list[int] = []
            for k in order.tolist():
                # Neighbouring key frames have nearly the same submap.
                here = self._way[earlier[k]]
                if all(abs(here - self._way[earlier[other]]) > 1.0 for other in chosen):
                    chosen.append(k)
                if len(chosen) == c.candidates_per_key:
                    break
            wide = [bool(sigma[k] > c.search_beyond) for k in chosen]
            pairs += [(later, int(earlier[k])) for k, w in zip(chosen, wide, strict=True) if not w]
            if any(wide) and later % c.search_every == 0:
                pairs.append((later, int(earlier[chosen[wide.index(True)]])))
        return pairs

    def _submap(self, index: int, poses: FloatArray, wide: bool = False) -> Submap:
        # A submap covers so short a distance that closing loops does not change it: it is built once.
        if (index, wide) not in self._submaps:
            c = self.config
            reach = c.wide_submap if wide else c.submap_distance
            self._submaps[index, wide] = Submap.of(self._parts(index, poses, reach), c.submap)
        return self._submaps[index, wide]

    def _parts(self, index: int, poses: FloatArray, reach: float) -> list[FlatSweep]:
        """Return what was seen up to a distance [m] before and after a key frame, in its axes."""
        near = np.flatnonzero(np.abs(self._way - self._way[index]) <= reach)
        return [self._patches[k].moved(between(poses[index], poses[k])) for k in near.tolist()]

    def _around(self, index: int, poses: FloatArray) -> FlatSweep:
        """Return the sweeps of the key frames around one as a single sweep in its axes."""
        near = np.flatnonzero(np.abs(self._way - self._way[index]) <= self.config.wide_distance)
        return FlatSweep.joined(
            [self._sweeps[k].moved(between(poses[index], poses[k])) for k in near.tolist()]
        )

    def _contradicted(
        self, later: int, earlier: int, poses: FloatArray, motion: FloatArray
    ) -> float:
        """Return the greater share of either visit's points that lie where the other one saw free space."""
        spaces = []
        for index in (later, earlier):
            if index not in self._spaces:
                around = self._around(index, poses)
                self._spaces[index] = (around, FreeSpace.of(around))
            spaces.append(self._spaces[index])
        (new, new_space), (old, old_space) = spaces
        back = between(motion, np.zeros(3))
        return max(
            old_space.contradicted(moved(motion, new.points)),
            new_space.contradicted(moved(back, old.points)),
        )

    def _believed(self, found: Sequence[Closure], poses: FloatArray) -> list[Closure]:
        """Return the closures with enough consistent ones nearby (pairwise consistency, Mangelson et al. 2018)."""
        c = self.config
        later = self._way[[k.later for k in found]] if found else np.zeros(0)
        earlier = self._way[[k.earlier for k in found]] if found else np.zeros(0)
        believed = []
        for i, one in enumerate(found):
            apart = np.maximum(np.abs(later - later[i]), np.abs(earlier - earlier[i]))
            beside = np.flatnonzero(apart <= c.support_distance)
            others = (found[k] for k in beside.tolist() if found[k].later != one.later)
            agree = (other for other in others if self._consistent(one, other, poses))
            if len(list(islice(agree, c.min_supporters))) >= c.min_supporters:
                believed.append(one)
        return believed

    def _consistent(self, one: Closure, other: Closure, poses: FloatArray) -> bool:
        """Return whether the cycle earlier, later, other's later, other's earlier is the identity."""
        apart = abs(self._way[[one.later, one.earlier]] - self._way[[other.later, other.earlier]])
        round_ = compose(one.motion, between(poses[one.later], poses[other.later]))
        direct = compose(between(poses[one.earlier], poses[other.earlier]), other.motion)
        off = between(direct, round_)
        sigma, sigma_yaw = self._sigma(float(apart.sum()))
        normalized = off / [sigma, sigma, sigma_yaw]
        return float(np.square(normalized).sum()) < 2.0 * self.config.gate


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
