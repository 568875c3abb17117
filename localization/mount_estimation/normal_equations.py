"""Normal equations of a least-squares problem with shared unknowns and poses that are eliminated.

Measurements of a segment of the drive depend on its poses and on unknowns that all segments share. The poses
are eliminated segment by segment (Schur complement), which leaves the information on the shared unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Normal equations of a segment of the drive, with n shared unknowns and m of its poses."""

    shared: FloatArray
    """Information on the shared unknowns (n, n)."""
    pull: FloatArray
    """Right-hand side for the shared unknowns (n,)."""
    poses: FloatArray
    """Information on the poses (m, m)."""
    cross: FloatArray
    """Information that couples shared unknowns and poses (n, m)."""
    poses_pull: FloatArray
    """Right-hand side for the poses (m,)."""

    def reduced(self) -> tuple[FloatArray, FloatArray]:
        """Return information (n, n) and right-hand side (n,) of the shared unknowns, poses eliminated."""
        solved = np.linalg.solve(
            self.poses, np.column_stack([self.cross.T, self.poses_pull[:, None]])
        )
        return (
            self.shared - self.cross @ solved[:, :-1],
            self.pull - self.cross @ solved[:, -1],
        )

    def poses_step(self, step: FloatArray) -> FloatArray:
        """Return the step of the poses (m,) that belongs to a step of the shared unknowns (n,)."""
        left = self.poses_pull - self.cross.T @ step
        return np.asarray(np.linalg.solve(self.poses, left), dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Linearised measurements of one pose, or of two successive poses."""

    shared: FloatArray
    """Derivative by the shared unknowns (M, n)."""
    poses: FloatArray
    """Derivative by the pose (M, 6) or the two poses (M, 12): position in ``map``, rotation in ``base_link``."""
    residual: FloatArray
    """Residual of each measurement (M,)."""
    weight: FloatArray
    """Weight of each measurement (M,): inverse variance."""


class SegmentBuilder:
    """Accumulates the measurements of a segment."""

    def __init__(self, shared: int, poses: int) -> None:
        """Begin with no measurements.

        Args:
            shared: Number of shared unknowns.
            poses: Number of poses at most.
        """
        m = 6 * poses
        self._shared, self._pull = np.zeros((shared, shared)), np.zeros(shared)
        self._poses, self._poses_pull = np.zeros((m, m)), np.zeros(m)
        self._cross = np.zeros((shared, m))

    def add(self, slot: int, rows: Rows) -> None:
        """Add measurements of the pose with a number, or of it and the next one."""
        at = slice(6 * slot, 6 * slot + rows.poses.shape[1])
        weighted = rows.shared * rows.weight[:, None]
        self._shared += weighted.T @ rows.shared
        self._pull -= weighted.T @ rows.residual
        self._cross[:, at] += weighted.T @ rows.poses
        self._poses[at, at] += (rows.poses * rows.weight[:, None]).T @ rows.poses
        self._poses_pull[at] -= rows.poses.T @ (rows.weight * rows.residual)

    def segment(self, poses: int) -> Segment:
        """Return the normal equations of the first ``poses`` poses."""
        m = slice(0, 6 * poses)
        return Segment(
            self._shared, self._pull, self._poses[m, m], self._cross[:, m], self._poses_pull[m]
        )


def observable_solution(
    reduced: Sequence[tuple[FloatArray, FloatArray]],
    prior: FloatArray,
    at: FloatArray,
    observable_share: float,
) -> FloatArray:
    """Return the shared unknowns (n,), zero in directions that the segments leave unobservable.

    Noise would move unobservable directions about as far as the prior allows.

    Args:
        reduced: Information (n, n) and right-hand side (n,) of each segment.
        prior: Prior information (n,), about zero.
        at: Values (n,) at which the segments were linearised.
        observable_share: A direction is observable if its sigma falls below this fraction of the prior's.
    """
    seen = np.asarray(sum(a for a, _ in reduced), dtype=np.float64)
    pull = sum(b for _, b in reduced) + seen @ at
    scale = 1.0 / np.sqrt(prior)
    values, vectors = np.linalg.eigh(seen * np.outer(scale, scale))
    kept = scale[:, None] * vectors[:, values > 1.0 / observable_share**2 - 1.0]
    small = kept.T @ (np.diag(prior) + seen) @ kept
    return np.asarray(kept @ np.linalg.solve(small, kept.T @ pull), dtype=np.float64)


def robust_covariance(
    reduced: Sequence[tuple[FloatArray, FloatArray]], prior: FloatArray
) -> FloatArray:
    """Return the covariance (n, n) of the shared unknowns.

    It is that of the normal equations plus a cluster-robust part (Liang and Zeger 1986): segments of the drive
    disagree by more than their noise, because maps have errors of their own.
    """
    inverse = np.linalg.inv(np.diag(prior) + sum(a for a, _ in reduced))
    pulls = np.array([b for _, b in reduced])
    pulls = pulls - pulls.mean(axis=0)
    spread = pulls.T @ pulls * len(pulls) / (len(pulls) - 1.0)
    return np.asarray(inverse + inverse @ spread @ inverse, dtype=np.float64)
