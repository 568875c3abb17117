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


def test_imports_that_lead_down_are_allowed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "roof/tiles.py": "from house.cellar import coal\nimport house.door",
        "door.py": "from house.cellar.coal import heap",
        "cellar/coal.py": "heap = 1",
    }
    assert problems(files, _TWO_FLOORS, tmp_path, monkeypatch) == []


def test_a_circle_of_folders_without_a_circle_of_files_is_reported_with_its_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "roof/tiles.py": "from house.cellar.coal import heap",
        "roof/gutter.py": "",
        "cellar/coal.py": "heap = 1",
        "cellar/drain.py": "import house.roof.gutter",
    }
    assert problems(files, _TWO_FLOORS, tmp_path, monkeypatch) == [
        "house.cellar must not import house.roof: house.cellar.drain -> house.roof.gutter",
        "house.cellar -> house.roof -> house.cellar is a circle: "
        "house.cellar.drain -> house.roof.gutter; house.roof.tiles -> house.cellar.coal",
    ]


def test_an_import_that_climbs_by_way_of_a_file_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "roof/tiles.py": "",
        "ladder.py": "import house.roof.tiles",
        "cellar/coal.py": "def burn():\n    import house.ladder",
    }
    assert problems(files, _TWO_FLOORS, tmp_path, monkeypatch) == [
        "house.cellar must not import house.roof: "
        "house.cellar.coal -> house.ladder -> house.roof.tiles"
    ]


def test_folders_on_one_floor_do_not_import_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {"roof/tiles.py": "import house.cellar.coal", "cellar/coal.py": ""}
    floors = {"house": ["roof | cellar"]}
    assert problems(files, floors, tmp_path, monkeypatch) == [
        "house.roof must not import house.cellar: house.roof.tiles -> house.cellar.coal"
    ]


@pytest.mark.parametrize("floors", [{}, {"house": ["roof"]}])
def test_a_folder_without_a_floor_is_reported(
    floors: dict[str, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {"roof/tiles.py": "", "cellar/coal.py": ""}
    found = problems(files, floors, tmp_path, monkeypatch)
    assert "house.cellar has no floor: name it among the floors of house" in found


def test_a_folder_in_a_folder_needs_a_floor_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {"roof/tiles.py": "", "cellar/coal.py": "", "cellar/wine/red.py": ""}
    assert problems(files, _TWO_FLOORS, tmp_path, monkeypatch) == [
        "house.cellar.wine has no floor: name it among the floors of house.cellar"
    ]


def test_a_floor_of_a_folder_that_has_gone_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {"roof/tiles.py": "", "cellar/coal.py": ""}
    floors = {"house": ["attic", "roof", "cellar"], "house.garden": ["shed"]}
    assert problems(files, floors, tmp_path, monkeypatch) == [
        "house.garden has floors, but there is no such package",
        "house.attic has a floor, but does not exist",
    ]


def test_a_circle_of_two_files_in_one_folder_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "roof/tiles.py": "def lay():\n    from house.roof import gutter",
        "roof/gutter.py": "import house.roof.tiles",
        "cellar/coal.py": "",
    }
    (found,) = problems(files, _TWO_FLOORS, tmp_path, monkeypatch)
    assert found.startswith(
        "house.roof.gutter -> house.roof.tiles -> house.roof.gutter is a circle"
    )


def test_a_circle_through_the_package_itself_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "__init__.py": "import house.roof.tiles",
        "roof/tiles.py": "",
        "roof/gutter.py": "from house import tiles",
        "cellar/coal.py": "",
    }
    (found,) = problems(files, _TWO_FLOORS, tmp_path, monkeypatch)
    assert found == (
        "house -> house.roof -> house is a circle: "
        "house -> house.roof.tiles; house.roof.gutter -> house"
    )


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
