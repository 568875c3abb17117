"""The wheel, built from the source distribution and installed outside the clone."""

from __future__ import annotations

import json
import os
import runpy
import site
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

from localization.evaluation.tum_file import read_tum
from localization.logs.mcap_log import read_log

ROOT = Path(__file__).parents[1]
PACKAGES = ("localization", "robot_sim", "teleop")
PAGE = "teleop/console/page"
DATA = {
    "assets": "teleop/assets",
    "scenarios": "teleop/scenarios",
    "scenes": "robot_sim/scenes",
}
"""Folders of the repository that a wheel has inside a package."""

pytestmark = [pytest.mark.slow, pytest.mark.process, pytest.mark.timeout(600)]


def run(*command: str | Path, cwd: Path, status: tuple[int, ...] = (0,)) -> str:
    """Run a command that must succeed, without this clone on its path; return its output."""
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=clean,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode in status, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    run(
        *(sys.executable, "-m", "build", "--no-isolation"),  # the sdist, and the wheel from it
        *("--outdir", folder, ROOT),
        cwd=folder,
    )
    (built,) = folder.glob("farsteer-*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scripts folder of a new environment that holds the wheel, and borrows the rest from ours."""
    home = tmp_path_factory.mktemp("elsewhere") / "venv"
    venv.create(home, symlinks=True, with_pip=False)
    python = home / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check")
    run(*pip, "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=home)
    own = run(python, "-c", "import site; print(site.getsitepackages()[0])", cwd=home).strip()
    # A plain line in a .pth adds a folder but does not run the .pth files in it: our editable
    # installation, which would lead back to the clone, stays behind.
    (Path(own) / "borrowed.pth").write_text("\n".join(site.getsitepackages()) + "\n")
    return python.parent


def in_wheel(name: str) -> str:
    """Return where a file of the repository is in the wheel."""
    top, _, rest = name.partition("/")
    return f"{DATA.get(top, top)}/{rest}"


def test_wheel_holds_every_file_of_the_packages(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
    tracked = run("git", "ls-files", *PACKAGES, *DATA, cwd=ROOT).split("\n")
    wanted = {n for n in tracked if (ROOT / n).is_file() and not n.startswith(f"{PAGE}/")}
    missing = {in_wheel(name) for name in wanted} - inside
    assert not missing
    assert {name.split("/")[0] for name in inside} <= set(PACKAGES)


def test_wheel_holds_the_built_page_and_not_what_it_is_made_of(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if name.startswith(f"{PAGE}/")}
    built = {
        f"{PAGE}/dist/{name}" for name in ("index.html", "console.js", "style.css", "licences.txt")
    }
    assert built <= inside
    assert all(name.startswith(f"{PAGE}/dist/") for name in inside)


def test_source_distribution_holds_the_page_built_and_as_it_is_written(wheel: Path) -> None:
    (archive,) = wheel.parent.glob("farsteer-*.tar.gz")
    with tarfile.open(archive) as tar:
        inside = {name.partition("/")[2] for name in tar.getnames()}
    wanted = ("dist/index.html", "src/main.tsx", "package-lock.json", ".npmrc", "build.mjs")
    assert {f"{PAGE}/{name}" for name in wanted} | {
        "hatch_build.py",
        "tools/build-console",
    } <= inside
    assert not any("node_modules" in name for name in inside)


def test_wheel_is_built_from_the_source_distribution_without_node(
    wheel: Path, tmp_path: Path
) -> None:
    (archive,) = wheel.parent.glob("farsteer-*.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(tmp_path, filter="data")
    (source,) = tmp_path.iterdir()
    tool = runpy.run_path(str(source / "tools/build-console"))
    assert tool["is_built"]()
    # Without a Node in reach the tool succeeds as long as there is nothing to build.
    command = [sys.executable, "-I", "-S", str(source / "tools/build-console")]
    bare = {"PATH": "/nowhere"}
    assert subprocess.run(command, env=bare, check=False).returncode == 0
    (source / PAGE / "src/main.tsx").write_text("")
    done = subprocess.run(command, env=bare, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("build-console: it needs Node 22.12 or newer")
    assert len(done.stderr.splitlines()) == 1
    assert (source / PAGE / "dist/index.html").is_file()


FOUND = """
import json
import localization.evaluation.consistency, localization.logs.mcap_log, robot_sim, teleop
from robot_sim.floorplan.scene_folders import scene_folder
from teleop.console.page_files import built_page
from teleop.ros_types import registry

found = {
    "packages": [m.__file__ for m in (localization, robot_sim, teleop)],
    "page": (built_page() / "index.html").read_text(),
    "scene": (scene_folder("office") / "world.toml").read_text(),
    "types": [registry()["farsteer_msgs/msg/MapInfo"].name],
}
print(json.dumps(found))
"""


def test_packages_page_scenes_and_messages_come_from_the_wheel(
    installed: Path, tmp_path: Path
) -> None:
    found = json.loads(run(installed / "python", "-c", FOUND, cwd=tmp_path))
    assert len(found["packages"]) == 3
    assert all(Path(place).is_relative_to(installed.parent) for place in found["packages"])
    assert "<!doctype html>" in found["page"]
    assert tomllib.loads(found["scene"])
    assert found["types"] == ["farsteer_msgs/msg/MapInfo"]


def test_command_prints_help_and_version(installed: Path, tmp_path: Path) -> None:
    assert run(installed / "farsteer", "--version", cwd=tmp_path).startswith("farsteer 0.")
    assert "usage: farsteer" in run(installed / "farsteer", "--help", cwd=tmp_path)


@pytest.mark.long
def test_robot_drives_outside_the_clone(installed: Path, tmp_path: Path) -> None:
    # Whether so short a drive meets its limits (status 0 or 1) is for the scenarios to judge.
    command = (installed / "farsteer", "sim", "--duration", "5", "--out", tmp_path / "drive")
    run(*command, cwd=tmp_path, status=(0, 1))
    log = read_log(tmp_path / "drive" / "readings.mcap")
    assert log.complete
    assert {type(reading).__name__ for reading in log} >= {"Scan", "WheelSpeeds", "Inertial"}
    assert len(read_tum(tmp_path / "drive" / "truth.tum")) > 1
