"""Drives over the wire, robot and operator in two processes: what ``farsteer sim`` promises."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from localization.evaluation.estimate_trace import read_trace
from localization.evaluation.tum_file import read_tum
from localization.logs.mcap_log import read_log
from localization.maps.cloud import Cloud
from localization.types import Verdict
from robot_sim import World
from teleop.operator.operator_client import TOPICS
from teleop.robot.topics.topic_table import OUTPUTS
from teleop.scenario.lockstep_run import run_over_wire
from teleop.scenario.mission import Mission
from teleop.scenario.run_recorder import RunRecord
from teleop.scenario.run_report import summary_table
from teleop.scenario.run_summary import RunSummary, read_summary
from teleop.scene_clouds import scene_cloud_path

ROOT = Path(__file__).resolve().parents[2]
BITS = ("readings.mcap", "estimate.tum", "truth.tum", "trace.csv")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def drive(
    mission: Mission, office: World, cloud: Cloud, cache: Path, folder: Path
) -> tuple[RunSummary, RunRecord]:
    return run_over_wire(mission, office, cloud, scene_cloud_path("office"), folder, cache=cache)


def operators(folder: Path) -> list[int]:
    """Return the processes that run an operator for a folder."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
        except OSError:  # not a process, or no longer
            continue
        if b"teleop.scenario.scripted_operator" in words and str(folder).encode() in b" ".join(
            words
        ):
            found.append(int(process.name))
    return found


@pytest.mark.long
@pytest.mark.process
def test_robot_and_operator_drive_together_over_the_wire(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    progress: list[tuple[float, str]] = []
    summary, record = run_over_wire(
        Mission(seed=2, duration=12.0),
        office,
        office_cloud,
        scene_cloud_path("office"),
        tmp_path,
        cache=cache,
        progress=lambda share, text: progress.append((share, text)),
    )
    assert record.ending == "completed"
    assert summary.passed, summary.checks
    assert [v.verdict for v in record.verdicts] == [Verdict.ACCEPTED]
    assert summary.distance > 2.0
    assert summary.facts.robot_seconds == 12.0
    assert (tmp_path / "operator.rrd").stat().st_size > 1_000_000
    assert operators(tmp_path) == []
    assert [share for share, _ in progress[1:]] == [second / 12 for second in range(1, 13)]

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
@pytest.mark.untraced
def test_same_seed_gives_the_same_bits_over_the_wire(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    hashes = []
    for name in ("first", "again"):
        folder = tmp_path / name
        drive(Mission(seed=5, slip=(6.0,), duration=12.0), office, office_cloud, cache, folder)
        hashes.append([hashlib.sha256((folder / f).read_bytes()).hexdigest() for f in BITS])
    assert hashes[0] == hashes[1]


@pytest.mark.long
@pytest.mark.process
@pytest.mark.untraced
def test_camera_changes_no_bit_of_the_drive_and_the_operator_sees_its_pictures(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    hashes, seen = [], []
    for camera in (None, "small"):
        folder = tmp_path / str(camera)
        summary, _ = run_over_wire(
            Mission(seed=5, duration=8.0),
            office,
            office_cloud,
            scene_cloud_path("office"),
            folder,
            cache=cache,
            camera=camera,
        )
        hashes.append([hashlib.sha256((folder / f).read_bytes()).hexdigest() for f in BITS])
        traffic = {t.topic: t.messages for t in summary.facts.traffic}
        seen.append(traffic.get("/camera/rgb/image_rect_color/compressed", 0))
    assert hashes[0] == hashes[1]
    assert seen[0] == 0
    assert seen[1] > 60, "the operator asks for one each 0.1 s"


@pytest.mark.process
def test_operator_that_dies_ends_the_run_and_leaves_its_files(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    killed: list[int] = []

    def kill(share: float, text: str) -> None:
        if share >= 0.3 and not killed:
            killed.extend(operators(tmp_path))
            for process in killed:
                os.kill(process, signal.SIGKILL)

    summary, record = run_over_wire(
        Mission(duration=12.0),
        office,
        office_cloud,
        scene_cloud_path("office"),
        tmp_path,
        cache=cache,
        progress=kill,
    )
    assert len(killed) == 1
    assert record.ending == "the operator ended with -9"
    assert not summary.passed
    assert 3.0 < summary.facts.robot_seconds < 12.0
    last = record.ticks[-1]
    assert abs(last.truth.twist.linear[0]) < 0.005, "the robot has braked to rest"


@pytest.mark.long
@pytest.mark.process
@pytest.mark.parametrize("tenth", [1, 4])
def test_interrupted_run_leaves_readable_files_and_no_operator(tenth: int, tmp_path: Path) -> None:
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
            if line.startswith(f"{tenth * 10:3d}%"):
                break
        assert len(operators(folder)) == 1
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert "interrupted" in out
    time.sleep(0.1)
    assert operators(folder) == []

    seconds = json.loads((folder / "summary.json").read_text())["facts"]["robot_seconds"]
    assert tenth * 3.0 <= seconds < 30.0
    readings = list(read_log(folder / "readings.mcap"))
    assert len(readings) > seconds * 100
    truth = read_tum(folder / "truth.tum")
    assert len(truth) == round(seconds * 50)
    assert len(read_trace(folder / "trace.csv")) == len(truth)
    assert len(read_tum(folder / "estimate.tum")) > 0
    assert not read_summary(folder).passed
    assert (folder / "operator.rrd").stat().st_size > 100_000
