"""Alternating search for loop closures and optimisation of the pose graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.loop_closure import LoopCloser
from localization.mapping.loop_closure_types import Closure, ClosureConfig, RejectedClosures
from localization.mapping.planar_pose import between
from localization.mapping.pose_graph import Edge, optimized_poses
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


def close_loops(
    sweeps: Sequence[FlatSweep],
    odometry: FloatArray,
    heights: FloatArray,
    covariances: Sequence[FloatArray],
    config: ClosureConfig = ClosureConfig(),  # noqa: B008
    patches: Sequence[FlatSweep] | None = None,
    *,
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
        passes: Number of searches at most; closed loops make others easier to find.
        progress: Called with the fraction done and a line of text.

    Raises:
        ImportError: If Open3D is missing.
    """
    known = best = (odometry, heights)
    closer = LoopCloser(sweeps, distances_driven(odometry), config, patches)
    closures, rejected_closures = list[Closure](), RejectedClosures()
    for i in range(passes):
        progress(i / passes, f"closing loops, {len(closures)} so far")
        before = len(closures)
        closures, rejected_closures = closer.find(best[0], closures)
        if not closures:
            break
        best = _closed(best, known, covariances, closures)
        if i and len(closures) <= before:
            break
    return OptimizedLoops(*best, tuple(closures), rejected_closures)


def distances_driven(poses: FloatArray) -> FloatArray:
    """Return the distances driven (K,) [m] up to each of planar poses (K, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])


_TILT = 1e-3
"""Sigma of roll and pitch [rad], which holds them: they are known from gravity, and the graph optimises x, y, z
and yaw."""
_CLIMB = 0.01
"""Error of the odometry's height from one key frame to the next, one sigma [m]."""
_SAME_GROUND = 0.03
"""Difference of the ground's height between two visits to the same place, one sigma [m]."""
_SLOPE = 0.03
"""Addition to that difference, as a fraction of the distance between the two poses."""


def _closed(
    start: tuple[FloatArray, FloatArray],
    odometry: tuple[FloatArray, FloatArray],
    covariances: Sequence[FloatArray],
    closures: Sequence[Closure],
) -> tuple[FloatArray, FloatArray]:
    """Return planar poses (K, 3) and heights (K,) that agree best with odometry and closures.

    Args:
        start: Initial planar poses (K, 3) and heights (K,).
        odometry: Planar poses (K, 3) and heights (K,) by odometry.
        covariances: Covariance (3, 3) of each key frame relative to the one before, in its own axes.
        closures: The accepted closures.
    """
    poses, heights = odometry
    edges = [
        Edge(
            k + 1,
            k,
            raised(between(poses[k], poses[k + 1]), float(heights[k + 1] - heights[k])),
            _spatial(covariance, _CLIMB),
        )
        for k, covariance in enumerate(covariances)
    ]
    for closure in closures:
        apart = float(np.hypot(closure.motion[0], closure.motion[1]))
        edges.append(
            Edge(
                closure.later,
                closure.earlier,
                raised(closure.motion, 0.0),
                _spatial(closure.covariance, _SAME_GROUND + _SLOPE * apart),
                uncertain=True,
            )
        )
    nodes = [raised(pose, float(z)) for pose, z in zip(*start, strict=True)]
    best = optimized_poses(nodes, edges)
    closed = np.array([[*p.position[:2], p.yaw] for p in best])
    return closed, np.array([float(p.position[2]) for p in best])


def raised(pose: FloatArray, height: float) -> Pose:
    """Return a planar pose (3,) at a height [m]."""
    x, y, yaw = pose.tolist()
    return Pose.from_euler([x, y, height], yaw=yaw)


def _spatial(planar: FloatArray, climb: float) -> FloatArray:
    """Return the covariance (6, 6) for a planar one (3, 3) and the sigma of the height [m]."""
    covariance = np.diag(np.square([1.0, 1.0, climb, _TILT, _TILT, 1.0]))
    chosen = [0, 1, 5]
    covariance[np.ix_(chosen, chosen)] = planar
    return covariance
