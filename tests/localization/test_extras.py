"""Missing libraries are named with the command that installs them here."""

from __future__ import annotations

import shlex
import sys
import tomllib
from pathlib import Path

import pytest

from localization import extras
from localization.extras import EXTRAS, MissingLibraryError, has, install_command, missing, require

ROOT = Path(__file__).parents[2]


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
        "mujoco": "mujoco-core",
        "open3d": "open3d-cpu",
        "rerun": "rerun-sdk",
    }
    for library, extra in EXTRAS.items():
        if library != "rerun_bindings":  # a part of rerun
            wanted = names.get(library, library)
            assert any(line.startswith(wanted) for line in project["optional-dependencies"][extra])
