"""Consistency of estimated covariances: NEES and NIS, and the time spent in each health state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from localization.evaluation.error_statistics import EvaluationError
from localization.geometry import FloatArray
from localization.types import Health, IntArray


def nees(
    vectors: FloatArray, covariances: FloatArray, *, axes: Sequence[int] = range(6)
) -> FloatArray:
    """Return the normalised estimation error squared (N,): ``e^T P^-1 e``.

    Args:
        vectors: Errors (N, 6) as in ``Errors``.
        covariances: Covariances (N, 6, 6) as in ``Estimate``.
        axes: Axes to evaluate, such as ``(0, 1, 5)`` for x, y and heading.

    Raises:
        EvaluationError: If a covariance is not positive definite.
    """
    chosen = list(axes)
    e = np.asarray(vectors, dtype=float)[:, chosen]
    p = np.asarray(covariances, dtype=float)[:, chosen][:, :, chosen]
    if len(e) != len(p):
        raise EvaluationError(f"{len(e)} errors need as many covariances, got {len(p)}")
    if len(p) and not (positive := np.linalg.eigvalsh(p)[:, 0] > 0.0).all():
        raise EvaluationError(f"covariance {np.argmin(positive)} must be positive definite")
    return np.asarray(np.einsum("ni,ni->n", e, np.linalg.solve(p, e[:, :, None])[:, :, 0]))


@dataclass(frozen=True, slots=True)
class Consistency:
    """Summary of squared, normalised errors against their chi-square distribution."""

    count: int
    """Number of values."""
    mean_ratio: float
    """Mean of value over degrees of freedom: 1 is consistent, more is overconfident, less is conservative."""
    inside: float
    """Fraction of the values inside the 95 % chi-square bound; 0.95 is consistent."""


def consistency(values: npt.ArrayLike, freedom: npt.ArrayLike) -> Consistency:
    """Summarise NEES or NIS values.

    Args:
        values: Squared, normalised errors (N,).
        freedom: Degrees of freedom: one number, or (N,) as for NIS, where each registration has its own.
            Values with zero degrees of freedom are left out.

    Raises:
        EvaluationError: If there are no values, or one is not finite.
    """
    v = np.atleast_1d(np.asarray(values, dtype=float))
    k = np.broadcast_to(np.asarray(freedom, dtype=float), v.shape)
    v, k = v[k > 0], k[k > 0]
    if not v.size:
        raise EvaluationError("there are no values to summarise")
    if not np.isfinite(v).all():
        raise EvaluationError("values must be finite")
    return Consistency(v.size, float(np.mean(v / k)), float(np.mean(v <= chi2.ppf(0.95, k))))


def health_shares(stamps: IntArray, healths: Sequence[Health]) -> dict[Health, float]:
    """Return the fraction of time spent in each state; each state lasts until the next estimate.

    Args:
        stamps: Stamps of the estimates (N,) [ns], increasing.
        healths: State of each estimate (N,).

    Raises:
        EvaluationError: If there are no estimates, or not as many states as stamps.
    """
    if len(stamps) != len(healths) or not len(stamps):
        raise EvaluationError(f"{len(healths)} states need as many stamps, got {len(stamps)}")
    held = np.diff(stamps)
    if not held.sum():
        held = np.ones(len(stamps), dtype=np.int64)
    shares = dict.fromkeys(Health, 0.0)
    for health, time in zip(healths, held.tolist(), strict=False):
        shares[health] += time / float(held.sum())
    return shares
