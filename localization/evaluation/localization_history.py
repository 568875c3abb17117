"""What localising a log came to, without its sweeps: small enough to keep, and to write down.

Two tables belong to a trajectory in a TUM file: how surely each of its poses is known, and what became
of each sweep.
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
from localization.types import Estimate, Health, Pose, ScanConsistency

SWEEP_COLUMNS: Final = (
    "stamp_ns",
    "health",
    "fit",
    "unexplained",
    "before",
    "through",
    "beyond",
    "nis",
    "directions",
    *(f"kept_{axis}" for axis in AXES),
    "reasons",
)


@dataclass(frozen=True, slots=True, eq=False)
class SweepRow:
    """What became of a sweep, or of the estimate's health between two sweeps."""

    stamp: int
    """[ns]."""
    health: Health
    reasons: tuple[str, ...]
    fit: float | None = None
    """As in ``Match``; None where no sweep was registered, as are the next."""
    mismatch: ScanConsistency | None = None
    """As in ``Estimate``."""
    nis: float | None = None
    """As in ``Estimate``."""
    directions: int | None = None
    """How many directions the registration kept: the degrees of freedom of ``nis``."""
    kept: FloatArray = field(default_factory=lambda: np.full(6, np.nan))
    """(6,) how much of each axis is in the kept directions, 0 to 1: x, y, z in ``map``, then the rotations
    about x, y and z of ``base_link``."""

    @classmethod
    def of(cls, estimate: Estimate) -> Self:
        """Return an estimate's row."""
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
    """Collects estimates as they come; keeps no sweeps."""

    def __init__(self) -> None:
        self.sweeps: list[SweepRow] = []
        self._known: dict[int, tuple[Pose, FloatArray]] = {}
        self._stamps: list[int] = []
        self._healths: list[Health] = []
        # Of hours they take seconds to put together, and several ask for them.
        self._trajectory: Trajectory | None = None
        self._covariances: FloatArray | None = None

    def add(self, estimate: Estimate) -> None:
        """Take the next estimate."""
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
        """(N,) of all estimates [ns]."""
        return np.array(self._stamps, dtype=np.int64)

    @property
    def healths(self) -> tuple[Health, ...]:
        """(N,) of all estimates."""
        return tuple(self._healths)

    def trajectory(self) -> Trajectory:
        """Return the poses of the estimates that know where the robot is."""
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


def write_covariances(path: Path | str, history: History) -> None:
    """Write a CSV table with one row for each pose of the trajectory, in its order.

    A row is the stamp [ns] and the upper triangle of the covariance, row by row: of the position in
    ``map`` [m] and the rotation vector in ``base_link`` [rad].
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
                _cell(row.fit),
                *(("",) * 4 if row.mismatch is None else map(_cell, astuple(row.mismatch))),
                _cell(row.nis),
                "" if row.directions is None else row.directions,
                *("" if row.directions is None else f"{share:.3f}" for share in row.kept),
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
