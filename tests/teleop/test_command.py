"""The ``farsteer`` command, as a process: what it prints, and how it ends."""

from __future__ import annotations

import errno
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from localization.evaluation.tum_file import read_tum
from localization.logs.mcap_log import read_log
from teleop.__main__ import main


def farsteer(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "teleop", *words],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
    )


def error_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command that must fail with status 2 and one line."""
    assert main(words) == 2
    text = capsys.readouterr().err
    assert "Traceback" not in text
    (line,) = [part for part in text.splitlines() if part.startswith("farsteer: ")]
    return line


@pytest.mark.process
def test_help_teaches_with_examples(tmp_path: Path) -> None:
    done = farsteer("--help", cwd=tmp_path)
    assert done.returncode == 0
    for word in (
        "examples:",
        "farsteer sim",
        "farsteer evaluate",
        "farsteer localize",
        "exit status",
    ):
        assert word in done.stdout


def test_unknown_scene_is_answered_with_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert "office" in error_line(["sim", "--scene", "atlantis"], capsys)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"not a cloud at all", "is not a cloud; PLY, PCD and texts"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n", "damaged"),
    ],
)
def test_damaged_or_foreign_cloud_is_refused_in_one_line(
    content: bytes, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from localization.logs.mcap_writer import ReadingsWriter
    from tests.support import MOUNTS

    with ReadingsWriter(tmp_path / "log.mcap", MOUNTS):
        pass
    cloud = tmp_path / "cloud.ply"
    cloud.write_bytes(content)
    line = error_line(["localize", str(tmp_path / "log.mcap"), "--map", str(cloud)], capsys)
    assert says in line


def test_missing_and_foreign_logs_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = str(tmp_path / "none.mcap")
    assert "No such file" in error_line(["localize", missing, "--map", "x.ply"], capsys)
    foreign = tmp_path / "foreign.mcap"
    foreign.write_text("hello, this is not a log")
    assert "logs are MCAP files, ROS bags or CARMEN texts" in error_line(
        ["localize", str(foreign), "--map", "x.ply"], capsys
    )


def test_impossible_settings_are_refused_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert "duration" in error_line(["sim", "--duration", "-3"], capsys)
    assert "pose_error" in error_line(["sim", "--pose-error", "nan"], capsys)


def test_hint_outside_the_map_is_rejected_and_the_run_continues(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "sim",
        "--duration",
        "2",
        "--pose-error",
        "500",
        "--no-picture",
        "--out",
        str(tmp_path),
    ]
    assert main(words) == 1
    output = capsys.readouterr().out
    assert "rejected" in output
    assert "outside the map" in output


@pytest.mark.process
def test_ctrl_c_in_the_middle_leaves_files_that_can_be_read(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-m", "teleop", "sim", "--out", str(folder), "--no-picture"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    log = folder / "readings.mcap"
    while process.poll() is None and not (log.is_file() and log.stat().st_size > 100_000):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert "interrupted" in out
    assert read_log(log).complete
    assert len(read_tum(folder / "truth.tum")) > 10
    done = farsteer("evaluate", str(folder), cwd=tmp_path)
    assert "interrupted" in done.stdout
    assert done.returncode == 1


@pytest.mark.slow
def test_localize_reports_rejected_readings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Repeated readings are rejected, counted and reported; the rest is used."""
    from localization.logs.mcap_writer import ReadingsWriter
    from robot_sim import Simulation
    from teleop.scenario.mission import Mission
    from teleop.scene_clouds import scene_cloud_path

    simulation = Simulation("office", seed=0)
    path = tmp_path / "log.mcap"
    with ReadingsWriter(path, simulation.mounts) as log:
        log.write(Mission().hint(simulation.truth().map_from_base), 0)
        first = None
        for _ in range(60):
            for reading in simulation.step():
                log.write(reading, simulation.stamp)
                first = first or reading
        assert first is not None
        log.write(first, simulation.stamp)
        for reading in simulation.step():
            log.write(reading, simulation.stamp)
    assert (
        main(
            [
                "localize",
                str(path),
                "--map",
                str(scene_cloud_path("office")),
                "--out",
                str(tmp_path),
            ]
        )
        == 0
    )
    output = capsys.readouterr().out
    assert "1 readings refused" in output
    assert "must have a stamp of its own" in output


@pytest.mark.process
def test_help_needs_neither_numpy_nor_the_simulation(tmp_path: Path) -> None:
    """What ``--help`` imports decides how long it takes."""
    code = "import sys, teleop.__main__; print(*sorted({'numpy', 'robot_sim'} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == []


def test_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert re.fullmatch(r"farsteer \d+\.\d+\.\d+\n", capsys.readouterr().out)


def test_defect_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: object) -> int:
        raise ValueError("not the user's mistake")

    monkeypatch.setattr("teleop.scenario.commands.Evaluate.__call__", broken)
    with pytest.raises(ValueError, match="not the user's mistake"):
        main(["evaluate", "runs/x"])


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ModuleNotFoundError("x", name="mujoco"), "pip install 'farsteer[sim]'"),
        (ImportError("building a map needs Open3D"), "needs Open3D"),
        (FileNotFoundError(2, "No such file or directory", "map.ply"), "map.ply"),
        (OSError(errno.ENOSPC, "No space left on device"), "No space left"),
    ],
)
def test_errors_of_the_environment_are_reported_in_one_line(
    error: Exception, text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def failing(self: object) -> int:
        raise error

    monkeypatch.setattr("teleop.scenario.commands.Evaluate.__call__", failing)
    assert text in error_line(["evaluate", "runs/x"], capsys)
