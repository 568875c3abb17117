"""An estimate held against a reference trajectory, in the figures that evaluation tools report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from localization.evaluation.localization_history import History
from localization.evaluation.metrics import (
    Ate,
    Consistency,
    Errors,
    EvaluationError,
    Rpe,
    align,
    associate,
    ate,
    consistency,
    errors,
    nees,
    rpe,
    transformed,
)
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray
from localization.types import Pose

STRETCH = 1.0
"""Length of the stretches of the relative error [m]."""
_PLANE = (0, 1, 5)
_SPACE = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """How far off the estimate was, and whether it knew."""

    truth: Trajectory
    errors: Errors
    """Truth minus estimate, as it is."""
    ate: Ate
    """As it is, without any alignment."""
    moved: Ate
    """With the whole estimate moved to where it fits the truth best: what is left if the truth's frame is
    not the map's."""
    offset: Pose
    """That motion, ``truth_from_map``."""
    rpe: Rpe | None
    """Over stretches of ``STRETCH``; None if the way is shorter."""
    nees: FloatArray
    """(N,) of each compared pose."""
    axes: tuple[int, ...]
    """Of which axes: of x, y and heading on a flat floor, else of all six."""
    consistency: Consistency

    @classmethod
    def of(cls, history: History, truth: Trajectory, *, flat: bool) -> Self:
        """Judge.

        Args:
            history: what was estimated.
            truth: where the robot was, by the same clock.
            flat: whether height, roll and pitch were never estimated.

        Raises:
            EvaluationError: if the two cannot be compared.
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
