"""Traces: what the localiser believed of itself, estimate by estimate, as a CSV table.

Where it thought to be is in a trajectory file; the trace holds how surely, in what state and why.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np

from localization.geometry import FloatArray
from localization.types import Estimate, Health

AXES: Final = ("x", "y", "z", "rx", "ry", "rz")
"""Of a covariance: position in ``map``, rotation in ``base_link``."""
_ROWS, _COLUMNS = np.triu_indices(6)
COVARIANCE_COLUMNS: Final = tuple(
    f"cov_{AXES[i]}_{AXES[j]}" for i, j in zip(_ROWS, _COLUMNS, strict=True)
)
"""Names of the upper triangle of a covariance, row by row."""
_HEADER: Final = (
    "stamp_ns",
    "health",
    *COVARIANCE_COLUMNS,
    "nis",
    "directions",
    "fit",
    "unexplained",
    "reasons",
)


class TraceError(ValueError):
    """A file that is no trace; one line says where and why."""


@dataclass(frozen=True, slots=True, eq=False)
class TraceRow:
    """One estimate's opinion of itself."""

    stamp: int
    """[ns]."""
    health: Health
    covariance: FloatArray
    """(6, 6), as in ``Estimate``; only its upper triangle is kept."""
    nis: float | None = None
    """As in ``Estimate``."""
    directions: int | None = None
    """How many directions the registration kept: the degrees of freedom of ``nis``."""
    fit: float | None = None
    """As in ``Match``."""
    unexplained: float | None = None
    """As in ``Estimate``."""
    reasons: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        covariance = np.array(self.covariance, dtype=float)
        if covariance.shape != (6, 6):
            raise TraceError(f"covariance must have shape (6, 6), got {covariance.shape}")
        covariance[_COLUMNS, _ROWS] = covariance[_ROWS, _COLUMNS]
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)

    @classmethod
    def of(cls, estimate: Estimate) -> Self:
        """Return an estimate's row."""
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
    """Write a trace; numbers have as many digits as it takes to read back the same."""
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
                    "" if row.directions is None else row.directions,
                    "" if row.fit is None else repr(float(row.fit)),
                    "" if row.unexplained is None else repr(float(row.unexplained)),
                    json.dumps(row.reasons),
                )
            )


def read_trace(path: Path | str) -> tuple[TraceRow, ...]:
    """Read a trace.

    Raises:
        TraceError: If there is no such file, or a line of it does not belong in a trace.
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
        raise TraceError(f"want {len(_HEADER)} cells, got {len(cells)}")
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
