"""What is lost without each of the localiser's mechanisms, alone and in pairs.

``python -m benchmarks ablation [alone] [pairs] [--real FOLDER] [--mirror FOLDER] [--out FOLDER]``: drives through
simulated scenes, and excerpts of real logs and the mirror log if their folders are given.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.ablation.drives import COST, EXCERPTS, Drive, drives
from benchmarks.ablation.mechanisms import ALL, MECHANISMS, Change, both
from benchmarks.common.figures import Figure, digits, say
from benchmarks.common.sheet import Sheet, renew

DECIDING = (
    "KISS-ICP odometry",
    "wider priors",
    "wider priors for what fits badly",
    "wider priors while wheels slip",
    "minimum inlier ratio",
    "evidence of being carried",
    "sweeps that share their errors",
    "poses that mostly fit",
    "lasting doubt before a check",
    "waiting between searches",
    "work bound",
)
"""Mechanisms that decide whether the pose is right, or where else the robot is."""

SPECIAL: Mapping[str, tuple[str, ...]] = {
    "carried off": DECIDING,
    "put wrong": DECIDING,
    "kidnaps": DECIDING,
    "late scans": ("late readings", "registration cache"),
    "mount 2 deg off": ("extrinsics monitor",),
}
"""Drives made for some mechanisms; they are run without those only."""

WITH_GYRO = (
    "acceleration limit",
    "tilt by accelerometer",
    "rest after a push",
)
"""Mechanisms that need rim speeds and an inertial unit, which the real logs do not have."""
WITH_LATE = ("late readings", "registration cache")
"""Mechanisms for readings that come late, as they do in none of the simulated drives but that made for them."""

PAIRS: tuple[tuple[str, ...], ...] = (("KISS-ICP odometry", "wider priors"),)
"""Mechanisms that can stand in for each other: what one contributes may show only where the other is missing."""


def rows_alone() -> dict[str, Change]:
    """Return the configurations without one mechanism, and the localiser as it is, by name."""
    return {ALL: both(), **MECHANISMS}


def rows_in_pairs() -> dict[str, Change]:
    """Return the configurations without two mechanisms by name."""
    return {" + ".join(pair): both(*(MECHANISMS[name] for name in pair)) for pair in PAIRS}


def concerned(case: str, row: str) -> bool:
    """Return whether a drive is run for a row: whether one of its mechanisms has a part in the drive."""
    if row == ALL:
        return True
    kind = next((kind for kind in SPECIAL if case.startswith(kind)), None)
    log = any(case == excerpt.case for excerpt in EXCERPTS)
    for name in row.split(" + "):
        if kind is not None:
            if name in SPECIAL[kind]:
                return True
        elif log:
            if name not in WITH_GYRO and name != "extrinsics monitor":
                return True
        elif name not in WITH_LATE and name != "extrinsics monitor":
            return True
    return False


def _run(part: str, rows: Mapping[str, Change], cases: Mapping[str, Drive], sheet: Sheet) -> None:
    """Run each row's drives; the sheet is written after every row."""
    figures: list[Figure] = []
    begun = time.process_time()
    for row, change in rows.items():
        say(f" {part}: {'' if row == ALL else 'without '}{row}")
        for case, drive in cases.items():
            if concerned(case, row):
                found = list(drive(change, row))
                said = ", ".join(f"{f.quantity} {digits(f.value)}" for f in found)
                say(f"  {case:28s} {said}")
                figures += differing(found, [*sheet.parts.get("alone", ()), *figures])
        sheet.put(part, figures, seconds=time.process_time() - begun)
    say(f"   ({time.process_time() - begun:.0f} s of CPU)")


def differing(found: Sequence[Figure], before: Sequence[Figure]) -> Sequence[Figure]:
    """Return the figures of a drive, only the first if all are those of the localiser as it is: the table says ``=``."""
    whole = {(f.case, f.quantity): f for f in before if f.method == ALL}
    as_it_is = [whole.get((f.case, f.quantity), f) for f in found if f.quantity != COST]
    said = [digits(f.value) for f in found if f.quantity != COST]
    other = found[0].method != ALL
    return found[:1] if other and said == [digits(f.value) for f in as_it_is] else found


PARTS = {"alone": rows_alone, "pairs": rows_in_pairs}


def main(
    parts: Sequence[str] = (),
    *,
    out: Path | None = None,
    real: Path | None = None,
    mirror: Path | None = None,
) -> None:
    """Measure the localiser without each mechanism, and without some pairs.

    Args:
        parts: by name; all if none is named.
        out: a sheet of figures, as for the localisation's.
        real: folder of real logs: ``<name>.clf.bz2``, ``<name>-corrected.log.gz``, ``<name>.relations``.
        mirror: folder of the mirror log: ``readings.mcap``, ``cloud.ply``.
    """
    cases, sheet = drives(real, mirror), Sheet(out)
    for part in parts or PARTS:
        _run(part, PARTS[part](), cases, sheet)
    if not parts:
        renew(sheet)
