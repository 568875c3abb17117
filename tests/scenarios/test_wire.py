"""Drives over the wire, robot and operator in two processes: what ``farsteer sim`` promises."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from localization.evaluation.estimate_trace import read_trace
from localization.evaluation.tum_file import read_tum
from localization.logs.mcap_log import read_log
from teleop.operator.operator_client import TOPICS
from teleop.robot.topics.topic_table import OUTPUTS
from teleop.scenario.tour.drive import DrivenTour, drive_tour
from teleop.scenario.tour.options import TourOptions, tour_scenario
from teleop.scenario.tour.report import summary_table
from teleop.scenario.tour.summary import read_summary

ROOT = Path(__file__).resolve().parents[2]
BITS = ("readings.mcap", "estimate.tum", "truth.tum", "trace.csv")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def drive(
    options: TourOptions,
    folder: Path,
    *,
    camera: str | None = None,
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> DrivenTour:
    scenario, _ = tour_scenario(options)
    return drive_tour(scenario, folder, camera=camera, picture=False, progress=progress)


def stations(folder: Path) -> list[int]:
    """Return the processes of stations whose runs have a folder."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
            environment = (process / "environ").read_bytes()
        except OSError:  # not a process, or no longer
            continue
        if b"teleop.scenario.tour.station" in words and str(folder).encode() in environment:
            found.append(int(process.name))
    return found


@pytest.mark.long
@pytest.mark.process
def test_robot_and_station_drive_together_over_the_wire(tmp_path: Path) -> None:
    progress: list[tuple[float, str]] = []
    driven = drive(
        TourOptions(seed=2, duration=12.0),
        tmp_path,
        progress=lambda share, text: progress.append((share, text)),
    )
    summary = driven.summary
    assert driven.outcome.ending == "the time of the run is over"
    assert summary.passed, summary.checks
    (verdict,) = summary.facts.verdicts
    assert verdict.startswith("accepted")
    assert summary.distance > 2.0
    assert summary.facts.robot_seconds == 12.0
    assert (tmp_path / "operator.rrd").stat().st_size > 1_000_000
    assert stations(tmp_path) == []
    seconds = [(share, text) for share, text in progress if " s at " in text]
    assert [share for share, _ in seconds] == [second / 12 for second in range(1, 13)]

    # Joy to motion: a tick to take it, and the ramp up to what counts as motion.
    assert summary.facts.joy_to_motion
    assert all(0.02 <= seconds <= 0.2 for seconds in summary.facts.joy_to_motion)

    traffic = {t.topic: t for t in summary.facts.traffic}
    assert traffic["/local_cloud"].messages > 80
    for topic in OUTPUTS:
        if topic.name in TOPICS and topic.every:
            # What the robot sends, or less if the operator asks for less.
            assert 100 <= traffic[topic.name].messages <= 600 // topic.every, topic.name
    assert traffic["(to the robot)"].messages > 200
    assert sum(t.bytes for t in traffic.values()) < 12 * 1_000_000
    assert "joy to motion" in summary_table(summary)
    assert "/local_cloud" in summary_table(summary)
    again = read_summary(tmp_path)
    assert again.facts == summary.facts
    assert again.checks == summary.checks


@pytest.mark.long
@pytest.mark.process
def test_same_seed_gives_the_same_bits_with_a_camera_whose_pictures_the_station_sees(
    tmp_path: Path,
) -> None:
    hashes, seen = [], []
    for camera in (None, "small"):
        folder = tmp_path / str(camera)
        options = TourOptions(seed=5, slip=(4.0,), duration=8.0)
        summary = drive(options, folder, camera=camera).summary
        hashes.append([hashlib.sha256((folder / f).read_bytes()).hexdigest() for f in BITS])
        traffic = {t.topic: t.messages for t in summary.facts.traffic}
        seen.append(traffic.get("/camera/rgb/image_rect_color/compressed", 0))
    assert hashes[0] == hashes[1]
    assert seen[0] == 0
    assert seen[1] > 60, "the operator asks for one each 0.1 s"


@pytest.mark.process
def test_station_that_dies_ends_the_run_and_leaves_its_files(tmp_path: Path) -> None:
    killed: list[int] = []

    def kill(share: float, text: str) -> None:
        if share >= 0.3 and not killed:
            killed.extend(stations(tmp_path))
            for process in killed:
                os.kill(process, signal.SIGKILL)

    driven = drive(TourOptions(duration=12.0), tmp_path, progress=kill)
    assert len(killed) == 1
    assert driven.outcome.ending.startswith("the client ended with signal 9")
    assert not driven.summary.passed
    assert 3.0 < driven.summary.facts.robot_seconds < 12.0
    assert abs(driven.outcome.lines.speed[-1, 0]) < 0.005, "the robot has braked to rest"


@pytest.mark.long
@pytest.mark.process
def test_interrupted_run_leaves_readable_files_and_no_operator(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "teleop", "sim", "--duration", "30"),
            *("--out", str(folder), "--no-picture"),
        ],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith(" 40%"):
                break
        assert len(stations(folder)) == 1
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert "interrupted" in out
    time.sleep(0.1)
    assert stations(folder) == []

    seconds = json.loads((folder / "summary.json").read_text())["facts"]["robot_seconds"]
    assert 12.0 <= seconds < 30.0
    readings = list(read_log(folder / "readings.mcap"))
    assert len(readings) > seconds * 100
    truth = read_tum(folder / "truth.tum")
    assert len(truth) == round(seconds * 50)
    assert len(read_trace(folder / "trace.csv")) == len(truth)
    assert len(read_tum(folder / "estimate.tum")) > 0
    assert not read_summary(folder).passed
    assert (folder / "operator.rrd").stat().st_size > 100_000
