"""The ``farsteer`` command, as a process: what it prints, and how it ends."""

from __future__ import annotations

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.tum_file import read_tum
from localization.logs.mcap_log import read_log
from teleop.__main__ import main
from teleop.command_line import COMMANDS
from teleop.scenario.run_files import RUN_FILES


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
    assert max(map(len, done.stdout.splitlines())) <= 80
    for word in ("examples:", "exit status", *(f"\n  {name} " for name in COMMANDS)):
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


def test_run_of_another_scenario_is_sent_to_replay(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "`farsteer scenario replay`" in error_line(["evaluate", str(tmp_path)], capsys)


def test_impossible_settings_are_refused_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert "duration" in error_line(["sim", "--duration", "-3"], capsys)
    assert "pose_error" in error_line(["sim", "--pose-error", "nan"], capsys)


@pytest.mark.slow
def test_hint_outside_the_map_is_rejected_and_the_run_continues(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sim", "--duration", "2", "--pose-error", "500", "--no-picture"]
    # Of a robot that nobody places the map is searched: it finds itself where it stands.
    assert main([*words, "--out", str(tmp_path)]) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "rejected" in output
    assert "outside the map" in output


@pytest.mark.long
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
    from localization.types import Hint
    from robot_sim import Simulation
    from teleop.scene_clouds import scene_cloud_path

    simulation = Simulation("office", seed=0)
    path = tmp_path / "log.mcap"
    with ReadingsWriter(path, simulation.mounts) as log:
        log.write(Hint(0, simulation.truth().map_from_base, np.zeros((6, 6))), 0)
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
    code = (
        "import sys, teleop.command_line;"
        "print(*sorted({'numpy', 'robot_sim', 'websockets', 'msgspec'} & set(sys.modules)))"
    )
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

    monkeypatch.setattr("teleop.scenario.tour.command.Evaluate.__call__", broken)
    with pytest.raises(ValueError, match="not the user's mistake"):
        main(["evaluate", "runs/x"])


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ModuleNotFoundError("x", name="mujoco"), "[sim]'"),
        (ModuleNotFoundError("x", name="rerun.blueprint"), "[operator]'"),
        (ImportError("Open3D does not load"), "does not load"),
        (FileNotFoundError(2, "No such file or directory", "map.ply"), "map.ply"),
        (OSError(errno.ENOSPC, "No space left on device"), "No space left"),
    ],
)
def test_errors_of_the_environment_are_reported_in_one_line(
    error: Exception, text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def failing(self: object) -> int:
        raise error

    monkeypatch.setattr("teleop.scenario.tour.command.Evaluate.__call__", failing)
    assert text in error_line(["evaluate", "runs/x"], capsys)


@pytest.mark.process
def test_simulator_is_imported_without_starting_another_program(tmp_path: Path) -> None:
    """Ctrl-C would end that program as well, whose traceback came after our last line."""
    code = (
        "import sys; started = []\n"
        "sys.addaudithook(lambda name, args: started.append(args) if name == 'subprocess.Popen' else None)\n"
        "import teleop.__main__, mujoco; print(started)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={
            **{k: v for k, v in os.environ.items() if k != "MUJOCO_GL"},
            "PYTHONPATH": str(Path(__file__).parents[2]),
        },
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "[]\n"


@pytest.mark.process
def test_ctrl_c_in_the_first_second_is_one_line(tmp_path: Path) -> None:
    """Wherever it meets the imports, the status is 130 and nothing stays behind."""
    for delay in (0.0, 0.2, 0.5, 0.9):
        process = begin("sim", "--out", str(tmp_path / "run"), cwd=tmp_path)
        # Until Python has read the command it answers itself, which takes seconds where the machine is loaded.
        until_handled(signal.SIGALRM, process.pid)
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        assert (process.returncode, out) == (130, ""), err
        assert err.splitlines()[-1] == "farsteer: interrupted", err
        assert "Traceback" not in err
        assert not list(tmp_path.iterdir())


def until_handled(number: signal.Signals, process: int) -> None:
    """Wait until a process handles a signal."""
    for _ in range(12_000):
        status = Path(f"/proc/{process}/status").read_text(encoding="utf-8")
        handled = re.search(r"^SigCgt:\s+(\w+)$", status, re.MULTILINE)
        if handled is not None and int(handled[1], 16) >> (number - 1) & 1:
            return
        time.sleep(0.005)
    pytest.fail(f"process {process} does not handle {number.name}")


def test_ctrl_c_while_a_compiled_module_begins_is_an_interruption(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """pybind11 raises ``ImportError: initialization failed`` from the KeyboardInterrupt that it met."""

    def interrupted(self: object) -> int:
        raise ImportError("initialization failed") from KeyboardInterrupt()

    monkeypatch.setattr("teleop.scenario.tour.command.Evaluate.__call__", interrupted)
    assert main(["evaluate", "runs/x"]) == 130
    assert capsys.readouterr().err == "\nfarsteer: interrupted\n"


def begin(*words: str, cwd: Path, **environment: str) -> subprocess.Popen[str]:
    """Start the command in a folder."""
    return subprocess.Popen(
        [sys.executable, "-m", "teleop", *words],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


SHORT = ("sim", "--duration", "1", "--no-picture", "--out")


@pytest.mark.long
@pytest.mark.process
def test_terminal_of_ascii_shows_the_report(tmp_path: Path) -> None:
    process = begin(*SHORT, "run", cwd=tmp_path, PYTHONIOENCODING="ascii")
    out, err = process.communicate(timeout=120)
    assert process.returncode == 1, err
    assert "health" in out
    process = begin("evaluate", "run", cwd=tmp_path, PYTHONIOENCODING="ascii")
    assert process.communicate(timeout=60)[0].splitlines()[0] == out.splitlines()[0]


@pytest.mark.process
def test_run_is_complete_without_standard_output_and_its_error(tmp_path: Path) -> None:
    """Closed streams are replaced before any file is opened, which else would get their numbers."""
    command = f"{sys.executable} -m teleop {' '.join(SHORT)} run >&- 2>&- <&-"
    path = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, env=path, check=False)
    assert done.returncode == 1
    assert read_log(tmp_path / "run/readings.mcap").complete
    assert json.loads((tmp_path / "run/summary.json").read_text())["passed"] is False


@pytest.mark.process
def test_reader_who_leaves_early_costs_nothing(tmp_path: Path) -> None:
    command = (
        f"{sys.executable} -m teleop --help | head -1; {sys.executable} -m teleop sim --help | true"
    )
    path = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        ["sh", "-c", command], cwd=tmp_path, env=path, capture_output=True, text=True, check=False
    )
    assert done.stdout == "usage: farsteer COMMAND [OPTIONS]\n"
    assert not done.stderr


@pytest.mark.long
@pytest.mark.process
def test_full_disk_names_the_folder_and_leaves_a_log_that_can_be_read(tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk; the log has whole chunks by then."""
    limited = (
        "import resource, sys; from teleop.__main__ import main;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000));"
        "sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", limited, "sim", "--duration", "60", "--out", "run"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "XDG_CACHE_HOME": "cache"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    last = done.stderr.splitlines()[-1]
    assert re.match(
        r"farsteer: run: File too large; kept there: .*readings\.mcap, scenario\.json", last
    )
    assert "Traceback" not in done.stderr
    log = read_log(tmp_path / "run/readings.mcap")
    assert not log.complete
    assert len(list(log)) > 300


@pytest.mark.process
def test_robot_drives_without_rerun_and_says_what_is_missing(tmp_path: Path) -> None:
    (tmp_path / "path").mkdir()
    # Python reads this at its start, in the operator's process as well.
    (tmp_path / "path/sitecustomize.py").write_text("import sys; sys.modules['rerun'] = None")
    paths = f"{tmp_path / 'path'}:{Path(__file__).parents[2]}"
    process = begin(*SHORT, "run", cwd=tmp_path, PYTHONPATH=paths)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 1, err
    assert out.splitlines()[0].startswith("no operator.rrd: rerun is missing: ")
    assert "waiting 100.0%" in out
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {*RUN_FILES} - {"commands.jsonl", "operator.rrd", "run.png", "steps.csv"}


@pytest.mark.long
@pytest.mark.process
def test_results_are_printed_as_json_and_nothing_else(tmp_path: Path) -> None:
    done = farsteer(*SHORT, "run", "--json", cwd=tmp_path)
    printed = json.loads(done.stdout)
    assert printed.pop("folder") == "run"
    again = json.loads(farsteer("evaluate", "run", "--json", cwd=tmp_path).stdout)
    assert again == printed
    # No pose was found within a second: there is no number for an infinite error.
    values = {check["name"]: check["value"] for check in again["checks"]}
    assert values.pop("violations") == 0.0
    assert set(values.values()) == {None}
    assert done.returncode == 1


def test_earlier_run_is_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "truth.tum").write_text("a long drive")
    line = error_line(["sim", "--out", str(tmp_path)], capsys)
    assert line.endswith("already holds truth.tum: give another folder, or add --overwrite")
    assert [path.name for path in tmp_path.iterdir()] == ["truth.tum"]


def test_recording_of_a_served_robot_is_not_replaced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = tmp_path / "served.mcap"
    record.write_text("an afternoon of driving")
    line = error_line(["serve", "--record", str(record)], capsys)
    assert line == f"farsteer: --record {record} already exists: give another file"
    assert "--record /proc/x.mcap cannot be" in error_line(
        ["serve", "--record", "/proc/x.mcap"], capsys
    )


@pytest.mark.process
def test_bad_settings_are_answered_before_the_simulator_is_loaded(tmp_path: Path) -> None:
    code = (
        "import sys; from teleop.__main__ import main\n"
        "for words in (['serve', '--port', '99999'], ['sim', '--seed', '-1'], ['sim', '--out', '/proc/x'],\n"
        "    ['evaluate', '/nowhere'], ['operate', '--duration', '-1']):\n"
        "    assert main(words) == 2, words\n"
        "print(*sorted({'mujoco', 'rerun', 'matplotlib', 'scipy'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == []
    assert len(done.stderr.split("farsteer: ")) == 6
