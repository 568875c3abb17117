"""Missing libraries are named with the command that installs them here."""

from __future__ import annotations

import ast
import re
import shlex
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from localization import extras
from localization.extras import EXTRAS, MissingLibraryError, has, install_command, missing, require

ROOT = Path(__file__).parents[2]
OURS = ("localization", "robot_sim", "teleop")


def test_command_installs_from_the_clone_that_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    words = shlex.split(install_command("map"))
    after = words[words.index("install") :]
    assert after == ["install", "--constraint", "constraints.txt", "--editable", ".[map]"]


def test_command_works_from_another_folder_and_with_blanks_in_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clone = tmp_path / "my clone" / "farsteer"
    clone.mkdir(parents=True)
    (clone / "constraints.txt").write_text("")
    monkeypatch.setattr(extras, "_clone", lambda: (clone, False))
    monkeypatch.chdir("/")
    words = shlex.split(install_command("sim"))
    assert Path("/", words[-1]) == Path(f"{clone}[sim]")
    monkeypatch.chdir(clone.parent)
    assert shlex.split(install_command("sim"))[-1] == "./farsteer[sim]"


def test_without_a_clone_the_command_is_for_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "_clone", lambda: None)
    assert install_command("sim").startswith("in a clone of farsteer, ")
    assert install_command("sim").endswith("install '.[sim]'")


def test_missing_library_is_an_error_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    require("cbor2", "the wire")
    monkeypatch.setitem(sys.modules, "open3d", None)
    assert not has("open3d")
    with pytest.raises(MissingLibraryError, match=r"building a map needs open3d: .*\[map\]"):
        require("open3d", "building a map")
    assert missing("open3d").startswith("open3d is missing: ")


def test_every_library_is_of_the_extra_that_is_named() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    names = {
        "OpenGL": "mujoco-core",
        "dask": "distributed",
        "mujoco": "mujoco-core",
        "open3d": "open3d-cpu",
        "rerun": "rerun-sdk",
        "serial": "pyserial",
    }
    for library, extra in EXTRAS.items():
        if library != "rerun_bindings":  # a part of rerun
            wanted = names.get(library, library)
            assert any(line.startswith(wanted) for line in project["optional-dependencies"][extra])


def imported() -> Iterator[tuple[str, Path]]:
    """Yield the library of each import of our code, wherever it is written, and the file."""
    for path in (file for folder in OURS for file in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                yield from ((alias.name.partition(".")[0], path) for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                yield node.module.partition(".")[0], path


def always_installed() -> set[str]:
    """Return the import names of the distributions that an installation without extras has."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    base = {normal(line) for line in project["dependencies"]}
    return {
        name for name, wheels in packages_distributions().items() if base & set(map(normal, wheels))
    }


def normal(requirement: str) -> str:
    """Return the name of a distribution as PEP 503 compares it, without version and extras."""
    name = re.match(r"[\w.-]+", requirement)
    assert name is not None
    return re.sub(r"[-_.]+", "-", name[0]).lower()


@pytest.mark.slow
def test_every_library_that_our_code_imports_has_its_extra_unless_it_is_always_installed() -> None:
    known = {*sys.stdlib_module_names, *OURS, *always_installed(), *EXTRAS}
    # The plug-in of pytest is imported by pytest alone.
    unknown = {(name, str(path.relative_to(ROOT))) for name, path in imported()} - {
        ("pytest", "teleop/scenario/pytest_plugin.py")
    }
    assert sorted(pair for pair in unknown if pair[0] not in known) == []
