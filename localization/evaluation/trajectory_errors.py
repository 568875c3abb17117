"""Errors of an estimated trajectory against a reference: ATE and RPE.

Errors are truth minus estimate, in the axes of ``Estimate.covariance``: position in ``map``, rotation in
``base_link`` with ``R_true = R_estimate Exp(dtheta)``. The localiser itself must not import this module.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.evaluation.error_statistics import EvaluationError, Statistics
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray, euler_from_rotation, so3_log, wrap_angle
from localization.types import SECOND, IntArray, Pose


def associate(estimate: Trajectory, truth: Trajectory) -> tuple[Trajectory, Trajectory]:
    """Return the estimates within the time of the truth, and the truth at their stamps.

    Poses of the truth with equal stamps are used as they are; between its stamps the truth is interpolated.

    Raises:
        EvaluationError: If the two do not overlap in time.
    """
    for name, trajectory in (("estimate", estimate), ("truth", truth)):
        if not len(trajectory):
            raise EvaluationError(f"the {name} holds no poses")
    first, last = truth.stamps[0], truth.stamps[-1]
    within = np.flatnonzero((estimate.stamps >= first) & (estimate.stamps <= last))
    if not within.size:
        raise EvaluationError(
            f"estimate ({_span(estimate)}) and truth ({_span(truth)}) do not overlap in time"
        )
    kept = estimate.take(within)
    index = np.searchsorted(truth.stamps, kept.stamps)
    if np.array_equal(truth.stamps[index], kept.stamps):
        return kept, truth.take(index)
    positions, rotations = truth.at(kept.stamps)
    poses = (Pose.from_rotation(p, r) for p, r in zip(positions, rotations, strict=True))
    return kept, Trajectory.from_poses(zip(kept.stamps.tolist(), poses, strict=True))


def _span(trajectory: Trajectory) -> str:
    return f"{trajectory.stamps[0] / SECOND:.3f} to {trajectory.stamps[-1] / SECOND:.3f} s"


def align(estimate: Trajectory, truth: Trajectory) -> Pose:
    """Return the transform that, applied before the estimate, aligns it best with the truth.

    Least squares over positions, without scale (Umeyama 1991). It is meant for odometry, whose origin is
    arbitrary. On a straight path the rotation about the path is undetermined.
    """
    estimate, truth = associate(estimate, truth)
    centre, target = estimate.positions.mean(axis=0), truth.positions.mean(axis=0)
    u, _, vt = np.linalg.svd((truth.positions - target).T @ (estimate.positions - centre))
    proper = np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)])
    rotation = u @ proper @ vt
    return Pose.from_rotation(target - rotation @ centre, rotation)


def transformed(trajectory: Trajectory, before: Pose) -> Trajectory:
    """Return a trajectory with a transform applied before each pose."""
    return Trajectory.from_poses(
        (stamp, before @ trajectory.pose(i)) for i, stamp in enumerate(trajectory.stamps.tolist())
    )


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Truth minus estimate at each compared stamp."""

    stamps: IntArray
    """Compared stamps (N,) [ns]."""
    vectors: FloatArray
    """Errors (N, 6): position in ``map`` [m], rotation vector in ``base_link`` [rad]."""
    headings: FloatArray
    """Differences of yaw (N,) [rad], in [-pi, pi)."""

    @property
    def distances(self) -> FloatArray:
        """Lengths of the position errors (N,) [m]."""
        return np.asarray(np.linalg.norm(self.vectors[:, :3], axis=1))

    @property
    def horizontal(self) -> FloatArray:
        """Lengths of the horizontal position errors (N,) [m]."""
        return np.asarray(np.linalg.norm(self.vectors[:, :2], axis=1))


def errors(estimate: Trajectory, truth: Trajectory) -> Errors:
    """Return the errors pose by pose, without any alignment."""
    estimate, truth = associate(estimate, truth)
    pairs = list(zip(estimate.rotations, truth.rotations, strict=True))
    turns = np.array([so3_log(guess.T @ true) for guess, true in pairs])
    headings = [
        wrap_angle(euler_from_rotation(true)[2] - euler_from_rotation(guess)[2])
        for guess, true in pairs
    ]
    vectors = np.hstack((truth.positions - estimate.positions, turns))
    return Errors(estimate.stamps, vectors, np.array(headings))


@dataclass(frozen=True, slots=True)
class Ate:
    """Absolute trajectory error."""

    position: Statistics
    """Position error [m]."""
    horizontal: Statistics
    """Horizontal position error [m]."""
    heading: Statistics
    """Heading error [rad]."""


def ate(estimate: Trajectory, truth: Trajectory, *, aligned: bool = False) -> Ate:
    """Return the absolute trajectory error, after alignment if ``aligned`` is true; see ``align``."""
    if aligned:
        estimate = transformed(estimate, align(estimate, truth))
    e = errors(estimate, truth)
    return Ate(Statistics.of(e.distances), Statistics.of(e.horizontal), Statistics.of(e.headings))


@dataclass(frozen=True, slots=True)
class Rpe:
    """Relative pose error: the error of the motion over a segment of the path."""

    translation: Statistics
    """Translation error [m]."""
    rotation: Statistics
    """Rotation error [rad]."""


def rpe(
    estimate: Trajectory,
    truth: Trajectory,
    *,
    distance: float | None = None,
    duration: int | None = None,
) -> Rpe:
    """Return the relative pose error over segments of one length, one beginning at each pose.

    Args:
        estimate: Trajectory to evaluate, in any frame.
        truth: Reference trajectory.
        distance: Length of a segment along the true path [m]; or instead
        duration: Length of a segment in time [ns].

    Raises:
        EvaluationError: If the path is shorter than one segment, or not exactly one length is given.
    """
    estimate, truth = associate(estimate, truth)
    if (distance is None) == (duration is None):
        raise EvaluationError("rpe needs either a distance [m] or a duration [ns]")
    steps = np.linalg.norm(np.diff(truth.positions, axis=0), axis=1)
    if distance is not None:
        progress, length = np.concatenate(([0.0], np.cumsum(steps))), distance
    elif duration is not None:
        progress, length = (truth.stamps - truth.stamps[0]).astype(float), float(duration)
    if not length > 0.0:
        raise EvaluationError(f"a segment must have a positive length, got {length}")
    # A segment ends at the first pose that is far enough; the factor keeps rounding from choosing the next.
    ends = np.searchsorted(progress, progress + length * (1.0 - 1e-9))
    starts = np.flatnonzero(ends < len(progress))
    if not starts.size:
        raise EvaluationError(
            f"the whole path, {progress[-1]:g}, is shorter than a segment, {length:g}"
        )
    off = [
        _step(truth, i, j).inverse() @ _step(estimate, i, j)
        for i, j in zip(starts.tolist(), ends[starts].tolist(), strict=True)
    ]
    return Rpe(
        Statistics.of([np.linalg.norm(pose.position) for pose in off]),
        Statistics.of([np.linalg.norm(so3_log(pose.rotation)) for pose in off]),
    )


def _step(trajectory: Trajectory, i: int, j: int) -> Pose:
    return trajectory.pose(i).inverse() @ trajectory.pose(j)
