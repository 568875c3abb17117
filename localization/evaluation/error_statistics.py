"""Summary statistics of errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from localization.errors import LocalizationError


class EvaluationError(LocalizationError):
    """Trajectories or values that cannot be evaluated; one line says why."""


@dataclass(frozen=True, slots=True)
class Statistics:
    """Statistics of absolute errors, in the unit of the errors."""

    count: int
    """Number of errors."""
    rmse: float
    """Root mean square."""
    mean: float
    """Mean."""
    median: float
    """Median."""
    p95: float
    """95th percentile."""
    max: float
    """Largest."""
    min: float
    """Smallest."""
    std: float
    """Standard deviation about the mean."""

    @classmethod
    def of(cls, errors: npt.ArrayLike) -> Statistics:
        """Return the statistics of the absolute values of errors (N,).

        Raises:
            EvaluationError: If there are no errors, or one is not finite.
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
