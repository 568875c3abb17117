"""Comparison of an estimate with a reference trajectory: ATE, RPE and NEES."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from localization.evaluation.consistency import Consistency, consistency, nees
from localization.evaluation.error_statistics import EvaluationError
from localization.evaluation.localization_history import History
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import (
    Ate,
    Errors,
    Rpe,
    align,
    associate,
    ate,
    errors,
    rpe,
    transformed,
)
from localization.geometry import FloatArray
from localization.types import Pose

STRETCH = 1.0
"""Length of the path segments of the relative error [m]."""
_PLANE = (0, 1, 5)
_SPACE = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceComparison:
    """Accuracy and consistency of an estimate."""

    truth: Trajectory
    """The reference trajectory."""
    errors: Errors
    """Truth minus estimate, without alignment."""
    ate: Ate
    """Absolute trajectory error without alignment."""
    aligned_ate: Ate
    """Absolute trajectory error after aligning the whole estimate with the truth, in case the truth's frame is
    not the map's."""
    offset: Pose
    """The alignment ``truth_from_map``."""
    rpe: Rpe | None
    """Relative pose error over ``STRETCH``; None if the path is shorter."""
    nees: FloatArray
    """NEES of each compared pose (N,)."""
    axes: tuple[int, ...]
    """Axes of the NEES: x, y and heading on a flat floor, otherwise all six."""
    consistency: Consistency
    """Summary of the NEES."""

    @classmethod
    def of(cls, history: History, truth: Trajectory, *, flat: bool) -> Self:
        """Compare an estimate with the truth.

        Args:
            history: The estimates.
            truth: Reference trajectory, by the same clock.
            flat: Whether height, roll and pitch were not estimated.

        Raises:
            EvaluationError: If the two cannot be compared.
        """
        estimate = history.trajectory()
        off = errors(estimate, truth)
        offset = align(estimate, truth)
        kept, _ = associate(estimate, truth)
        first = int(estimate.stamps.searchsorted(kept.stamps[0]))
        covariances = history.covariances()[first : first + len(kept)]
        axes = _PLANE if flat else _SPACE
        values = nees(off.vectors, covariances, axes=axes)
        try:
            stretch = rpe(estimate, truth, distance=STRETCH)
        except EvaluationError:
            stretch = None
        return cls(
            truth,
            off,
            ate(estimate, truth),
            ate(transformed(estimate, offset), truth),
            offset,
            stretch,
            values,
            axes,
            consistency(values, len(axes)),
        )
