"""The sheet ``docs/sheets/scenarios.md``, made from the scenario files of the project.

``python -m teleop.scenario.scenarios_page > docs/sheets/scenarios.md`` writes it.
"""

from __future__ import annotations

import sys

from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.shipped import shipped_files

_HEAD = """\
# Sheet: scenarios of the project

Printed by `python -m teleop.scenario.scenarios_page` from the files in `scenarios/`; a test compares the two. `farsteer scenario
run NAME` runs one, `make scenarios` all; [Scenarios](../scenarios.md) explains them.

| scenario | world | driven by | what happens, and what must not |
|---|---|---|---|
"""


def markdown() -> str:
    """Return the sheet."""
    return _HEAD + "".join(f"{row}\n" for row in _rows())


def _rows() -> list[str]:
    rows = []
    for name, file in shipped_files().items():
        it = read_scenario(file)
        driven = it.operator.kind if it.second is None else f"{it.operator.kind}, {it.second.kind}"
        rows.append(f"| `{name}` | {it.world.scene} | {driven} | {it.description} |")
    return rows


if __name__ == "__main__":
    sys.stdout.write(markdown())
