"""Setting up an environment: the Makefile's targets, the container and the devcontainer."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
TOOL = """\
#!/bin/sh
echo "$@" >> tool.log
"""
PIP = """\
#!/bin/sh
echo "$@" >> pip.log
for file in "$PIP_CONSTRAINT" "$PIP_BUILD_CONSTRAINT"; do
    for word in $file; do test -f "$word" || exit 9; done  # pip splits both at blanks
done
"""


def make(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    # Variables of the make that runs these tests are not for the one that they run.
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "PIP_", "MFLAGS"))}
    return subprocess.run(
        ["make", *words], cwd=folder, env=clean, capture_output=True, text=True, check=False
    )


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A clone in a path with blanks, whose pip writes down what it is asked for."""
    folder = tmp_path / "my own clone"
    (folder / ".venv/bin").mkdir(parents=True)
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, folder / name)
    (folder / "tools").mkdir()
    for name, program in (
        (".venv/bin/pip", PIP),
        (".venv/bin/python", 'exec sh "$@"'),
        ("tools/build-console", TOOL),
    ):
        (folder / name).write_text(
            program if program.startswith("#") else f"#!/bin/sh\n{program}\n"
        )
        (folder / name).chmod(0o755)
    page = folder / "teleop/console/page"
    page.mkdir(parents=True)
    (page / "index.html").write_text("")
    return folder


@pytest.mark.process
def test_environment_is_made_in_a_path_with_blanks_and_its_size_said_before(clone: Path) -> None:
    done = make(clone, "env")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"Installing what running needs .*: downloads \d+ MB, .*\n", done.stdout)
    assert (
        clone / "pip.log"
    ).read_text() == "install -qq --editable .[sim,operator,lan,camera,arm,servos]\n"
    assert make(clone, "env").stdout.startswith("make: Nothing to be done")


@pytest.mark.process
def test_page_is_built_again_only_when_its_sources_change(clone: Path) -> None:
    log = clone / "tool.log"
    assert make(clone, "env").returncode == 0
    assert log.read_text() == "--fetch-node\n"
    make(clone, "env")
    assert log.read_text() == "--fetch-node\n"
    added = clone / "teleop/console/page/style.css"
    for change in (lambda: added.write_text("p {}"), added.unlink):
        later = (clone / ".venv/.page").stat().st_mtime + 5
        change()
        os.utime(added if added.exists() else added.parent, (later, later))
        log.unlink()
        assert make(clone, "env").returncode == 0
        assert log.read_text() == "--fetch-node\n"
        os.utime(clone / ".venv/.page", (later + 5, later + 5))


@pytest.mark.process
def test_page_that_cannot_be_built_is_tried_again_and_no_error(clone: Path) -> None:
    tool = clone / "tools/build-console"
    tool.write_text(f"{TOOL}exit 1\n")
    for _ in range(2):
        assert make(clone, "env").returncode == 0
    assert (clone / "tool.log").read_text() == "--fetch-node\n" * 2


@pytest.mark.process
def test_worlds_are_made_with_what_building_their_clouds_needs(clone: Path) -> None:
    farsteer = clone / ".venv/bin/farsteer"
    farsteer.write_text('#!/bin/sh\necho "farsteer $@"\n')
    farsteer.chmod(0o755)
    done = make(clone, "world", "ARGS=generate --seed 7")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "farsteer world generate --seed 7"
    assert "map]" in (clone / "pip.log").read_text().splitlines()[-1]


@pytest.fixture(scope="module")
def checker() -> ModuleType:
    """The program that runs the Dockerfile's steps without Docker."""
    loader = SourceFileLoader("check_dockerfile", str(ROOT / "tools/check-dockerfile"))
    spec = spec_from_loader("check_dockerfile", loader)
    assert spec is not None
    module = module_from_spec(spec)
    sys.dont_write_bytecode, before = True, sys.dont_write_bytecode
    try:
        loader.exec_module(module)
    finally:
        sys.dont_write_bytecode = before
    return module


def test_dockerfile_has_only_steps_that_are_checked_without_docker(checker: ModuleType) -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    stages = checker.stages(checker.instructions(text))
    assert list(stages) == ["system", "dev", "run"]  # the last is built unless another is named
    assert stages["run"][0] == stages["dev"][0] == "system"
    words = {word for _, steps in stages.values() for word, _ in steps}
    assert words <= {"RUN", "COPY", "ENV", "WORKDIR", "EXPOSE", "CMD"}
    assert ("RUN", "make env") in stages["run"][1]
    for _, rest in (step for _, steps in stages.values() for step in steps if step[0] == "COPY"):
        assert all((ROOT / source).exists() for source in rest.split()[:-1])


def test_what_is_left_out_of_the_container_is_left_out_where_docker_would(
    checker: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``worlds`` at the top is the user's; ``robot_sim/worlds`` is a package."""
    for name in ("worlds/mine", "robot_sim/worlds/world.py", "robot_sim/__pycache__/x.pyc"):
        (tmp_path / "clone" / name).parent.mkdir(parents=True)
        (tmp_path / "clone" / name).write_text("")
    shutil.copy(ROOT / ".dockerignore", tmp_path / "clone/.dockerignore")
    monkeypatch.setattr(checker, "CLONE", tmp_path / "clone")
    checker.Root(tmp_path / "root", []).copy(["."], tmp_path / "root")
    copied = {p.relative_to(tmp_path / "root").as_posix() for p in (tmp_path / "root").rglob("*")}
    assert copied == {".dockerignore", "robot_sim", "robot_sim/worlds", "robot_sim/worlds/world.py"}


def test_devcontainer_is_a_stage_of_the_dockerfile() -> None:
    folder = ROOT / ".devcontainer"
    container = json.loads((folder / "devcontainer.json").read_text(encoding="utf-8"))
    build = container["build"]
    text = (folder / build["dockerfile"]).read_text(encoding="utf-8")
    assert f" AS {build['target']}\n" in text
    assert (folder / build["context"]).resolve() == ROOT
    target = container["postCreateCommand"].removeprefix("make ")
    assert f"\n{target}:" in (ROOT / "Makefile").read_text(encoding="utf-8")
