"""Every program in ``examples/`` runs as its docstring says, and prints what it promises."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.tum_file import read_tum
from tests.warm_python import WarmPython

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path.name for path in (ROOT / "examples").glob("*.py"))
OFFICE = ROOT / "scenes/office/cloud.ply"

pytestmark = [pytest.mark.slow, pytest.mark.process]


Run = Callable[..., str]


@pytest.fixture(scope="module")
def run() -> Iterator[Run]:
    """Return a function that runs an example, which must succeed without a warning, and returns what it prints."""
    with WarmPython(environment()) as python:

        def run_one(name: str, *arguments: str | Path) -> str:
            done = python.run(str(ROOT / "examples" / name), *map(str, arguments), cwd=Path.cwd())
            assert done.returncode == 0, done.stderr
            assert not done.stderr
            return done.stdout

        yield run_one


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of a short run, as ``make sim`` leaves them."""
    folder = tmp_path_factory.mktemp("runs") / "first"
    subprocess.run(
        [sys.executable, "-m", "teleop", "sim", "--duration", "8", "--no-picture", "--out", folder],
        env=environment(),
        cwd=ROOT,
        capture_output=True,
        check=False,
    )
    assert (folder / "readings.mcap").is_file()
    return folder


@pytest.fixture
def robot() -> Iterator[str]:
    """The port of a robot in real time."""
    process = subprocess.Popen(
        [sys.executable, "-m", "teleop", "serve", "--port", "0"],
        env=environment(),
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield process.stdout.readline().rstrip().rsplit(":", 1)[1]
    finally:
        process.terminate()
        process.communicate(timeout=60)


def test_every_example_is_listed_and_tested() -> None:
    page = (ROOT / "examples/README.md").read_text(encoding="utf-8")
    source = Path(__file__).read_text(encoding="utf-8")
    assert len(EXAMPLES) >= 8
    assert [name for name in EXAMPLES if f"`{name}`" not in page] == []
    assert [name for name in EXAMPLES if f'"{name}"' not in source] == []


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_explains_itself(name: str, run: Run) -> None:
    assert run(name, "--help").startswith(f"usage: {name} [-h]")


def test_robot_drives_forward_by_roslibpy(run: Run, robot: str) -> None:
    printed = run("01_drive_with_roslibpy.py", "--port", robot, "--seconds", "1.5")
    assert "odometry messages, moved by" in printed
    x, y = (
        float(word)
        for word in printed.split()
        if word.replace("-", "").replace(".", "").isdigit() and "." in word
    )
    assert x**2 + y**2 > 0.1**2


def test_robot_steps_in_lockstep(run: Run) -> None:
    printed = run("02_step_in_lockstep.py", "--seconds", "3")
    assert printed.startswith("3.0 s of robot time, drove ")
    assert 0.5 < float(printed.split()[-2]) < 3.0


def test_log_is_localised_and_compared(run: Run, drive: Path, tmp_path: Path) -> None:
    out = tmp_path / "estimate.tum"
    reference = drive / "truth.tum"
    log = drive / "readings.mcap"
    printed = run("03_localize_a_log.py", log, OFFICE, "--reference", reference, "--out", out)
    assert "tracking" in printed
    assert float(printed.split("rmse: ")[1].split()[0]) < 20.0
    assert out.read_text()


def test_robot_without_a_pose_is_found(run: Run, drive: Path) -> None:
    printed = run("04_relocalize.py", drive / "readings.mcap", OFFICE)
    found = re.search(r"([\d.]+) s: found at x ([\d.-]+) m, y ([\d.-]+) m", printed)
    assert found is not None, printed
    seconds, x, y = map(float, found.groups())
    truth = read_tum(drive / "truth.tum")
    then = truth.pose(int(np.abs(truth.stamps - seconds * 1e9).argmin()))
    assert np.hypot(x - then.position[0], y - then.position[1]) < 0.1


def test_own_world_is_driven_through(run: Run) -> None:
    printed = run("05_own_world.py", "--seconds", "4")
    assert "from x 2.00 m to x 3." in printed
    assert "touches: nothing" in printed


def test_own_scanner_has_its_own_beams(run: Run) -> None:
    printed = run("06_own_scanner.py")
    assert "laser_horizontal: 241 beams" in printed
    assert "laser_vertical:" in printed


def test_map_is_made_of_readings_alone(run: Run, drive: Path, tmp_path: Path) -> None:
    printed = run("07_map_from_a_log.py", drive / "readings.mcap", tmp_path / "map.ply")
    assert int(printed.split()[-2]) > 1000
    assert (tmp_path / "map.ply").read_bytes().startswith(b"ply")


def test_mission_meets_its_limits(run: Run, tmp_path: Path) -> None:
    printed = run("08_run_a_mission.py", "--seconds", "12", "--out", tmp_path / "run")
    assert "MISSED" not in printed
    assert (tmp_path / "run/summary.json").is_file()


def test_run_is_read_and_plotted(run: Run, drive: Path, tmp_path: Path) -> None:
    printed = run("09_read_a_run.py", drive, "--out", tmp_path / "error.png")
    assert "scene office, seed 0" in printed
    assert (tmp_path / "error.png").read_bytes().startswith(b"\x89PNG")


def test_rosbridge_serves_without_a_robot(run: Run) -> None:
    assert run("10_rosbridge_without_a_robot.py").split("\n")[:2] == [
        "topic: hello",
        "service: 5",
    ]


def test_operator_of_ones_own_drives_by_sight_and_is_judged(run: Run) -> None:
    printed = run("11_own_operator.py", "--seconds", "10")
    assert printed.startswith("the time of the run is over")
    assert printed.count("met   ") == 3
