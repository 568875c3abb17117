"""How good was it? The one place that holds estimates against truth.

Two questions are asked: how large are the errors (ATE, RPE), and did the localiser know how large
they are (NEES, NIS). Errors are truth minus estimate, in the axes of ``Estimate.covariance``:
position in ``map``, rotation in ``base_link`` with ``R_true = R_estimate Exp(dtheta)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray, euler_from_rotation, so3_log, wrap_angle
from localization.types import SECOND, Health, IntArray, Pose


class EvaluationError(ValueError):
    """Things that cannot be compared; one line says why."""


@dataclass(frozen=True, slots=True)
class Statistics:
    """What is worth knowing of many absolute errors, in their unit."""

    count: int
    rmse: float
    mean: float
    median: float
    p95: float
    max: float
    min: float
    std: float

    @classmethod
    def of(cls, errors: npt.ArrayLike) -> Statistics:
        """Summarise errors (N,); only their absolute value counts.

        Raises:
            EvaluationError: If there are none, or one is not finite.
        """
        e = np.abs(np.asarray(errors, dtype=float))
        if not e.size:
            raise EvaluationError("no errors to summarise: nothing was compared")
        if not np.isfinite(e).all():
            raise EvaluationError("errors must be finite")
        return cls(
            count=e.size,
            rmse=float(np.sqrt(np.mean(e * e))),
            mean=float(np.mean(e)),
            median=float(np.median(e)),
            p95=float(np.percentile(e, 95.0)),
            max=float(np.max(e)),
            min=float(np.min(e)),
            std=float(np.std(e)),
        )


def associate(estimate: Trajectory, truth: Trajectory) -> tuple[Trajectory, Trajectory]:
    """Return the estimates within the time of the truth, and the truth at their stamps.

    Truth of the same stamp is taken as it is; between its stamps it is interpolated.

    Raises:
        EvaluationError: If their times do not overlap.
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
    """Return the motion that, put before the estimate, brings it nearest to the truth.

    Least squares over positions, without scale (Umeyama 1991). For odometry, whose origin means
    nothing; an estimate in ``map`` is judged where it is. A straight path leaves the rotation about
    itself open.
    """
    estimate, truth = associate(estimate, truth)
    centre, target = estimate.positions.mean(axis=0), truth.positions.mean(axis=0)
    u, _, vt = np.linalg.svd((truth.positions - target).T @ (estimate.positions - centre))
    proper = np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)])
    rotation = u @ proper @ vt
    return Pose.from_rotation(target - rotation @ centre, rotation)


def transformed(trajectory: Trajectory, before: Pose) -> Trajectory:
    """Return a trajectory with a motion put before each pose."""
    return Trajectory.from_poses(
        (stamp, before @ trajectory.pose(i)) for i, stamp in enumerate(trajectory.stamps.tolist())
    )


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Truth minus estimate at each compared stamp."""

    stamps: IntArray
    """(N,) [ns]."""
    vectors: FloatArray
    """(N, 6): position in ``map`` [m], rotation vector in ``base_link`` [rad]."""
    headings: FloatArray
    """(N,) difference of yaw [rad], in [-pi, pi)."""

    @property
    def distances(self) -> FloatArray:
        """(N,) lengths of the position errors [m]."""
        return np.asarray(np.linalg.norm(self.vectors[:, :3], axis=1))

    @property
    def horizontal(self) -> FloatArray:
        """(N,) lengths of the position errors in the plane [m]."""
        return np.asarray(np.linalg.norm(self.vectors[:, :2], axis=1))


def errors(estimate: Trajectory, truth: Trajectory) -> Errors:
    """Compare pose by pose, without any alignment."""
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
    """[m]."""
    horizontal: Statistics
    """[m]."""
    heading: Statistics
    """[rad]."""


def ate(estimate: Trajectory, truth: Trajectory, *, aligned: bool = False) -> Ate:
    """Return the absolute trajectory error; ``aligned`` is for odometry, see ``align``."""
    if aligned:
        estimate = transformed(estimate, align(estimate, truth))
    e = errors(estimate, truth)
    return Ate(Statistics.of(e.distances), Statistics.of(e.horizontal), Statistics.of(e.headings))


@dataclass(frozen=True, slots=True)
class Rpe:
    """Relative pose error: how far a stretch of the way is off, wherever it began."""

    translation: Statistics
    """[m]."""
    rotation: Statistics
    """[rad]."""


def rpe(
    estimate: Trajectory,
    truth: Trajectory,
    *,
    distance: float | None = None,
    duration: int | None = None,
) -> Rpe:
    """Return the relative pose error over stretches of one length, one beginning at each pose.

    Args:
        estimate: What is judged, in whatever frame.
        truth: What it is held against.
        distance: Length of a stretch along the true path [m]; or else
        duration: Its length in time [ns].

    Raises:
        EvaluationError: If the way is shorter than one stretch.
    """
    estimate, truth = associate(estimate, truth)
    if (distance is None) == (duration is None):
        raise EvaluationError("rpe wants either a distance [m] or a duration [ns]")
    steps = np.linalg.norm(np.diff(truth.positions, axis=0), axis=1)
    if distance is not None:
        progress, length = np.concatenate(([0.0], np.cumsum(steps))), distance
    elif duration is not None:
        progress, length = (truth.stamps - truth.stamps[0]).astype(float), float(duration)
    if not length > 0.0:
        raise EvaluationError(f"a stretch must be longer than nothing, got {length}")
    # A stretch ends at the first pose that is far enough; rounding must not push it to the next.
    ends = np.searchsorted(progress, progress + length * (1.0 - 1e-9))
    starts = np.flatnonzero(ends < len(progress))
    if not starts.size:
        raise EvaluationError(
            f"the whole way, {progress[-1]:g}, is shorter than a stretch, {length:g}"
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


def nees(
    vectors: FloatArray, covariances: FloatArray, *, axes: Sequence[int] = range(6)
) -> FloatArray:
    """Return the normalised estimation error squared (N,): ``e^T P^-1 e``.

    Args:
        vectors: (N, 6) as in ``Errors``.
        covariances: (N, 6, 6) as in ``Estimate``.
        axes: Which of the six to judge, such as ``(0, 1, 5)`` for x, y and heading.

    Raises:
        EvaluationError: If a covariance is not positive definite.
    """
    chosen = list(axes)
    e = np.asarray(vectors, dtype=float)[:, chosen]
    p = np.asarray(covariances, dtype=float)[:, chosen][:, :, chosen]
    if len(e) != len(p):
        raise EvaluationError(f"{len(e)} errors want as many covariances, got {len(p)}")
    if len(p) and not (positive := np.linalg.eigvalsh(p)[:, 0] > 0.0).all():
        raise EvaluationError(f"covariance {np.argmin(positive)} must be positive definite")
    return np.asarray(np.einsum("ni,ni->n", e, np.linalg.solve(p, e[:, :, None])[:, :, 0]))


@dataclass(frozen=True, slots=True)
class Consistency:
    """Whether squared, normalised errors are as large as they should be."""

    count: int
    mean_ratio: float
    """Mean of value over degrees of freedom: 1 is honest, more is overconfident, less timid."""
    inside: float
    """Share that is inside the chi-square bound of 95 %, which should be 0.95."""


def consistency(values: npt.ArrayLike, freedom: npt.ArrayLike) -> Consistency:
    """Summarise NEES or NIS values.

    Args:
        values: (N,).
        freedom: Degrees of freedom: one number, or (N,) as with NIS, where each registration has its
            own. Values without any are left out: they say nothing.
    """
    v = np.atleast_1d(np.asarray(values, dtype=float))
    k = np.broadcast_to(np.asarray(freedom, dtype=float), v.shape)
    v, k = v[k > 0], k[k > 0]
    if not v.size:
        raise EvaluationError("no values to summarise")
    if not np.isfinite(v).all():
        raise EvaluationError("values must be finite")
    return Consistency(v.size, float(np.mean(v / k)), float(np.mean(v <= chi2.ppf(0.95, k))))


def health_shares(stamps: IntArray, healths: Sequence[Health]) -> dict[Health, float]:
    """Return the share of time spent in each state; each estimate holds until the next.

    Args:
        stamps: (N,) [ns], increasing.
        healths: (N,).
    """
    if len(stamps) != len(healths) or not len(stamps):
        raise EvaluationError(f"{len(healths)} states want as many stamps, got {len(stamps)}")
    held = np.diff(stamps)
    if not held.sum():
        held = np.ones(len(stamps), dtype=np.int64)
    shares = dict.fromkeys(Health, 0.0)
    for health, time in zip(healths, held.tolist(), strict=False):
        shares[health] += time / float(held.sum())
    return shares
