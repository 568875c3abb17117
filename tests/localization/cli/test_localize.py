"""``farsteer localize`` as a user meets it: files, figures, notices."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.trajectory import Trajectory
from localization.evaluation.tum_file import read_tum, write_tum
from localization.maps.map_files import save_cloud
from localization.types import SECOND, Pose
from teleop.__main__ import main
from tests.support_rooms import HALL, Drive, write_log

ROOT = Path(__file__).parents[3]
START = Pose.planar(2.6, 1.6, 0.2)
EXTRAS = ("mujoco", "open3d", "rerun", "websockets", "cbor2", "matplotlib", "embreex")
"""What the base install lacks."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of some seconds in a hall, the hall's map, and where the robot truly was."""
    place = tmp_path_factory.mktemp("hall")
    drive = Drive(HALL, START, (1.0, 0.0, 0.0), (4.0, 0.5, 0.35), (1.0, 0.0, 0.5), noise=0.012)
    write_log(place / "drive.mcap", drive.readings())
    save_cloud(HALL.cloud(), place / "hall.ply")
    stamps = range(0, drive.end, SECOND // 50)
    write_tum(place / "truth.tum", Trajectory.from_poses((s, drive.pose(s)) for s in stamps))
    return place


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def words(folder: Path, out: Path, *more: str) -> list[str]:
    where = ["--map", str(folder / "hall.ply"), "--start", "2.8", "1.5", "12", "--out", str(out)]
    return ["localize", str(folder / "drive.mcap"), *where, *more]


@pytest.mark.slow
def test_all_files_are_written_and_the_summary_is_printed(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(words(folder, out, "--truth", str(folder / "truth.tum"))) == 0
    printed = capsys.readouterr()
    assert {path.name for path in out.iterdir()} == {
        "config.json", "covariance.csv", "estimate.tum", "health.csv", "recording.rrd", "report.html",
    }  # fmt: skip
    assert "100%" in printed.err
    known = read_tum(out / "estimate.tum")
    truth = read_tum(folder / "truth.tum")
    off = np.linalg.norm(truth.at(known.stamps)[0] - known.positions, axis=1)
    (line,) = (x for x in printed.out.splitlines() if x.startswith("  ATE, position [mm]"))
    rmse = float(line.split()[3])
    assert rmse == pytest.approx(1e3 * np.sqrt((off**2).mean()), abs=0.01)
    assert rmse < 10.0
    rows = (out / "covariance.csv").read_text().count("\n")
    assert rows == len(known) + 1
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 1
    assert page.count("<svg") == 7
    assert all(f'class="path {style}"' in page for style in ("reference", "state is-tracking"))
    assert all(words in page for words in ("95 %, enlarged", "hint accepted", "3 sigma", "NEES(6)"))
    assert f'<td class="n">{line.split()[3]}</td>' in page
    assert not re.search(r"https?:|<script|url\(", page)
    assert "default-src 'none'" in page
    assert (out / "recording.rrd").read_bytes()[:3] == b"RRF"


@pytest.mark.slow
def test_reference_of_another_time_is_reported_and_skipped(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    late = tmp_path / "late.tum"
    late.write_text("1000 0 0 0 0 0 0 1\n1001 1 0 0 0 0 0 1\n")
    out = tmp_path / "out"
    options = ("--truth", str(late), "--no-recording", "--no-report")
    assert main(words(folder, out, *options)) == 0
    assert "do not overlap in time" in capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {
        "config.json", "covariance.csv", "estimate.tum", "health.csv",
    }  # fmt: skip


@pytest.mark.slow
def test_estimates_before_the_damage_of_a_log_are_written(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("localization.logs.mcap_file._CHUNK_SIZE", 16 * 1024)
    log, out = tmp_path / "drive.mcap", tmp_path / "out"
    data = bytearray(write_log(log, Drive(HALL, START, (4.0, 0.5, 0.35)).readings()).read_bytes())
    half = len(data) // 2
    data[half : half + 50] = bytes(50)
    log.write_bytes(data)
    asked = ["localize", str(log), *words(folder, out, "--no-recording", "--no-report")[2:]]
    assert main(asked) == 2
    assert 50 < len(read_tum(out / "estimate.tum")) < 180
    printed = capsys.readouterr()
    assert "the log is damaged: writing the estimates so far" in printed.out
    assert f"{log}: damaged" in printed.err


def test_missing_reference_is_an_error_before_the_work(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(folder, tmp_path / "out", "--truth", "nowhere.tum")) == 2
    assert "nowhere.tum: No such file" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_base_install_localises_and_names_the_missing_extras(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    code = (
        "import sys\n"
        f"sys.modules.update(dict.fromkeys({EXTRAS!r}))\n"  # None: as if it were not installed
        "from teleop.__main__ import main\n"
        f"sys.exit(main({words(folder, out)!r}))"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "no recording.rrd: rerun is missing: " in done.stdout
    assert "[operator]'" in done.stdout
    assert {path.name for path in out.iterdir()} == {
        "config.json", "covariance.csv", "estimate.tum", "health.csv", "report.html",
    }  # fmt: skip
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 6
    assert "<img" in page


@pytest.mark.slow
def test_settings_of_file_and_command_line_are_used_and_kept(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept, out = tmp_path / "mine.toml", tmp_path / "out"
    kept.write_text("registration.normal_noise = 0.2\n[health]\ncheck_after = 2.5\n")
    options = ["--settings", str(kept), "--set", "registration.normal_noise=0.15"]
    options += ["--set", "matcher=none", "--no-recording", "--no-report"]
    assert main(words(folder, out, *options)) in (0, 1)
    capsys.readouterr()
    config = json.loads((out / "config.json").read_text())
    assert config["localizer"]["registration"]["normal_noise"] == 0.15
    assert config["localizer"]["health"]["check_after"] == 2.5
    assert config["localizer"]["matcher"] == "none"
    assert config["changed"] == {
        "registration.normal_noise": "0.15",
        "health.check_after": 2.5,
        "matcher": "none",
    }
    again = tmp_path / "again"
    options = ["--settings", str(out / "config.json"), "--no-recording", "--no-report"]
    assert main(words(folder, again, *options)) in (0, 1)
    repeated = json.loads((again / "config.json").read_text())
    assert repeated["localizer"] == config["localizer"]
    assert (again / "estimate.tum").read_bytes() == (out / "estimate.tum").read_bytes()


def test_wrong_setting_is_an_error_before_the_work(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(folder, tmp_path / "out", "--set", "registration.normal_nois=1")) == 2
    said = capsys.readouterr().err
    assert "nearest: registration.normal_noise" in said
    assert len(said.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
