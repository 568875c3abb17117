"""Optimisation of a pose graph with robust edges.

Open3D optimises (line processes after Choi, Zhou and Koltun 2015). This module converts to its convention:
rotation before translation, errors in the axes of the edge's source.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.maps.open3d_import import import_open3d
from localization.types import Pose

_PRUNED = 0.25
"""Value of the line process below which an uncertain edge is removed; Open3D's own default."""
_GATE = 16.0
"""Squared, normalised error at which the line process of an uncertain edge begins to reduce its weight. A
correct loop has 3 on average with three degrees of freedom, and one of 900 has more than this."""


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """Measured relative pose of two nodes."""

    source: int
    """Number of the source node."""
    target: int
    """Number of the target node."""
    target_from_source: Pose
    """Pose of the source in the target."""
    covariance: FloatArray
    """Covariance (6, 6) of position and rotation in the source's axes [m, rad]."""
    uncertain: bool = False
    """Whether the edge may be wrong, so that the optimisation may remove it."""


def optimized_poses(poses: Sequence[Pose], edges: Sequence[Edge]) -> list[Pose]:
    """Return the poses that agree best with the edges; the first pose stays fixed.

    Raises:
        ImportError: If Open3D is missing or does not load; the message names the package to install.
    """
    o3d = import_open3d()
    registration = o3d.pipelines.registration
    graph = registration.PoseGraph()
    for pose in poses:
        graph.nodes.append(registration.PoseGraphNode(_matrix(pose)))
    loose = []
    for edge in edges:
        information = _information(edge.covariance)
        if edge.uncertain:
            loose.append(float(information[5, 5]))
        graph.edges.append(
            registration.PoseGraphEdge(
                edge.source,
                edge.target,
                _matrix(edge.target_from_source),
                information,
                uncertain=edge.uncertain,
            )
        )
    # Open3D's scale of the line process is distance^2 times the mean of the last diagonal element.
    distance = float(np.sqrt(_GATE / np.mean(loose))) if loose else 1.0
    option = registration.GlobalOptimizationOption(
        max_correspondence_distance=distance,
        edge_prune_threshold=_PRUNED,
        preference_loop_closure=1.0,
        reference_node=0,
    )
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        registration.global_optimization(
            graph,
            registration.GlobalOptimizationLevenbergMarquardt(),
            registration.GlobalOptimizationConvergenceCriteria(),
            option,
        )
    return [Pose.from_rotation(n.pose[:3, 3], _proper(n.pose[:3, :3])) for n in graph.nodes]


def _matrix(pose: Pose) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.rotation, pose.position
    return matrix


def _proper(rotation: FloatArray) -> FloatArray:
    """Return the rotation nearest to a matrix that rounding made slightly non-orthogonal."""
    u, _, vt = np.linalg.svd(rotation)
    proper: FloatArray = u @ vt
    return proper


def _information(covariance: FloatArray) -> FloatArray:
    order = [3, 4, 5, 0, 1, 2]
    inverse = np.asarray(np.linalg.inv(covariance), dtype=float)
    return np.ascontiguousarray(inverse[np.ix_(order, order)])
