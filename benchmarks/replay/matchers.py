"""Other matchers in the same filter: KISS-ICP with a fixed covariance, small_gicp's plane-ICP."""

from __future__ import annotations

import numpy as np
import small_gicp

from localization.filter.pose_error import LEVER
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher, match_at
from localization.matching.registration import RegistrationConfig
from localization.pipeline.localizer import LocalizerConfig
from localization.types import Match, Pose, Sweep

_LEAST = 0.3**-2
"""A direction of small_gicp is kept if it is known better than to 0.3 m [m^-2]; it has no measure of noisy normals."""


def plain(matcher: Matcher) -> LocalizerConfig:
    """Return our filter and its gates around a matcher, without what we add to them."""
    return LocalizerConfig(
        matcher=matcher,
        kiss_odometry=False,
        good_inlier_ratio=2.0,
    )


class SmallGicp:
    """small_gicp's point-to-plane ICP; what it knows is read from its Hessian."""

    def __init__(self, world: PreparedMap, *, reach: float = 0.5) -> None:
        """Build.

        Args:
            world: the prepared cloud; small_gicp estimates normals of its own.
            reach: largest distance of corresponding points [m].
        """
        self._world, self._reach = world, reach
        self._target, self._tree = _target(world.cloud)

    def __call__(self, sweep: Sweep, prior: Pose, covariance: FloatArray) -> Match:
        """Match as ``MatchSweep`` asks for; the prior is a start and nothing more."""
        pose, hessian, inliers = self.align(np.array(sweep.points), prior)
        information, directions = _known(hessian, pose, max(inliers, 1))
        return match_at(sweep, self._world, pose, information, directions)

    def align(self, points: FloatArray, guess: Pose) -> tuple[Pose, FloatArray, int]:
        """Return ``map_from_base`` of points (N, 3) in the base's frame, the Hessian (6, 6), and inliers.

        Args:
            points: of a sweep [m].
            guess: ``map_from_base`` to begin from.
        """
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = guess.rotation, guess.position
        result = small_gicp.align(
            self._target,
            small_gicp.PointCloud(points),
            self._tree,
            init_T_target_source=matrix,
            registration_type="PLANE_ICP",
            max_correspondence_distance=self._reach,
            num_threads=1,
        )
        found = np.asarray(result.T_target_source)
        pose = Pose.from_rotation(found[:3, 3], found[:3, :3])
        return pose, np.asarray(result.H), int(result.num_inliers)


def _target(cloud: Cloud) -> tuple[small_gicp.PointCloud, small_gicp.KdTree]:
    target = small_gicp.PointCloud(np.array(cloud.points))
    tree = small_gicp.KdTree(target)
    small_gicp.estimate_normals(target, tree, num_neighbors=20)
    return target, tree


def _known(hessian: FloatArray, pose: Pose, inliers: int) -> tuple[FloatArray, FloatArray]:
    """Return information (6, 6) and kept directions (k, 6) as ``Match`` has them.

    Its Hessian is of (rotation, translation), both in the robot's frame, for residuals of one metre;
    points are worth what our own registration takes them to be worth.
    """
    c = RegistrationConfig()
    turn = np.eye(6)[[3, 4, 5, 0, 1, 2]]
    to_map = np.eye(6)
    to_map[:3, :3] = pose.rotation
    frame = to_map @ turn
    worth = min(1.0, c.effective_points / inliers) / c.sigma**2
    information = worth * frame @ hessian @ frame.T
    shrink = np.diag([1.0, 1.0, 1.0, 1 / LEVER, 1 / LEVER, 1 / LEVER])
    values, vectors = np.linalg.eigh(shrink @ information @ shrink)
    return information, np.ascontiguousarray(vectors[:, values > _LEAST].T)
