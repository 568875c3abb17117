"""The contract on folders reports what it is there for, in packages that are made up."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import grimp
import pytest
from importlinter.domain.contract import InvalidContractOptions

from tools.import_contracts import FoldersRunOneWay

ROOT = Path(__file__).resolve().parents[1]

_TWO_FLOORS = {"house": ["roof", "cellar"]}


def problems(
    files: Mapping[str, str],
    floors: Mapping[str, Sequence[str]],
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> list[str]:
    """Return what the contract says of a package ``house`` of these files."""
    for name, text in files.items():
        path = folder / "house" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    for inside in [folder / "house", *(p for p in folder.rglob("*") if p.is_dir())]:
        (inside / "__init__.py").touch()
    monkeypatch.syspath_prepend(folder)
    graph = grimp.build_graph("house", cache_dir=None)
    contract = FoldersRunOneWay(
        "folders", {"root_packages": ["house"]}, {"packages": ["house"], "floors": floors}
    )
    checked = contract.check(graph, verbose=False)
    found: list[str] = checked.metadata["problems"]
    assert checked.kept is (found == [])
    return found


CASES: dict[str, tuple[dict[str, str], dict[str, list[str]], list[str]]] = {
    "imports that lead down": (
        {
            "roof/tiles.py": "from house.cellar import coal\nimport house.door",
            "door.py": "from house.cellar.coal import heap",
            "cellar/coal.py": "heap = 1",
        },
        _TWO_FLOORS,
        [],
    ),
    "a circle of folders without a circle of files": (
        {
            "roof/tiles.py": "from house.cellar.coal import heap",
            "roof/gutter.py": "",
            "cellar/coal.py": "heap = 1",
            "cellar/drain.py": "import house.roof.gutter",
        },
        _TWO_FLOORS,
        [
            "house.cellar must not import house.roof: house.cellar.drain -> house.roof.gutter",
            "house.cellar -> house.roof -> house.cellar is a circle: "
            "house.cellar.drain -> house.roof.gutter; house.roof.tiles -> house.cellar.coal",
        ],
    ),
    "an import that climbs by way of a file": (
        {
            "roof/tiles.py": "",
            "ladder.py": "import house.roof.tiles",
            "cellar/coal.py": "def burn():\n    import house.ladder",
        },
        _TWO_FLOORS,
        [
            "house.cellar must not import house.roof: "
            "house.cellar.coal -> house.ladder -> house.roof.tiles"
        ],
    ),
    "folders on one floor": (
        {"roof/tiles.py": "import house.cellar.coal", "cellar/coal.py": ""},
        {"house": ["roof | cellar"]},
        ["house.roof must not import house.cellar: house.roof.tiles -> house.cellar.coal"],
    ),
    "a folder without a floor": (
        {"roof/tiles.py": "", "cellar/coal.py": ""},
        {"house": ["roof"]},
        ["house.cellar has no floor: name it among the floors of house"],
    ),
    "a folder in a folder": (
        {"roof/tiles.py": "", "cellar/coal.py": "", "cellar/wine/red.py": ""},
        _TWO_FLOORS,
        ["house.cellar.wine has no floor: name it among the floors of house.cellar"],
    ),
    "a floor of a folder that has gone": (
        {"roof/tiles.py": "", "cellar/coal.py": ""},
        {"house": ["attic", "roof", "cellar"], "house.garden": ["shed"]},
        [
            "house.garden has floors, but there is no such package",
            "house.attic has a floor, but does not exist",
        ],
    ),
    "a circle of two files in one folder": (
        {
            "roof/tiles.py": "def lay():\n    from house.roof import gutter",
            "roof/gutter.py": "import house.roof.tiles",
            "cellar/coal.py": "",
        },
        _TWO_FLOORS,
        [
            "house.roof.gutter -> house.roof.tiles -> house.roof.gutter is a circle: "
            "house.roof.gutter -> house.roof.tiles; house.roof.tiles -> house.roof.gutter"
        ],
    ),
    "a circle through the package itself": (
        {
            "__init__.py": "import house.roof.tiles",
            "roof/tiles.py": "",
            "roof/gutter.py": "from house import tiles",
            "cellar/coal.py": "",
        },
        _TWO_FLOORS,
        [
            "house -> house.roof -> house is a circle: "
            "house -> house.roof.tiles; house.roof.gutter -> house"
        ],
    ),
}
"""Files of a package, its floors, and what the contract says of them."""


@pytest.mark.parametrize("case", CASES)
def test_the_contract_says_what_leads_the_wrong_way_and_by_which_imports(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files, floors, said = CASES[case]
    assert problems(files, floors, tmp_path, monkeypatch) == said


@pytest.mark.parametrize(
    ("floors", "why"),
    [
        (["roof"], "floors must be a table of lists, one for each package"),
        ({"house": ["roof", "cellar | roof"]}, "house has a folder on two floors"),
    ],
)
def test_floors_that_make_no_sense_are_an_error(floors: Any, why: str) -> None:
    with pytest.raises(InvalidContractOptions) as raised:
        FoldersRunOneWay("folders", {}, {"packages": ["house"], "floors": floors})
    assert raised.value.errors == {"floors": why}


def test_the_contract_of_this_project_covers_all_its_packages() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    linter = settings["tool"]["importlinter"]
    (contract,) = [found for found in linter["contracts"] if found["type"] == "folders"]
    assert sorted(contract["packages"]) == sorted(linter["root_packages"])
