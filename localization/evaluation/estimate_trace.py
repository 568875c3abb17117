"""Trace of a run: covariance, health and match quality of each estimate, as a CSV table.

The poses are in a trajectory file beside it.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np

from localization.errors import LocalizationError
from localization.geometry import FloatArray
from localization.types import Estimate, Health

AXES: Final = ("x", "y", "z", "rx", "ry", "rz")
"""Axes of a covariance: position in ``map``, rotation in ``base_link``."""
_ROWS, _COLUMNS = np.triu_indices(6)
COVARIANCE_COLUMNS: Final = tuple(
    f"cov_{AXES[i]}_{AXES[j]}" for i, j in zip(_ROWS, _COLUMNS, strict=True)
)
"""Names of the columns for the upper triangle of a covariance, row by row."""
_HEADER: Final = (
    "stamp_ns",
    "health",
    *COVARIANCE_COLUMNS,
    "nis",
    "observable_directions",
    "inlier_ratio",
    "unexplained",
    "reasons",
)


class TraceError(LocalizationError):
    """A file that is not a valid trace; one line names the place and the reason."""


@dataclass(frozen=True, slots=True, eq=False)
class TraceRow:
    """Quality of one estimate as the localiser itself reports it."""

    stamp: int
    """Stamp of the estimate [ns]."""
    health: Health
    """Health state."""
    covariance: FloatArray
    """Covariance (6, 6) as in ``Estimate``; only its upper triangle is kept."""
    nis: float | None = None
    """Normalised innovation squared as in ``Estimate``."""
    observable_directions: int | None = None
    """Number of observable directions of the registration: the degrees of freedom of ``nis``."""
    inlier_ratio: float | None = None
    """Inlier ratio as in ``Match``."""
    unexplained: float | None = None
    """Unexplained share of the sweep as in ``Estimate``."""
    reasons: tuple[str, ...] = ()
    """Reasons for the health state."""

    def __post_init__(self) -> None:
        covariance = np.array(self.covariance, dtype=float)
        if covariance.shape != (6, 6):
            raise TraceError(f"covariance must have shape (6, 6), got {covariance.shape}")
        covariance[_COLUMNS, _ROWS] = covariance[_ROWS, _COLUMNS]
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)

    @classmethod
    def of(cls, estimate: Estimate) -> Self:
        """Return the row of an estimate."""
        match = estimate.match
        return cls(
            estimate.stamp,
            estimate.health,
            estimate.covariance,
            estimate.nis,
            None if match is None else len(match.observable_directions),
            None if match is None else match.inlier_ratio,
            estimate.unexplained,
            estimate.reasons,
        )


def upper_triangle(covariance: FloatArray) -> FloatArray:
    """Return the entries (21,) of a covariance (6, 6) in the order of ``COVARIANCE_COLUMNS``."""
    entries: FloatArray = covariance[_ROWS, _COLUMNS]
    return entries


def write_trace(path: Path | str, rows: Iterable[TraceRow]) -> None:
    """Write a trace; numbers have as many digits as it takes to restore them exactly."""
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(_HEADER)
        for row in rows:
            table.writerow(
                (
                    row.stamp,
                    row.health.value,
                    *map(repr, upper_triangle(row.covariance).tolist()),
                    "" if row.nis is None else repr(float(row.nis)),
                    "" if row.observable_directions is None else row.observable_directions,
                    "" if row.inlier_ratio is None else repr(float(row.inlier_ratio)),
                    "" if row.unexplained is None else repr(float(row.unexplained)),
                    json.dumps(row.reasons),
                )
            )


def read_trace(path: Path | str) -> tuple[TraceRow, ...]:
    """Read a trace.

    Raises:
        TraceError: If the file is missing, or a line is not a valid row.
    """
    try:
        with Path(path).open(encoding="utf-8", newline="") as file:
            table = csv.reader(file)
            if tuple(next(table, ())) != _HEADER:
                raise TraceError(
                    f"{path}: is not a trace; its first line is not {','.join(_HEADER)}"
                )
            rows = []
            for cells in table:
                try:
                    rows.append(_read_row(cells))
                except ValueError as error:
                    raise TraceError(f"{path}, line {table.line_num}: {error}") from None
            return tuple(rows)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not a table in UTF-8"
        raise TraceError(f"{path}: {reason}") from error


def _read_row(cells: Sequence[str]) -> TraceRow:
    if len(cells) != len(_HEADER):
        raise TraceError(f"a row needs {len(_HEADER)} cells, got {len(cells)}")
    stamp, health, *entries, nis, directions, fit, unexplained, reasons = cells
    covariance = np.zeros((6, 6))
    covariance[_ROWS, _COLUMNS] = [float(entry) for entry in entries]
    sentences = json.loads(reasons)
    if not isinstance(sentences, list) or not all(isinstance(text, str) for text in sentences):
        raise TraceError(f"reasons must be a JSON list of sentences, got {reasons}")
    return TraceRow(
        int(stamp),
        Health(health),
        covariance,
        float(nis) if nis else None,
        int(directions) if directions else None,
        float(fit) if fit else None,
        float(unexplained) if unexplained else None,
        tuple(sentences),
    )
