from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.common.figures import OURS, Figure, share
from benchmarks.common.sheet import Sheet
from benchmarks.sheets.people import people

DRIVE = "office, seed 1, alive"


def driven(case: str, hours: float, lost: int) -> list[Figure]:
    counts = ("false alarms of being lost", "false doubts", "wrong for 2 s and not flagged")
    events = [Figure(case, OURS, name, float(lost)) for name in counts]
    return [Figure(case, OURS, "driven", hours, "h"), *events]


def noticed(lost: int, doubted: int) -> list[Figure]:
    case = "carried off among people"
    return [
        share(case, OURS, "said to be lost within 2 s", lost, 100),
        share(case, OURS, "said to be suspect or lost within 2 s", doubted, 100, least=99.0),
    ]


@pytest.fixture
def sheet(tmp_path: Path) -> Sheet:
    return Sheet(tmp_path / "people.json")


def test_hours_of_all_parts_stand_in_one_row_and_each_patience_in_its_own(sheet: Sheet) -> None:
    sheet.put("hours-1", driven(DRIVE, 1.0, 0), seconds=1.0)
    sheet.put("hours-2", driven("office, seed 2, alive", 1.0, 4), seconds=1.0)
    sheet.put("carried", noticed(68, 100), seconds=1.0)
    sheet.put("patience-24", [*noticed(40, 90), *driven(DRIVE, 1.0, 0)], seconds=1.0)
    sheet.put("patience-4", [*noticed(90, 95), *driven(DRIVE, 1.0, 3)], seconds=1.0)
    head, rule, *rows = people(sheet).splitlines()
    assert head.count("|") == rule.count("|")
    assert [row.split(" |")[0] for row in rows] == [
        "| 12 sweeps (default)",
        "| 4 sweeps",
        "| 24 sweeps",
    ]
    assert "| 2 (2) | 2 (" in rows[0]
    assert "4 events: **missed**" in rows[0]
    assert rows[0].count(": met") == 2
    assert rows[2].endswith(": **missed** |")


def test_part_that_is_not_measured_has_no_row(sheet: Sheet) -> None:
    sheet.put("hours-1", driven(DRIVE, 1.0, 0), seconds=1.0)
    assert len(people(sheet).splitlines()) == 2
