"""Key frames in, loops closed out: closures are looked for, and a pose graph spreads what they tell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.loop_closure import Closure, ClosureConfig, LoopCloser, Refusals
from localization.mapping.pose_graph import Edge, optimised
from localization.mapping.submap import FlatSweep, between
from localization.types import Pose

Progress = Callable[[float, str], None]
"""Called now and then with the share done and a line of text."""


@dataclass(frozen=True, slots=True, eq=False)
class Closed:
    """Key frames after loops were closed."""

    poses: FloatArray
    """(K, 3) planar."""
    heights: FloatArray
    """(K,) [m]."""
    closures: tuple[Closure, ...]
    refusals: Refusals


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
) -> Closed:
    """Find loops among key frames and spread what they tell over the way between.

    Args:
        sweeps: of each key frame.
        odometry: (K, 3) planar poses as odometry has them.
        heights: (K,) the same for height [m].
        covariances: (3, 3) of each key frame but the first, as seen from the one before, in its own axes.
        config: where closures are looked for, and which are believed.
        patches: what else was seen on the way from each key frame to the next, from the key frame;
            None for no more than its sweep.
        passes: loops closed make others easier to find: how often they are looked for at most.
        progress: called with the share done and a line of text.

    Raises:
        ImportError: if Open3D is missing.
    """
    known = best = (odometry, heights)
    closer = LoopCloser(sweeps, way_of(odometry), config, patches)
    closures, refusals = list[Closure](), Refusals()
    for i in range(passes):
        progress(i / passes, f"closing loops, {len(closures)} so far")
        before = len(closures)
        closures, refusals = closer.find(best[0], closures)
        if not closures:
            break
        best = _closed(best, known, covariances, closures)
        if i and len(closures) <= before:
            break
    return Closed(*best, tuple(closures), refusals)


def way_of(poses: FloatArray) -> FloatArray:
    """Return the way since the start (K,) [m] of planar poses (K, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])


_TILT = 1e-3
"""The graph is of x, y, z and yaw: roll and pitch are gravity's, and are held by this [rad]."""
_CLIMB = 0.01
"""Error of the height that odometry adds, one sigma, from one key frame to the next [m]."""
_SAME_GROUND = 0.03
"""The ground where a robot comes by again has the height it had, within this [m] ..."""
_SLOPE = 0.03
"""... and this share of how far apart the two places are."""


def _closed(
    start: tuple[FloatArray, FloatArray],
    odometry: tuple[FloatArray, FloatArray],
    covariances: Sequence[FloatArray],
    closures: Sequence[Closure],
) -> tuple[FloatArray, FloatArray]:
    """Spread what closures found over the way between.

    Args:
        start: planar poses (K, 3) and heights (K,) to begin from.
        odometry: the same as odometry has them.
        covariances: of each key frame as seen from the one before, in its own axes.
        closures: what is believed.

    Returns:
        Planar poses (K, 3) and heights (K,).
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
    best = optimised(nodes, edges)
    closed = np.array([[*p.position[:2], p.yaw] for p in best])
    return closed, np.array([float(p.position[2]) for p in best])


def raised(pose: FloatArray, height: float) -> Pose:
    """Return a planar pose (3,) at a height [m]."""
    x, y, yaw = pose.tolist()
    return Pose.from_euler([x, y, height], yaw=yaw)


def _spatial(planar: FloatArray, climb: float) -> FloatArray:
    """Return the covariance (6, 6) that a planar one (3, 3) and a height's sigma make."""
    covariance = np.diag(np.square([1.0, 1.0, climb, _TILT, _TILT, 1.0]))
    chosen = [0, 1, 5]
    covariance[np.ix_(chosen, chosen)] = planar
    return covariance
