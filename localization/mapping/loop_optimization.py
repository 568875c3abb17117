"""Alternating search for loop closures and optimisation of the pose graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.gyro_heading import GyroFactors
from localization.mapping.loop_closure import LoopCloser
from localization.mapping.loop_closure_types import Closure, ClosureConfig, RejectedClosures
from localization.mapping.planar_pose import between
from localization.mapping.pose_graph import Edge, SolvedGraph, solved_graph, solved_heights
from localization.types import Pose

Progress = Callable[[float, str], None]
"""Function that is called with the fraction done, in [0, 1], and a line of text."""


@dataclass(frozen=True, slots=True, eq=False)
class OptimizedLoops:
    """Poses of the key frames after loop closure."""

    poses: FloatArray
    """Planar poses (K, 3)."""
    heights: FloatArray
    """Heights (K,) [m]."""
    closures: tuple[Closure, ...]
    """The accepted closures."""
    rejected_closures: RejectedClosures
    """Numbers of rejected candidates in the last search."""
    graph: SolvedGraph | None
    """The solved pose graph, whose edges are the odometry's and then the closures; None without closures."""


def close_loops(
    sweeps: Sequence[FlatSweep],
    odometry: FloatArray,
    heights: FloatArray,
    covariances: Sequence[FloatArray],
    config: ClosureConfig = ClosureConfig(),  # noqa: B008
    patches: Sequence[FlatSweep] | None = None,
    *,
    gyro: GyroFactors | None = None,
    passes: int = 4,
    progress: Progress = lambda share, text: None,
) -> OptimizedLoops:
    """Find loops among key frames and distribute their corrections over the drive.

    Args:
        sweeps: Sweep of each key frame.
        odometry: Planar poses (K, 3) by odometry.
        heights: Heights (K,) by odometry [m].
        covariances: Covariance (3, 3) of each key frame but the first relative to the one before, in its own
            axes.
        config: Settings of the loop closure.
        patches: Points seen from each key frame until the next, in its axes; None for its sweep only.
        gyro: Turns between the key frames by a gyro, if there was one.
        passes: Number of searches at most; closed loops make others easier to find.
        progress: Called with the fraction done and a line of text.
    """
    held = odometry if gyro is None else odometry_graph(odometry, covariances, gyro).poses
    best = (held, heights)
    graph: SolvedGraph | None = None
    closer = LoopCloser(sweeps, distances_driven(odometry), config, patches)
    closures, rejected_closures = list[Closure](), RejectedClosures()
    for i in range(passes):
        progress(i / passes, f"closing loops, {len(closures)} so far")
        before = len(closures)

        def searched(share: float, done: int = i, known: int = before) -> None:
            progress((done + share) / passes, f"closing loops, {known} so far")

        closures, rejected_closures = closer.find(best[0], closures, searched)
        if not closures:
            break
        graph, raised_by = _closed(best[0], (odometry, heights), covariances, closures, gyro)
        best = (graph.poses, raised_by)
        if i and len(closures) <= before:
            break
    return OptimizedLoops(*best, tuple(closures), rejected_closures, graph)


def distances_driven(poses: FloatArray) -> FloatArray:
    """Return the distances driven (K,) [m] up to each of planar poses (K, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])


def odometry_graph(
    odometry: FloatArray, covariances: Sequence[FloatArray], gyro: GyroFactors | None = None
) -> SolvedGraph:
    """Return the graph of a drive without closures; arguments as for ``close_loops``."""
    return solved_graph(odometry, _odometry_edges(odometry, covariances, gyro), gyro)


def _odometry_edges(
    poses: FloatArray, covariances: Sequence[FloatArray], gyro: GyroFactors | None
) -> list[Edge]:
    """Return the edges between successive key frames; where the gyro has a say in the heading, theirs is weaker."""
    looser = np.zeros(len(poses))
    if gyro is not None:
        looser[gyro.source] = gyro.config.others**2
    return [
        Edge(
            k + 1,
            k,
            between(poses[k], poses[k + 1]),
            covariance + np.diag([0.0, 0.0, looser[k + 1]]),
        )
        for k, covariance in enumerate(covariances)
    ]


_CLIMB = 0.01
"""Error of the odometry's height from one key frame to the next, one sigma [m]."""
_SAME_GROUND = 0.03
"""Difference of the ground's height between two visits to the same place, one sigma [m]."""
_SLOPE = 0.03
"""Addition to that difference, as a fraction of the distance between the two poses."""


def _closed(
    start: FloatArray,
    odometry: tuple[FloatArray, FloatArray],
    covariances: Sequence[FloatArray],
    closures: Sequence[Closure],
    gyro: GyroFactors | None,
) -> tuple[SolvedGraph, FloatArray]:
    """Return the planar graph and the heights (K,) that agree best with odometry and closures.

    Args:
        start: Initial planar poses (K, 3).
        odometry: Planar poses (K, 3) and heights (K,) by odometry.
        covariances: Covariance (3, 3) of each key frame relative to the one before, in its own axes.
        closures: The accepted closures.
        gyro: Turns by a gyro.
    """
    poses, heights = odometry
    edges = _odometry_edges(poses, covariances, gyro)
    edges += [Edge(k.later, k.earlier, k.motion, k.covariance, uncertain=True) for k in closures]
    graph = solved_graph(start, edges, gyro)
    apart = np.array([float(np.hypot(k.motion[0], k.motion[1])) for k in closures])
    # A closure that the plane rejects says nothing about heights.
    doubt = 1.0 / np.maximum(graph.weights[len(covariances) :], 1e-4)
    heights = solved_heights(
        heights,
        np.array([e.source for e in edges]),
        np.array([e.target for e in edges]),
        np.concatenate([np.diff(heights), np.zeros(len(closures))]),
        np.concatenate(
            [np.full(len(covariances), _CLIMB), (_SAME_GROUND + _SLOPE * apart) * np.sqrt(doubt)]
        ),
    )
    return graph, heights


def raised(pose: FloatArray, height: float) -> Pose:
    """Return a planar pose (3,) at a height [m]."""
    x, y, yaw = pose.tolist()
    return Pose.from_euler([x, y, height], yaw=yaw)
