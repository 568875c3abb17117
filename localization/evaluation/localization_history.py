"""History of the estimates of a log without their sweeps, and its tables in CSV files.

Two tables complement a trajectory in a TUM file: the covariance of each pose, and the match quality of each
sweep.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from localization.evaluation.estimate_trace import AXES, COVARIANCE_COLUMNS, upper_triangle
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray
from localization.types import SECOND, Estimate, Health, Pose, ScanConsistency

SWEEP_COLUMNS: Final = (
    "stamp_ns",
    "health",
    "inlier_ratio",
    "unexplained",
    "occluded",
    "free_space_violation",
    "unmapped",
    "nis",
    "observable_directions",
    *(f"observable_{axis}" for axis in AXES),
    "reasons",
)


@dataclass(frozen=True, slots=True, eq=False)
class SweepRow:
    """Match quality of a sweep, or a change of health between two sweeps."""

    stamp: int
    """Stamp of the estimate [ns]."""
    health: Health
    """Health state."""
    reasons: tuple[str, ...]
    """Reasons for the health state."""
    inlier_ratio: float | None = None
    """Inlier ratio as in ``Match``; None, like the next ones, where no sweep was registered."""
    consistency: ScanConsistency | None = None
    """Consistency of the scan with the map as in ``Estimate``."""
    nis: float | None = None
    """Normalised innovation squared as in ``Estimate``."""
    observable_directions: int | None = None
    """Number of observable directions of the registration: the degrees of freedom of ``nis``."""
    observability: FloatArray = field(default_factory=lambda: np.full(6, np.nan))
    """Fraction of each axis (6,) in the observable directions, in [0, 1]: x, y, z in ``map``, then the rotations
    about x, y and z of ``base_link``."""

    @classmethod
    def of(cls, estimate: Estimate) -> Self:
        """Return the row of an estimate."""
        match = estimate.match
        if match is None:
            return cls(estimate.stamp, estimate.health, estimate.reasons)
        return cls(
            estimate.stamp,
            estimate.health,
            estimate.reasons,
            match.inlier_ratio,
            estimate.consistency,
            estimate.nis,
            len(match.observable_directions),
            np.einsum("ij,ij->j", match.observable_directions, match.observable_directions),
        )


class History:
    """Collects estimates in order of time, without their sweeps."""

    def __init__(self) -> None:
        self.sweeps: list[SweepRow] = []
        self._known: dict[int, tuple[Pose, FloatArray]] = {}
        self._stamps: list[int] = []
        self._healths: list[Health] = []
        # Cached: for a log of hours they take seconds to build, and several figures use them.
        self._trajectory: Trajectory | None = None
        self._covariances: FloatArray | None = None

    def add(self, estimate: Estimate) -> None:
        """Add the next estimate."""
        changed = not self._healths or estimate.health is not self._healths[-1]
        if changed or estimate.match is not None:
            self.sweeps.append(SweepRow.of(estimate))
        self._stamps.append(estimate.stamp)
        self._healths.append(estimate.health)
        if estimate.map_from_base is not None:
            self._known[estimate.stamp] = estimate.map_from_base, estimate.covariance
            self._trajectory = self._covariances = None

    @property
    def begin(self) -> int:
        """Stamp of the first estimate [ns]; 0 if there is none."""
        return self._stamps[0] if self._stamps else 0

    @property
    def stamps(self) -> np.typing.NDArray[np.int64]:
        """Stamps of all estimates (N,) [ns]."""
        return np.array(self._stamps, dtype=np.int64)

    @property
    def healths(self) -> tuple[Health, ...]:
        """Health states of all estimates (N,)."""
        return tuple(self._healths)

    def trajectory(self) -> Trajectory:
        """Return the poses of the estimates that have one."""
        if self._trajectory is None:
            poses = ((stamp, pose) for stamp, (pose, _) in self._known.items())
            self._trajectory = Trajectory.from_poses(poses)
        return self._trajectory

    def covariances(self) -> FloatArray:
        """Return the covariance of each pose of ``trajectory``, (M, 6, 6), as in ``Estimate``."""
        if self._covariances is None:
            each = [covariance for _, covariance in self._known.values()]
            self._covariances = np.array(each).reshape(-1, 6, 6)
            self._covariances.flags.writeable = False
        return self._covariances

    def sigmas(self) -> tuple[FloatArray, FloatArray]:
        """Return one sigma of the horizontal position (M,) [m] and of the heading (M,) [rad] of each pose."""
        covariances = self.covariances()
        spread = np.sqrt(np.trace(covariances[:, :2, :2], axis1=1, axis2=2))
        return spread, np.sqrt(covariances[:, 5, 5])

    @property
    def seconds(self) -> float:
        """Time from the first estimate to the last [s]."""
        return (self._stamps[-1] - self.begin) / SECOND if self._stamps else 0.0

    @property
    def placed_after(self) -> float | None:
        """Time from the first estimate to the first pose [s]; None if no pose is known."""
        known = self.trajectory()
        return (int(known.stamps[0]) - self.begin) / SECOND if len(known) else None

    @property
    def distance(self) -> float:
        """Length of the path in the plane [m]; a step of half a metre is a jump, not a drive."""
        steps = np.linalg.norm(np.diff(self.trajectory().positions[:, :2], axis=0), axis=1)
        return float(steps[steps < 0.5].sum())


def write_covariances(path: Path | str, history: History) -> None:
    """Write a CSV table with one row for each pose of the trajectory, in its order.

    A row holds the stamp [ns] and the upper triangle of the covariance, row by row, of the position in ``map``
    [m] and the rotation vector in ``base_link`` [rad].
    """
    rows = zip(history.trajectory().stamps.tolist(), history.covariances(), strict=True)
    _write(
        path,
        ("stamp_ns", *COVARIANCE_COLUMNS),
        ((stamp, *map(repr, upper_triangle(covariance).tolist())) for stamp, covariance in rows),
    )


def write_health(path: Path | str, sweeps: Iterable[SweepRow]) -> None:
    """Write a CSV table with one row for each sweep, and for each change of health between sweeps."""
    _write(
        path,
        SWEEP_COLUMNS,
        (
            (
                row.stamp,
                row.health.value,
                _cell(row.inlier_ratio),
                *(("",) * 4 if row.consistency is None else map(_cell, astuple(row.consistency))),
                _cell(row.nis),
                "" if row.observable_directions is None else row.observable_directions,
                *(
                    "" if row.observable_directions is None else f"{share:.3f}"
                    for share in row.observability
                ),
                json.dumps(row.reasons),
            )
            for row in sweeps
        ),
    )


def _cell(value: float | None) -> str:
    return "" if value is None else repr(float(value))


def _write(path: Path | str, head: tuple[str, ...], rows: Iterable[tuple[Any, ...]]) -> None:
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(head)
        table.writerows(rows)
